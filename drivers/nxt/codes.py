"""What the numbers in the NXT's telegrams stand for; each status with its remedy.

Source: LEGO MINDSTORMS NXT Bluetooth Developer Kit, Appendix 1 (communication protocol) and Appendix 2 (direct
commands); the LEGO NXT firmware where the appendices are silent.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum, IntFlag
from typing import Final


class Kind(IntEnum):
    """First byte of a telegram."""

    DIRECT = 0x00
    SYSTEM = 0x01
    REPLY = 0x02


NO_REPLY: Final = 0x80
"""Added to the first byte of a request that wants no reply."""


class Output(IntEnum):
    """Motor ports."""

    A = 0
    B = 1
    C = 2
    ALL = 0xFF
    """All three; only where an output is set."""


class Input(IntEnum):
    """Sensor ports, as they are printed on the brick."""

    S1 = 0
    S2 = 1
    S3 = 2
    S4 = 3


class OutputMode(IntFlag):
    """How an output is driven; none of them lets the motor coast."""

    IDLE = 0
    MOTOR_ON = 1
    BRAKE = 2
    """Short the motor between the pulses of its power, and at power 0."""
    REGULATED = 4


class Regulation(IntEnum):
    """What the brick regulates."""

    IDLE = 0
    SPEED = 1
    SYNC = 2
    """Two motors at the ratio of the turn ratio."""


class RunState(IntEnum):
    """What an output is doing."""

    IDLE = 0x00
    RAMP_UP = 0x10
    RUNNING = 0x20
    RAMP_DOWN = 0x40


class SensorType(IntEnum):
    """What is plugged into a sensor port."""

    NONE = 0
    SWITCH = 1
    TEMPERATURE = 2
    REFLECTION = 3
    ANGLE = 4
    LIGHT_ACTIVE = 5
    LIGHT_INACTIVE = 6
    SOUND_DB = 7
    SOUND_DBA = 8
    CUSTOM = 9
    LOW_SPEED = 10
    LOW_SPEED_9V = 11
    HIGH_SPEED = 12
    COLOUR_FULL = 13
    COLOUR_RED = 14
    COLOUR_GREEN = 15
    COLOUR_BLUE = 16
    COLOUR_NONE = 17
    COLOUR_EXIT = 18


class SensorMode(IntEnum):
    """How the scaled value of a sensor is made."""

    RAW = 0x00
    BOOLEAN = 0x20
    EDGE_COUNT = 0x40
    PULSE_COUNT = 0x60
    PERCENT = 0x80
    CELSIUS = 0xA0
    FAHRENHEIT = 0xC0
    ROTATION = 0xE0


@dataclass(frozen=True, slots=True)
class Status:
    """A status other than 0 in a reply.

    Attributes:
        code: the byte.
        meaning: what happened.
        remedy: what to do next, one sentence.
    """

    code: int
    meaning: str
    remedy: str


OK: Final = 0x00
MAILBOX_EMPTY: Final = 0x40
REQUEST_FAILED: Final = 0xBD
UNKNOWN_OPCODE: Final = 0xBE
INSANE_PACKET: Final = 0xBF
OUT_OF_RANGE: Final = 0xC0
SENSOR_BUS_ERROR: Final = 0xDD
NOT_CONFIGURED: Final = 0xE0
NO_PROGRAM: Final = 0xEC
ILLEGAL_MAILBOX: Final = 0xEE

_FILES = "close other files, or switch the brick off and on"
_SPACE = "delete files on the brick"
_NAME = "give an existing file as NAME.EXT, 15 and 3 characters at most"
_RESTART = "try again; if it happens again, switch the brick off and on"
_REQUEST = "the request is wrong for this brick: read its firmware version and check the values"
_SENSOR = "set the port's sensor type to low speed first, and check the sensor's cable"

STATUSES: Final = {
    code: Status(code, meaning, remedy)
    for code, meaning, remedy in (
        (0x20, "a transaction is still pending", "ask again a little later"),
        (0x40, "the mailbox is empty", "nothing was sent to it; ask again later, and check the number of the mailbox"),
        (0x81, "no more file handles", _FILES),
        (0x82, "no space", _SPACE),
        (0x83, "no more files", "nothing to do: the search has come to its end"),
        (0x84, "end of file expected", _NAME),
        (0x85, "end of file", "nothing to do: there is no more data"),
        (0x86, "not a linear file", "copy the file to the brick again"),
        (0x87, "file not found", _NAME),
        (0x88, "the file handle is already closed", "open the file again"),
        (0x89, "no linear space", _SPACE),
        (0x8A, "undefined error", _RESTART),
        (0x8B, "the file is busy", "stop the program that uses it"),
        (0x8C, "no write buffers", _RESTART),
        (0x8D, "append is not possible", "delete the file and write it anew"),
        (0x8E, "the file is full", "delete the file and write it anew, larger"),
        (0x8F, "the file exists already", "choose another name, or delete it"),
        (0x90, "module not found", _REQUEST),
        (0x91, "out of the module's bounds", _REQUEST),
        (0x92, "illegal file name", _NAME),
        (0x93, "illegal file handle", "open the file again"),
        (0xBD, "the request failed", "does the file exist on the brick?"),
        (0xBE, "unknown command", _REQUEST),
        (0xBF, "the packet makes no sense", _REQUEST),
        (0xC0, "a value is out of range", "motor ports are A to C, sensor ports S1 to S4, power -100 to 100"),
        (0xDD, "error on the sensor's bus", _SENSOR),
        (0xDE, "no memory in the communication buffer", _RESTART),
        (0xDF, "the channel is not valid", _SENSOR),
        (0xE0, "the channel is busy or not configured", _SENSOR),
        (0xEC, "no program is running", "start one on the brick first"),
        (0xED, "illegal size", "send 58 bytes at most in a message, 16 to a sensor"),
        (0xEE, "illegal mailbox", "mailboxes are 0 to 9, those of the brick's own answers 10 to 19"),
        (0xEF, "invalid field of a structure", _REQUEST),
        (0xF0, "bad port", "motor ports are A to C, sensor ports S1 to S4"),
        (0xFB, "the brick is out of memory", "stop its program and delete files"),
        (0xFF, "bad arguments", _REQUEST),
    )
}
"""What may stand in the status byte of a reply, by code."""


def status_of(code: int) -> Status:
    """The status for a code, also for one that no document names."""
    return STATUSES.get(code) or Status(code, "a status that no document names", _RESTART)
