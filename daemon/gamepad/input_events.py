"""What the kernel's event devices say, as bytes and requests (Linux, include/uapi/linux/input.h).

Read with the standard library alone: the bindings on PyPI need a compiler and the kernel's headers on every board but
x86-64.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from typing import Final, NamedTuple

EVENT: Final = struct.Struct("llHHi")
"""struct input_event: seconds, microseconds (both of the size of a long), type, code, value."""
ABS_INFO: Final = struct.Struct("6i")
"""struct input_absinfo: value, minimum, maximum, fuzz, flat, resolution."""
EV_SYN, EV_KEY, EV_ABS = 0x00, 0x01, 0x03
SYN_REPORT, SYN_DROPPED = 0, 3
KEY_BYTES: Final = 0x300 // 8
"""KEY_CNT bits."""
_READ: Final = 2


class Event(NamedTuple):
    """One event."""

    type: int
    code: int
    value: int


def parse_events(data: bytes) -> Iterator[Event]:
    """The events in what was read; half an event at the end, which no kernel sends, is left out."""
    whole = len(data) - len(data) % EVENT.size
    for _, _, kind, code, value in EVENT.iter_unpack(data[:whole]):
        yield Event(kind, code, value)


def parse_bits(data: bytes) -> set[int]:
    """Numbers of the bits that are set, the lowest bit of the first byte being 0."""
    return {8 * index + bit for index, byte in enumerate(data) for bit in range(8) if byte >> bit & 1}


def absinfo_request(axis: int) -> int:
    """EVIOCGABS: value and range of an axis."""
    return _request(0x40 + axis, ABS_INFO.size)


def keys_request() -> int:
    """EVIOCGKEY: which keys and buttons are pressed."""
    return _request(0x18, KEY_BYTES)


def _request(number: int, size: int) -> int:
    """_IOC(_IOC_READ, 'E', number, size) of include/uapi/asm-generic/ioctl.h."""
    return _READ << 30 | size << 16 | ord("E") << 8 | number
