"""What goes through a raw SocketCAN socket, as bytes: frames, filters and what the kernel tells beside a frame.

Layouts are those of linux/can.h (``struct can_frame``, ``struct can_filter``) and socket(7).
"""

from __future__ import annotations

import struct
from collections.abc import Iterable

from drivers.bus.contract import ID_MASK, RTR_FLAG

ERROR_FLAG = 0x2000_0000
EXTENDED_FLAG = 0x8000_0000
FRAME_BYTES = 16
LONGEST_PACKET_BYTES = 72
"""A CAN FD frame; nothing longer comes through such a socket."""
MAX_DATA_BYTES = 8
MAX_FILTERS = 512
"""CAN_RAW_FILTER_MAX."""
EVERYTHING = struct.pack("=II", 0, 0)
"""The filter that lets every frame through."""

SO_RXQ_OVFL = 40
SO_TIMESTAMPNS = 35
ANCILLARY_BYTES = 128
"""Room for a time stamp and an overflow count, each with its header."""

_NO_BASE_FRAME = ~(ID_MASK | RTR_FLAG)
_FRAME = struct.Struct("=IB3x8s")
_FILTER = struct.Struct("=II")
_TIMESPEC = struct.Struct("@ll")
_COUNT = struct.Struct("=I")
_TIMESPEC_BYTES = _TIMESPEC.size
_pack_frame, _unpack_frame, _unpack_timespec = _FRAME.pack, _FRAME.unpack, _TIMESPEC.unpack

Ancillary = list[tuple[int, int, bytes]]
"""What ``recvmsg`` gives beside a frame: level, type and value."""


def make_frame(can_id: int, data: bytes) -> bytes:
    """A frame for the kernel.

    Args:
        can_id: 11-bit identifier, with RTR_FLAG for a remote frame.
        data: 0 to 8 bytes.

    Raises:
        ValueError: an identifier or a length that a classic base frame cannot have.
    """
    length = len(data)
    if can_id & _NO_BASE_FRAME or length > MAX_DATA_BYTES:
        raise ValueError(f"no classic base frame: identifier 0x{can_id:X}, {length} data bytes")
    return _pack_frame(can_id, length, data)


def parse_frame(packet: bytes) -> tuple[int, bytes] | None:
    """Identifier with its flags (ERROR_FLAG, RTR_FLAG) and data; None for anything but a classic base frame."""
    if len(packet) != FRAME_BYTES:
        return None
    can_id, length, data = _unpack_frame(packet)
    if length > MAX_DATA_BYTES:
        return None
    if can_id <= ID_MASK:
        return can_id, data[:length]
    if can_id & EXTENDED_FLAG:
        return None
    if can_id & ERROR_FLAG:
        return can_id, data
    return None if can_id & _NO_BASE_FRAME else (can_id, b"")


def make_filters(can_ids: Iterable[int]) -> bytes:
    """CAN_RAW_FILTER for the data and remote frames of some base identifiers; for all where they are too many."""
    filters = [_FILTER.pack(can_id & ID_MASK, ID_MASK | EXTENDED_FLAG) for can_id in can_ids]
    return b"".join(filters) if len(filters) <= MAX_FILTERS else EVERYTHING


def parse_ancillary(ancillary: Ancillary) -> tuple[float | None, int]:
    """Wall-clock time at which a frame came, in s, and how many frames were lost before it since the socket was made.

    The kernel tells a count only where frames were lost, and None stands for a time that it did not tell.
    """
    stamp_s: float | None = None
    lost = 0
    for _, kind, value in ancillary:
        if kind == SO_TIMESTAMPNS and len(value) == _TIMESPEC_BYTES:
            seconds, nanoseconds = _unpack_timespec(value)
            stamp_s = seconds + nanoseconds * 1e-9
        elif kind == SO_RXQ_OVFL and len(value) == _COUNT.size:
            lost = _COUNT.unpack(value)[0]
    return stamp_s, lost
