"""Frames of expedited and segmented SDO transfers (CiA 301 7.2.4.3): pure bytes."""

from __future__ import annotations

import struct
from enum import IntEnum

import msgspec

MAX_UPLOAD_BYTES = 65536
"""A node that sends more than this in one transfer is stopped."""

_INITIATE = struct.Struct("<BHB4s")
_ABORT = struct.Struct("<BHBI")
_pack, _unpack = _INITIATE.pack, _INITIATE.unpack

Address = tuple[int, int]
"""Index and sub-index of an object."""


class AnswerKind(IntEnum):
    """What a server answers: the command specifier, top three bits of byte 0."""

    UPLOAD_SEGMENT = 0
    DOWNLOAD_SEGMENT = 1
    UPLOAD = 2
    DOWNLOAD = 3
    ABORT = 4


UPLOAD_SEGMENT, DOWNLOAD_SEGMENT, UPLOAD, DOWNLOAD, ABORT = AnswerKind
"""Looked up once: in Python 3.11 that takes 0.1 us each time."""
_KINDS = (*AnswerKind, None, None, None)
"""By the command specifier; the last three are none of an answer."""


class SdoAnswer(msgspec.Struct, frozen=True, gc=False):
    """One answer of an SDO server.

    Attributes:
        address: index and sub-index; ``(0, 0)`` for segments, which carry none.
        toggle: toggle bit of a segment.
        data: value or segment.
        last: nothing follows: an expedited upload or a last segment.
        sized: the length of an expedited value was given.
        code: abort code.
    """

    kind: AnswerKind
    address: Address = (0, 0)
    toggle: int = 0
    data: bytes = b""
    last: bool = False
    sized: bool = True
    code: int = 0


def make_upload(index: int, sub: int) -> bytes:
    """Request to read an object."""
    return _pack(0x40, index, sub, b"")


def make_download(index: int, sub: int, data: bytes) -> bytes:
    """Request to write an object: the value itself up to 4 bytes, else the length of what follows in segments."""
    if 1 <= len(data) <= 4:
        return _INITIATE.pack(0x23 | (4 - len(data)) << 2, index, sub, data)
    return _INITIATE.pack(0x21, index, sub, len(data).to_bytes(4, "little"))


def make_upload_segment(toggle: int) -> bytes:
    """Request for the next segment of a read."""
    return bytes((0x60 | toggle << 4, 0, 0, 0, 0, 0, 0, 0))


def make_download_segment(chunk: bytes, toggle: int, last: bool) -> bytes:
    """Next segment of a write, 0 to 7 bytes."""
    return bytes((toggle << 4 | (7 - len(chunk)) << 1 | last,)) + chunk.ljust(7, b"\0")


def make_abort(index: int, sub: int, code: int) -> bytes:
    """The client gives a transfer up."""
    return _ABORT.pack(0x80, index, sub, code)


def parse_answer(data: bytes) -> SdoAnswer | None:
    """The answer in 8 bytes from an SDO server, or None where it is none."""
    if len(data) != 8:
        return None
    command, index, sub, value = _unpack(data)
    kind = _KINDS[command >> 5]
    if kind is UPLOAD:
        expedited, sized = command & 2 != 0, command & 1 != 0
        if expedited and sized:
            value = value[: 4 - (command >> 2 & 3)]
        return SdoAnswer(kind, (index, sub), 0, value, expedited, sized)
    if kind is None:
        return None
    toggle = command >> 4 & 1
    if kind is UPLOAD_SEGMENT:
        return SdoAnswer(kind, toggle=toggle, data=data[1 : 8 - (command >> 1 & 7)], last=command & 1 != 0)
    if kind is DOWNLOAD_SEGMENT:
        return SdoAnswer(kind, toggle=toggle)
    code = int.from_bytes(value, "little") if kind is ABORT else 0
    return SdoAnswer(kind, (index, sub), code=code)
