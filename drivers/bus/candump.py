"""The text of candump's log files: ``(1607120998.528012) vcan0 181#3706``, one frame a line, ``R`` for a remote frame.

It is what ``candump -L`` writes and what ``canplayer`` and python-can read (can-utils, lib.c, format of log files).
"""

from __future__ import annotations

import re
import struct
from collections.abc import Iterator
from typing import NamedTuple

from drivers.bus.contract import ID_MASK, RTR_FLAG

_LINE = re.compile(
    r"\((\d+\.\d+)\) (\S+) ([0-7][0-9A-Fa-f]{2})#(?:[Rr][0-8]?|((?:[0-9A-Fa-f]{2}){0,8}))(?: [RT])?\s*", re.ASCII
)


_PACKED = struct.Struct("=dIB8s")
PACKED_BYTES = _PACKED.size
"""Of one packed frame."""
pack_frame = _PACKED.pack
"""A frame as it is gathered where there is no time for a line: time stamp, identifier, length and data.
:func:`make_lines` makes lines of many."""


class LogFrame(NamedTuple):
    """One line of a log.

    Attributes:
        timestamp_s: seconds since the log's epoch.
        interface: name of the interface.
        can_id: 11-bit identifier, with RTR_FLAG for a remote frame.
        data: 0 to 8 bytes, empty for a remote frame.
    """

    timestamp_s: float
    interface: str
    can_id: int
    data: bytes


def make_line(timestamp_s: float, interface: str, can_id: int, data: bytes) -> str:
    """One line without its line end; the time in full microseconds."""
    return make_lines(pack_frame(timestamp_s, can_id, len(data), data), 0.0, interface)[:-1].decode()


def make_lines(packed: bytes | bytearray, epoch_s: float, interface: str) -> bytes:
    """The lines of packed frames one after the other, each with its line end.

    Args:
        packed: of :func:`pack_frame`.
        epoch_s: added to each time stamp.
        interface: name of the interface.
    """
    heads: dict[int, str] = {}
    lines: list[str] = []
    for timestamp_s, can_id, length, data in _PACKED.iter_unpack(packed):
        head = heads.get(can_id)
        if head is None:
            head = heads[can_id] = f"{interface} {can_id & ID_MASK:03X}#{'R' if can_id & RTR_FLAG else ''}"
        time_us = str(round((epoch_s + timestamp_s) * 1e6)).zfill(16)
        lines.append(f"({time_us[:-6]}.{time_us[-6:]}) {head}{data[:length].hex().upper()}\n")
    return "".join(lines).encode()


def unpack_frames(packed: bytes | bytearray) -> Iterator[tuple[float, int, bytes]]:
    """Time stamp, identifier and data of each packed frame."""
    for timestamp_s, can_id, length, data in _PACKED.iter_unpack(packed):
        yield timestamp_s, can_id, data[:length]


def parse_line(line: str) -> LogFrame | None:
    """The frame of one line; None for anything but a classic base frame (extended, FD and error frames too)."""
    match = _LINE.fullmatch(line)
    if match is None:
        return None
    time_text, interface, number, data = match.groups()
    if data is None:
        return LogFrame(float(time_text), interface, int(number, 16) | RTR_FLAG, b"")
    return LogFrame(float(time_text), interface, int(number, 16), bytes.fromhex(data))
