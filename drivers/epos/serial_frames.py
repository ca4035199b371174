"""Frames of the first-generation RS-232 protocol of the EPOS: pure bytes (maxon EPOS Communication Guide 6).

A frame is operation code, number of data words minus one, data words, CRC; words go low byte first. The same commands
and answers travel in the framing of later drives, too (:mod:`drivers.epos.serial_frames_v2`).
"""

from __future__ import annotations

import struct
from binascii import crc_hqx
from collections.abc import Callable
from dataclasses import dataclass
from enum import IntEnum
from typing import NamedTuple

OKAY = 0x4F
"""Acknowledge byte ``O``: ready, or the frame was good (EPOS Communication Guide 6.2.5)."""
FAILED = 0x46
"""Acknowledge byte ``F``: not ready, or the CRC was wrong."""

CRC_WRONG = "CRC wrong"
"""The reason of :func:`parse_frame` that a drive answers with ``F``."""

MAX_WORDS = 256
MAX_SEGMENT_BYTES = 63
TOGGLE_BIT = 0x40
MORE_BIT = 0x80


class Opcode(IntEnum):
    """Operation codes; 0x20 and 0x21 are not in the manual of 2004 but in maxon's library."""

    ANSWER = 0x00
    SEND_NMT = 0x0E
    READ_OBJECT = 0x10
    WRITE_OBJECT = 0x11
    INITIATE_SEGMENTED_READ = 0x12
    INITIATE_SEGMENTED_WRITE = 0x13
    SEGMENT_READ = 0x14
    SEGMENT_WRITE = 0x15
    SEND_CAN_FRAME = 0x20
    REQUEST_CAN_FRAME = 0x21


UNANSWERED = frozenset((Opcode.SEND_NMT, Opcode.SEND_CAN_FRAME))
"""Commands that end with the end acknowledge: no answer frame follows."""
READS = frozenset((Opcode.READ_OBJECT, Opcode.INITIATE_SEGMENTED_READ))
"""Commands that may be carried out twice; a segment may not, because its toggle bit has moved on."""


class Frame(NamedTuple):
    """One frame whose CRC was right.

    Attributes:
        data: its data words as they went over the line, an even number of bytes.
    """

    opcode: int
    data: bytes


# The frame


def crc_of(body: bytes) -> int:
    """CRC-CCITT with start value 0 over header and data words, each word high byte first (Communication Guide 6.2.2).

    Args:
        body: operation code, length byte and data words in the order of the line.
    """
    words = bytearray(body)
    words[2::2], words[3::2] = body[3::2], body[2::2]
    return crc_hqx(words, 0)


def make_frame(opcode: int, data: bytes) -> bytes:
    """A frame of 1 to 512 data bytes; an odd number gets a zero byte more."""
    if len(data) & 1:
        data += b"\0"
    body = bytes((opcode, len(data) // 2 - 1)) + data
    return body + crc_of(body).to_bytes(2, "little")


def parse_frame(raw: bytes) -> Frame | str:
    """The frame in these bytes, or why they are none."""
    if len(raw) < 6:
        return "shorter than any frame"
    if len(raw) != frame_size(raw[1]):
        return "length byte and length differ"
    if crc_of(raw[:-2]) != raw[-2] | raw[-1] << 8:
        return CRC_WRONG
    return Frame(raw[0], raw[2:-2])


def frame_size(length_byte: int) -> int:
    """Bytes of a whole frame with this length byte."""
    return 2 * length_byte + 6


# Requests

_OBJECT = struct.Struct("<HBB")
_OBJECT_LONG = struct.Struct("<HBBI")
_WORDS = struct.Struct("<HH")


@dataclass(frozen=True, slots=True)
class ReadObject:
    """Read up to 4 bytes; node 0 is the drive on the line itself, any other is asked over CAN."""

    node: int
    index: int
    sub: int


@dataclass(frozen=True, slots=True)
class WriteObject:
    """Write up to 4 bytes; of ``data``, always 4 bytes, as many count as the object has."""

    node: int
    index: int
    sub: int
    data: bytes


@dataclass(frozen=True, slots=True)
class InitiateSegmentedRead:
    """Begin to read an object of any length."""

    node: int
    index: int
    sub: int


@dataclass(frozen=True, slots=True)
class InitiateSegmentedWrite:
    """Begin to write an object of ``size`` bytes."""

    node: int
    index: int
    sub: int
    size: int


@dataclass(frozen=True, slots=True)
class SegmentRead:
    """Read the next segment; the toggle bit starts at 0 and alternates."""

    toggle: int


@dataclass(frozen=True, slots=True)
class SegmentWrite:
    """Write the next segment of up to 63 bytes."""

    toggle: int
    data: bytes


@dataclass(frozen=True, slots=True)
class SendNmt:
    """Put an NMT command on the CAN bus; node 0 is all."""

    node: int
    command: int


@dataclass(frozen=True, slots=True)
class SendCanFrame:
    """Put a data frame on the CAN bus."""

    cob_id: int
    data: bytes


@dataclass(frozen=True, slots=True)
class RequestCanFrame:
    """Put a remote frame on the CAN bus and wait for the frame that answers it."""

    cob_id: int
    length: int


Request = (
    ReadObject
    | WriteObject
    | InitiateSegmentedRead
    | InitiateSegmentedWrite
    | SegmentRead
    | SegmentWrite
    | SendNmt
    | SendCanFrame
    | RequestCanFrame
)


def make_read_object(node: int, index: int, sub: int) -> bytes:
    """Request to read up to 4 bytes (Communication Guide 6.3.1.1)."""
    return make_frame(Opcode.READ_OBJECT, _OBJECT.pack(index, sub, node))


def make_write_object(node: int, index: int, sub: int, data: bytes) -> bytes:
    """Request to write 1 to 4 bytes, little-endian; shorter ones are filled with zeros (6.3.2.1)."""
    return make_frame(Opcode.WRITE_OBJECT, _OBJECT.pack(index, sub, node) + data.ljust(4, b"\0"))


def make_initiate_segmented_read(node: int, index: int, sub: int) -> bytes:
    """Request to begin to read an object of any length (6.3.1.2)."""
    return make_frame(Opcode.INITIATE_SEGMENTED_READ, _OBJECT.pack(index, sub, node))


def make_initiate_segmented_write(node: int, index: int, sub: int, size: int) -> bytes:
    """Request to begin to write ``size`` bytes (6.3.2.2)."""
    return make_frame(Opcode.INITIATE_SEGMENTED_WRITE, _OBJECT_LONG.pack(index, sub, node, size))


def make_segment_read(toggle: int) -> bytes:
    """Request for the next segment of a read."""
    return make_frame(Opcode.SEGMENT_READ, bytes((toggle * TOGGLE_BIT, 0)))


def make_segment_write(data: bytes, toggle: int) -> bytes:
    """Next segment of a write, 0 to 63 bytes."""
    return make_frame(Opcode.SEGMENT_WRITE, bytes((toggle * TOGGLE_BIT | len(data),)) + data)


def make_send_nmt(node: int, command: int) -> bytes:
    """Request to send an NMT command (6.3.2.3)."""
    return make_frame(Opcode.SEND_NMT, _WORDS.pack(node, command))


def make_send_can_frame(cob_id: int, data: bytes) -> bytes:
    """Request to send a CAN data frame of 0 to 8 bytes."""
    return make_frame(Opcode.SEND_CAN_FRAME, _WORDS.pack(cob_id, len(data)) + data.ljust(8, b"\0"))


def make_request_can_frame(cob_id: int, length: int) -> bytes:
    """Request to send a CAN remote frame and to hand back the frame that answers it."""
    return make_frame(Opcode.REQUEST_CAN_FRAME, _WORDS.pack(cob_id, length))


def parse_request(frame: Frame) -> Request | str:
    """The request in a frame, or why it is none."""
    size, parse = _REQUESTS.get(frame.opcode, (None, None))
    if parse is None:
        return "unknown operation code"
    if size not in (None, len(frame.data)):
        return "wrong length for this operation code"
    return parse(frame.data)


def _segment_write(data: bytes) -> SegmentWrite | str:
    length = data[0] & MAX_SEGMENT_BYTES
    if len(data) != _even(1 + length):
        return "length of the segment and of the frame differ"
    return SegmentWrite(data[0] >> 6 & 1, data[1 : 1 + length])


def _send_nmt(data: bytes) -> SendNmt | str:
    node, command = _WORDS.unpack(data)
    return SendNmt(node, command) if node <= 127 else "no such node id"


def _send_can_frame(data: bytes) -> SendCanFrame | str:
    cob_id, length = _WORDS.unpack_from(data)
    if cob_id > 0x7FF or length > 8:
        return "no such CAN frame"
    return SendCanFrame(cob_id, data[4 : 4 + length])


def _request_can_frame(data: bytes) -> RequestCanFrame | str:
    cob_id, length = _WORDS.unpack(data)
    return RequestCanFrame(cob_id, length) if cob_id <= 0x7FF and length <= 8 else "no such CAN frame"


def _even(size: int) -> int:
    return size + (size & 1)


def _addressed(data: bytes) -> tuple[int, int, int]:
    """Node, index and sub-index at the head of a request."""
    index, sub, node = _OBJECT.unpack_from(data)
    return node, index, sub


_REQUESTS: dict[int, tuple[int | None, Callable[[bytes], Request | str]]] = {
    Opcode.READ_OBJECT: (4, lambda data: ReadObject(*_addressed(data))),
    Opcode.WRITE_OBJECT: (8, lambda data: WriteObject(*_addressed(data), data[4:])),
    Opcode.INITIATE_SEGMENTED_READ: (4, lambda data: InitiateSegmentedRead(*_addressed(data))),
    Opcode.INITIATE_SEGMENTED_WRITE: (
        8,
        lambda data: InitiateSegmentedWrite(*_addressed(data), int.from_bytes(data[4:], "little")),
    ),
    Opcode.SEGMENT_READ: (2, lambda data: SegmentRead(data[0] >> 6 & 1)),
    Opcode.SEGMENT_WRITE: (None, _segment_write),
    Opcode.SEND_NMT: (4, _send_nmt),
    Opcode.SEND_CAN_FRAME: (12, _send_can_frame),
    Opcode.REQUEST_CAN_FRAME: (4, _request_can_frame),
}
"""By operation code: bytes of data, None where they vary, and the parser of them."""
