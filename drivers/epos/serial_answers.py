"""Answers of the RS-232 protocol of the EPOS: pure bytes (maxon EPOS Communication Guide 6.3).

Every answer has operation code 0 and begins with a 32-bit error code, 0 where all went well. It names neither the
request nor the object: only the handshake around it tells which request it belongs to.
"""

from __future__ import annotations

from collections.abc import Container
from typing import NamedTuple

from drivers.epos.serial_frames import (
    MAX_SEGMENT_BYTES,
    MORE_BIT,
    TOGGLE_BIT,
    Frame,
    Opcode,
    make_frame,
)


class Answer(NamedTuple):
    """What the drive says to a request.

    Attributes:
        error: 0, an SDO abort code or one of maxon's own (Communication Guide 6.4).
        data: value of an object (4 bytes, as many count as it has), segment, or data of a CAN frame.
        toggle: toggle bit of a segment.
        more: another segment follows.
        accepted: bytes of a written segment that the drive took.
    """

    error: int = 0
    data: bytes = b""
    toggle: int = 0
    more: bool = False
    accepted: int = 0


def make_read_answer(data: bytes, error: int = 0) -> bytes:
    """Answer to ReadObject: a value of up to 4 bytes, filled with zeros."""
    return _make(error, data.ljust(4, b"\0"))


def make_done_answer(error: int = 0) -> bytes:
    """Answer to WriteObject, InitiateSegmentedRead and InitiateSegmentedWrite."""
    return _make(error, b"")


def make_segment_answer(data: bytes, toggle: int, more: bool, error: int = 0) -> bytes:
    """Answer to SegmentRead: up to 63 bytes."""
    return _make(error, bytes((len(data) | toggle * TOGGLE_BIT | more * MORE_BIT,)) + data)


def make_segment_written_answer(accepted: int, toggle: int, error: int = 0) -> bytes:
    """Answer to SegmentWrite."""
    return _make(error, bytes((accepted | toggle * TOGGLE_BIT, 0)))


def make_can_frame_answer(data: bytes, error: int = 0) -> bytes:
    """Answer to RequestCANFrame: the data of the CAN frame that came."""
    return _make(error, data)


def _make(error: int, rest: bytes) -> bytes:
    return make_frame(Opcode.ANSWER, error.to_bytes(4, "little") + rest)


_ANY_SEGMENT = range(6, 69, 2)
_SIZES: dict[int, Container[int]] = {
    Opcode.READ_OBJECT: (8,),
    Opcode.WRITE_OBJECT: (4,),
    Opcode.INITIATE_SEGMENTED_READ: (4,),
    Opcode.INITIATE_SEGMENTED_WRITE: (4,),
    Opcode.SEGMENT_READ: _ANY_SEGMENT,
    Opcode.SEGMENT_WRITE: (6,),
    Opcode.REQUEST_CAN_FRAME: range(4, 13, 2),
}
_ERROR_ALONE = 4


def may_answer(request: bytes, size: int) -> bool:
    """Whether an answer to this request may have ``size`` data bytes; one with an error may end after the code."""
    opcode = request[0]
    if opcode == Opcode.REQUEST_CAN_FRAME:
        return size in (_ERROR_ALONE, 4 + request[4] + (request[4] & 1), 12)
    return opcode in _SIZES and (size == _ERROR_ALONE or size in _SIZES[opcode])


def parse_answer(request: bytes, frame: Frame) -> Answer | str:
    """The answer to a request frame, or why this is none.

    Args:
        request: the whole frame that was sent.
        frame: what came back.
    """
    opcode, data = request[0], frame.data
    if frame.opcode != Opcode.ANSWER:
        return "operation code of no answer"
    if not may_answer(request, len(data)):
        return "wrong length for an answer to this request"
    error, rest = int.from_bytes(data[:4], "little"), data[4:]
    if error:
        return Answer(error)
    if len(data) not in _SIZES[opcode]:
        return "no error and no data"
    if opcode == Opcode.SEGMENT_READ:
        return _segment(rest)
    if opcode == Opcode.SEGMENT_WRITE:
        return Answer(toggle=rest[0] >> 6 & 1, accepted=rest[0] & MAX_SEGMENT_BYTES)
    if opcode == Opcode.REQUEST_CAN_FRAME:
        return Answer(data=rest[: request[4]]) if len(rest) >= request[4] else "CAN frame shorter than asked for"
    return Answer(data=rest)


def _segment(rest: bytes) -> Answer | str:
    length = rest[0] & MAX_SEGMENT_BYTES
    if len(rest) != 1 + length + (1 + length & 1):
        return "length of the segment and of the frame differ"
    return Answer(data=rest[1 : 1 + length], toggle=rest[0] >> 6 & 1, more=bool(rest[0] & MORE_BIT))
