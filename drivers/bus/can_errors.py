"""CAN error frames of the kernel in words, and the state of the controller that they tell (linux/can/error.h)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from enum import Enum
from typing import NamedTuple

ALL_CLASSES = 0x1FFF_FFFF
"""Error classes for CAN_RAW_ERR_FILTER: all of them."""

TX_TIMEOUT = 0x001
LOST_ARBITRATION = 0x002
CONTROLLER = 0x004
PROTOCOL = 0x008
TRANSCEIVER = 0x010
NO_ACKNOWLEDGE = 0x020
BUS_OFF = 0x040
BUS_ERROR = 0x080
RESTARTED = 0x100
COUNTERS = 0x200

_DATA_BYTES = 8
_CONTROLLER_WORDS = {
    0x01: "receive buffer of the controller overflowed",
    0x02: "transmit buffer of the controller overflowed",
    0x04: "many errors in receiving (warning)",
    0x08: "many errors in sending (warning)",
    0x10: "too many errors in receiving (error passive)",
    0x20: "too many errors in sending (error passive)",
    0x40: "back to error active",
}
_WARNING = 0x0C
_PASSIVE = 0x30
_ACTIVE = 0x40
_PROTOCOL_WORDS = {
    0x01: "bit error",
    0x02: "form error",
    0x04: "stuff error",
    0x08: "a dominant bit could not be sent",
    0x10: "a recessive bit could not be sent",
    0x20: "overload",
    0x40: "an active error flag was sent",
    0x80: "while sending",
}
_LOCATIONS = {
    0x02: "identifier bits 28 to 21",
    0x03: "start of frame",
    0x04: "substitute RTR bit",
    0x05: "identifier extension bit",
    0x06: "identifier bits 20 to 18",
    0x07: "identifier bits 17 to 13",
    0x08: "CRC sequence",
    0x09: "reserved bit 0",
    0x0A: "data",
    0x0B: "data length code",
    0x0C: "RTR bit",
    0x0D: "reserved bit 1",
    0x0E: "identifier bits 4 to 0",
    0x0F: "identifier bits 12 to 5",
    0x12: "intermission",
    0x18: "CRC delimiter",
    0x19: "acknowledge slot",
    0x1A: "end of frame",
    0x1B: "acknowledge delimiter",
}
_CAN_H = {4: "no wire", 5: "shorted to the battery", 6: "shorted to VCC", 7: "shorted to ground"}
_CAN_L = {**_CAN_H, 8: "shorted to CANH"}


class ControllerState(Enum):
    """Fault confinement of a CAN controller (ISO 11898-1), in the kernel's words."""

    ERROR_ACTIVE = "error-active"
    ERROR_WARNING = "error-warning"
    ERROR_PASSIVE = "error-passive"
    BUS_OFF = "bus-off"


class ErrorReport(NamedTuple):
    """What an error frame says.

    Attributes:
        words: one phrase for each thing that it reports.
        state: the controller's state from now on; None where the frame does not tell.
        counters: errors in sending and in receiving that the controller counts; None where the frame does not tell.
    """

    words: tuple[str, ...]
    state: ControllerState | None
    counters: tuple[int, int] | None


def parse_error(can_id: int, data: bytes) -> ErrorReport:
    """Read an error frame.

    Args:
        can_id: its error classes; flags above them do not count.
        data: its details; bytes that are missing count as zero.
    """
    details = data.ljust(_DATA_BYTES, b"\0")
    words = tuple(_words(can_id, details)) or ("error of no known class",)
    counters = (details[6], details[7]) if can_id & COUNTERS else None
    return ErrorReport(words, controller_state(can_id, details), counters)


def controller_state(can_id: int, data: bytes) -> ControllerState | None:
    """The controller's state that an error frame tells; None where it tells none."""
    if can_id & BUS_OFF:
        return ControllerState.BUS_OFF
    if can_id & RESTARTED:
        return ControllerState.ERROR_ACTIVE
    status = data[1] if can_id & CONTROLLER and len(data) > 1 else 0
    if status & _PASSIVE:
        return ControllerState.ERROR_PASSIVE
    if status & _WARNING:
        return ControllerState.ERROR_WARNING
    return ControllerState.ERROR_ACTIVE if status & _ACTIVE else None


def _words(classes: int, details: bytes) -> Iterator[str]:
    if classes & BUS_OFF:
        yield "bus-off"
    if classes & RESTARTED:
        yield "controller restarted"
    if classes & CONTROLLER:
        yield from _set_bits(_CONTROLLER_WORDS, details[1], "controller problem")
    if classes & NO_ACKNOWLEDGE:
        yield "no node acknowledges"
    if classes & PROTOCOL and (details[2] or not classes & NO_ACKNOWLEDGE):
        yield _protocol(details[2], details[3])
    if classes & TRANSCEIVER:
        yield from _transceiver(details[4])
    if classes & LOST_ARBITRATION:
        yield "arbitration lost" + (f" in bit {details[0]}" if details[0] else "")
    if classes & TX_TIMEOUT:
        yield "the driver gave up sending (time-out)"
    if classes & BUS_ERROR and not classes & (PROTOCOL | NO_ACKNOWLEDGE):
        yield "bus error"


def _set_bits(words: Mapping[int, str], value: int, otherwise: str) -> list[str]:
    return [text for bit, text in words.items() if value & bit] or [otherwise]


def _protocol(kind: int, location: int) -> str:
    what = ", ".join(_set_bits(_PROTOCOL_WORDS, kind, "protocol error"))
    return f"{what} in {_LOCATIONS[location]}" if location in _LOCATIONS else what


def _transceiver(status: int) -> Iterator[str]:
    high, low = _CAN_H.get(status & 0x0F), _CAN_L.get(status >> 4)
    if high:
        yield f"CANH {high}"
    if low:
        yield f"CANL {low}"
    if not high and not low:
        yield "transceiver problem"
