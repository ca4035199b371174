"""Requests to the NXT: all direct commands of LEGO's Appendix 2, and three system commands of Appendix 1.

Ports, modes and states are those of :mod:`drivers.nxt.codes`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Final

from drivers.nxt.codes import Kind
from drivers.nxt.layout import NAME_SIZE, Telegram, require_at_most, require_text

MAX_MESSAGE: Final = 58
"""Longest message to a mailbox, without its final zero."""
MAX_LOW_SPEED: Final = 16
"""Most bytes to or from a sensor at once."""
MAX_BRICK_NAME: Final = 14


@dataclass(frozen=True, slots=True)
class StartProgram(Telegram):
    """Start a program on the brick (``NAME.rxe``)."""

    OPCODE: ClassVar[int] = 0x00
    LAYOUT: ClassVar[str] = f"{NAME_SIZE}s"
    file_name: str

    def __post_init__(self) -> None:
        require_text(self.file_name, NAME_SIZE - 1)


@dataclass(frozen=True, slots=True)
class StopProgram(Telegram):
    """Stop the program that runs on the brick."""

    OPCODE: ClassVar[int] = 0x01


@dataclass(frozen=True, slots=True)
class PlaySoundFile(Telegram):
    """Play a file of sounds, once or for ever."""

    OPCODE: ClassVar[int] = 0x02
    LAYOUT: ClassVar[str] = f"?{NAME_SIZE}s"
    loop: bool
    file_name: str

    def __post_init__(self) -> None:
        require_text(self.file_name, NAME_SIZE - 1)


@dataclass(frozen=True, slots=True)
class PlayTone(Telegram):
    """Play a tone."""

    OPCODE: ClassVar[int] = 0x03
    LAYOUT: ClassVar[str] = "HH"
    frequency_hz: int
    duration_ms: int


@dataclass(frozen=True, slots=True)
class SetOutputState(Telegram):
    """Drive a motor; a tacho limit of 0 means for ever."""

    OPCODE: ClassVar[int] = 0x04
    LAYOUT: ClassVar[str] = "BbBBbBI"
    port: int
    power: int
    mode: int
    regulation: int
    turn_ratio: int
    run_state: int
    tacho_limit_deg: int


@dataclass(frozen=True, slots=True)
class SetInputMode(Telegram):
    """Say what is plugged into a sensor port and how it is scaled."""

    OPCODE: ClassVar[int] = 0x05
    LAYOUT: ClassVar[str] = "BBB"
    port: int
    sensor_type: int
    sensor_mode: int


@dataclass(frozen=True, slots=True)
class GetOutputState(Telegram):
    """Read a motor: what it was told and its three counters."""

    OPCODE: ClassVar[int] = 0x06
    LAYOUT: ClassVar[str] = "B"
    port: int


@dataclass(frozen=True, slots=True)
class GetInputValues(Telegram):
    """Read a sensor."""

    OPCODE: ClassVar[int] = 0x07
    LAYOUT: ClassVar[str] = "B"
    port: int


@dataclass(frozen=True, slots=True)
class ResetInputScaledValue(Telegram):
    """Zero a sensor's scaled value, for instance a count."""

    OPCODE: ClassVar[int] = 0x08
    LAYOUT: ClassVar[str] = "B"
    port: int


@dataclass(frozen=True, slots=True)
class MessageWrite(Telegram):
    """A message to a mailbox of the running program; its size and its final zero are added on the wire."""

    OPCODE: ClassVar[int] = 0x09
    mailbox: int
    data: bytes

    def __post_init__(self) -> None:
        require_at_most(self.data, MAX_MESSAGE)

    def pack(self) -> bytes:
        return bytes((self.mailbox, len(self.data) + 1)) + self.data + b"\0"

    @classmethod
    def unpack(cls, payload: bytes) -> MessageWrite:
        if not 3 <= len(payload) <= MAX_MESSAGE + 3 or payload[1] != len(payload) - 2 or payload[-1]:
            raise ValueError("a message has its size, up to 58 bytes and a final zero")
        return cls(payload[0], payload[2:-1])


@dataclass(frozen=True, slots=True)
class ResetMotorPosition(Telegram):
    """Zero one counter of a motor: that of the block (relative), or that of the rotation."""

    OPCODE: ClassVar[int] = 0x0A
    LAYOUT: ClassVar[str] = "B?"
    port: int
    relative: bool


@dataclass(frozen=True, slots=True)
class GetBatteryLevel(Telegram):
    """Read the battery's voltage."""

    OPCODE: ClassVar[int] = 0x0B


@dataclass(frozen=True, slots=True)
class StopSound(Telegram):
    """Be silent."""

    OPCODE: ClassVar[int] = 0x0C


@dataclass(frozen=True, slots=True)
class KeepAlive(Telegram):
    """Start the brick's sleep timer anew."""

    OPCODE: ClassVar[int] = 0x0D


@dataclass(frozen=True, slots=True)
class LowSpeedGetStatus(Telegram):
    """Ask how many bytes of a digital sensor are ready."""

    OPCODE: ClassVar[int] = 0x0E
    LAYOUT: ClassVar[str] = "B"
    port: int


@dataclass(frozen=True, slots=True)
class LowSpeedWrite(Telegram):
    """Write to a digital sensor, and read as many bytes as asked for."""

    OPCODE: ClassVar[int] = 0x0F
    port: int
    data: bytes
    answer_size: int

    def __post_init__(self) -> None:
        require_at_most(self.data, MAX_LOW_SPEED)

    def pack(self) -> bytes:
        return bytes((self.port, len(self.data), self.answer_size)) + self.data

    @classmethod
    def unpack(cls, payload: bytes) -> LowSpeedWrite:
        if not 3 <= len(payload) <= MAX_LOW_SPEED + 3 or payload[1] != len(payload) - 3:
            raise ValueError("a write to a sensor has its size and up to 16 bytes")
        return cls(payload[0], payload[3:], payload[2])


@dataclass(frozen=True, slots=True)
class LowSpeedRead(Telegram):
    """Read what a digital sensor has answered."""

    OPCODE: ClassVar[int] = 0x10
    LAYOUT: ClassVar[str] = "B"
    port: int


@dataclass(frozen=True, slots=True)
class GetCurrentProgram(Telegram):
    """Ask for the name of the running program."""

    OPCODE: ClassVar[int] = 0x11


@dataclass(frozen=True, slots=True)
class MessageRead(Telegram):
    """Read a message of the running program."""

    OPCODE: ClassVar[int] = 0x13
    LAYOUT: ClassVar[str] = "BB?"
    remote_mailbox: int
    local_mailbox: int
    remove: bool


@dataclass(frozen=True, slots=True)
class GetFirmwareVersion(Telegram):
    """Ask for the versions of protocol and firmware."""

    KIND: ClassVar[Kind] = Kind.SYSTEM
    OPCODE: ClassVar[int] = 0x88


@dataclass(frozen=True, slots=True)
class SetBrickName(Telegram):
    """Give the brick a name of up to 14 characters."""

    KIND: ClassVar[Kind] = Kind.SYSTEM
    OPCODE: ClassVar[int] = 0x98
    LAYOUT: ClassVar[str] = f"{MAX_BRICK_NAME + 1}s"
    name: str

    def __post_init__(self) -> None:
        require_text(self.name, MAX_BRICK_NAME)


@dataclass(frozen=True, slots=True)
class GetDeviceInfo(Telegram):
    """Ask for name, Bluetooth address and free memory."""

    KIND: ClassVar[Kind] = Kind.SYSTEM
    OPCODE: ClassVar[int] = 0x9B


REQUESTS: Final[dict[tuple[int, int], type[Telegram]]] = {
    (request.KIND, request.OPCODE): request
    for request in (
        StartProgram,
        StopProgram,
        PlaySoundFile,
        PlayTone,
        SetOutputState,
        SetInputMode,
        GetOutputState,
        GetInputValues,
        ResetInputScaledValue,
        MessageWrite,
        ResetMotorPosition,
        GetBatteryLevel,
        StopSound,
        KeepAlive,
        LowSpeedGetStatus,
        LowSpeedWrite,
        LowSpeedRead,
        GetCurrentProgram,
        MessageRead,
        GetFirmwareVersion,
        SetBrickName,
        GetDeviceInfo,
    )
}
"""Every request by kind and opcode."""
