"""Frames of expedited and segmented SDO transfers (CiA 301 7.2.4.3): pure bytes."""

from __future__ import annotations

import struct
from enum import IntEnum
from typing import NamedTuple

MAX_UPLOAD_BYTES = 65536
"""A node that sends more than this in one transfer is stopped."""

_INITIATE = struct.Struct("<BHB4s")
_ABORT = struct.Struct("<BHBI")

Address = tuple[int, int]
"""Index and sub-index of an object."""


class AnswerKind(IntEnum):
    """What a server answers: the command specifier, top three bits of byte 0."""

    UPLOAD_SEGMENT = 0
    DOWNLOAD_SEGMENT = 1
    UPLOAD = 2
    DOWNLOAD = 3
    ABORT = 4


_KINDS = tuple(AnswerKind)
_NO_ANSWER = len(_KINDS) << 5


class SdoAnswer(NamedTuple):
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
    return _INITIATE.pack(0x40, index, sub, b"")


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
    if len(data) != 8 or data[0] >= _NO_ANSWER:
        return None
    kind, toggle = _KINDS[data[0] >> 5], data[0] >> 4 & 1
    if kind is AnswerKind.UPLOAD:
        command, index, sub, value = _INITIATE.unpack(data)
        expedited, sized = bool(command & 2), bool(command & 1)
        if expedited and sized:
            value = value[: 4 - (command >> 2 & 3)]
        return SdoAnswer(kind, (index, sub), 0, value, expedited, sized)
    if kind is AnswerKind.UPLOAD_SEGMENT:
        return SdoAnswer(kind, toggle=toggle, data=data[1 : 8 - (data[0] >> 1 & 7)], last=bool(data[0] & 1))
    if kind is AnswerKind.DOWNLOAD_SEGMENT:
        return SdoAnswer(kind, toggle=toggle)
    _, index, sub, code = _ABORT.unpack(data)
    return SdoAnswer(kind, (index, sub), code=code if kind is AnswerKind.ABORT else 0)
