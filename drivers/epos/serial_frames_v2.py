"""The framing of later drives (EPOS2 over USB, EPOS4): same commands, start bytes and stuffing, no acknowledges.

A frame is DLE, STX, operation code, number of data words, data words, CRC; every DLE after the two start bytes is
doubled (maxon EPOS4 Communication Guide, USB and RS-232). Requests and answers are those of
:mod:`drivers.epos.serial_frames` and :mod:`drivers.epos.serial_answers`; only their wrapping differs.
"""

from __future__ import annotations

from binascii import crc_hqx
from collections.abc import Iterator

from drivers.epos.serial_frames import Frame

DLE, STX = 0x90, 0x02
_START, _DLE, _DLE_DLE = bytes((DLE, STX)), bytes((DLE,)), bytes((DLE, DLE))


def crc_of(body: bytes) -> int:
    """CRC-CCITT with start value 0 over all words, each high byte first; here the header is a word like the others."""
    words = bytearray(body)
    words[0::2], words[1::2] = body[1::2], body[0::2]
    return crc_hqx(words, 0)


def make_stuffed_frame(opcode: int, data: bytes) -> bytes:
    """A frame with start bytes and stuffing; 1 to 510 data bytes, an odd number gets a zero byte more."""
    data += b"\0" * (len(data) & 1)
    body = bytes((opcode, len(data) // 2)) + data
    return _START + (body + crc_of(body).to_bytes(2, "little")).replace(_DLE, _DLE_DLE)


def restuffed(frame: bytes) -> bytes:
    """A frame of the first generation in this framing."""
    return make_stuffed_frame(frame[0], frame[2:-2])


class Deframer:
    """Finds frames in a stream of bytes."""

    def __init__(self) -> None:
        self._body: bytearray | None = None
        self._after_dle = False

    def feed(self, data: bytes) -> Iterator[Frame | str]:
        """Take bytes of any number; yields each frame, and the reason for each that was broken."""
        for byte in data:
            if self._after_dle:
                self._after_dle = False
                yield from self._take_escaped(byte)
            elif byte == DLE:
                self._after_dle = True
            elif self._body is not None:
                yield from self._take(byte)

    def _take_escaped(self, byte: int) -> Iterator[Frame | str]:
        """The byte after a DLE: a start, a DLE of the frame itself, or a broken frame."""
        if byte == DLE and self._body is not None:
            yield from self._take(byte)
            return
        if self._body is not None:
            yield "frame broken off"
        self._body = bytearray() if byte == STX else None

    def _take(self, byte: int) -> Iterator[Frame | str]:
        assert self._body is not None
        self._body.append(byte)
        if len(self._body) < 4 or len(self._body) < 2 * self._body[1] + 4:
            return
        body, self._body = bytes(self._body), None
        if not body[1]:
            yield "no data words"
        elif crc_of(body[:-2]) != body[-2] | body[-1] << 8:
            yield "CRC wrong"
        else:
            yield Frame(body[0], body[2:-2])
