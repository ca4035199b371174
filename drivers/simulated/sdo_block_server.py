"""Block transfer of a simulated node's SDO server (CiA 301 7.2.4.3): what it sends, segment by segment, and takes."""

from __future__ import annotations

import asyncio
import struct
from binascii import crc_hqx
from collections.abc import Callable

from drivers.simulated.dictionary import WRONG_LENGTH, SdoAbort, SimulatedDictionary

SEGMENT_S = 0.0005
"""Time that the node takes to send one segment (assumed)."""
BLOCK_SEGMENTS = 32
"""Segments a block that the node takes."""

_UNKNOWN_COMMAND = 0x0504_0001
_INVALID_BLOCK_SIZE = 0x0504_0002
_CRC_ERROR = 0x0504_0004
_OUT_OF_MEMORY = 0x0504_0005
_MAX_DOWNLOAD = 16384
_SIZED = struct.Struct("<BHBI")
_BLOCK_SIZE = struct.Struct("<BHBB3x")
_END = struct.Struct("<BH5x")


class BlockServer:
    """One block transfer at a time. Every method that takes a request raises SdoAbort where it refuses.

    Args:
        dictionary: what is read and written.
        send: puts an answer on the bus, for segments that follow one another by themselves.

    Attributes:
        address: object of the transfer that is under way; None where there is none.
    """

    def __init__(self, dictionary: SimulatedDictionary, send: Callable[[bytes], None]) -> None:
        self._dictionary = dictionary
        self._send = send
        self.address: tuple[int, int] | None = None
        self._receiving = False
        self._data = bytearray()
        self._size: int | None = None
        self._with_crc = False
        self._start = 0
        self._segments = BLOCK_SEGMENTS
        self._number = 0
        self._complete = False
        self._timer: asyncio.TimerHandle | None = None

    def reset(self) -> None:
        """Forget the transfer that is under way."""
        self.address = None
        self._receiving = False
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    @property
    def receiving(self) -> bool:
        """Whether the next frame is a segment of a download."""
        return self._receiving

    # Download

    def begin_download(self, request: bytes) -> bytes:
        """Client: initiate block download."""
        self.reset()
        command, index, sub, size = _SIZED.unpack(request)
        self._dictionary.find(index, sub)
        if size > _MAX_DOWNLOAD and command & 2:
            raise SdoAbort(_OUT_OF_MEMORY)
        self.address, self._receiving, self._data = (index, sub), True, bytearray()
        self._size, self._with_crc = size if command & 2 else None, bool(command & 4)
        self._number, self._complete = 0, False
        return _BLOCK_SIZE.pack(0xA4, index, sub, BLOCK_SEGMENTS)

    def take_segment(self, request: bytes) -> bytes | None:
        """A segment: what is out of order is not taken, and the end of a block is acknowledged."""
        number, last = request[0] & 0x7F, request[0] >= 0x80
        in_order = number == self._number + 1
        if in_order:
            self._number = number
            self._data += request[1:]
            if len(self._data) > _MAX_DOWNLOAD:
                raise SdoAbort(_OUT_OF_MEMORY)
        if not (last or number == BLOCK_SEGMENTS):
            return None
        self._complete = last and in_order
        self._receiving = not self._complete
        good, self._number = self._number, 0
        return bytes((0xA2, good, BLOCK_SEGMENTS)).ljust(8, b"\0")

    def end_download(self, request: bytes) -> bytes:
        """Client: end block download; the value is checked and written."""
        if self.address is None or not self._complete:
            raise SdoAbort(_UNKNOWN_COMMAND)
        command, crc, *_ = _END.unpack(request)
        data = bytes(self._data[: len(self._data) - (command >> 2 & 7)])
        if self._with_crc and crc != crc_hqx(data, 0):
            raise SdoAbort(_CRC_ERROR)
        if self._size is not None and len(data) != self._size:
            raise SdoAbort(WRONG_LENGTH)
        self._dictionary.write(*self.address, data)
        self.reset()
        return b"\xa1".ljust(8, b"\0")

    # Upload

    def begin_upload(self, request: bytes) -> bytes:
        """Client: initiate block upload."""
        self.reset()
        command, index, sub, segments = _BLOCK_SIZE.unpack(request)
        if not 1 <= segments <= 127:
            raise SdoAbort(_INVALID_BLOCK_SIZE)
        self._data = bytearray(self._dictionary.read(index, sub))
        self.address, self._segments, self._start = (index, sub), segments, 0
        self._with_crc, self._complete = bool(command & 4), False
        return _SIZED.pack(0xC6, index, sub, len(self._data))

    def continue_upload(self, request: bytes) -> bytes | None:
        """Client: start (0xA3), block acknowledged (0xA2), or end (0xA1) of a block upload."""
        service = request[0] & 0x03
        if self.address is None or self._receiving or self._complete:
            raise SdoAbort(_UNKNOWN_COMMAND)
        if service == 1:
            self.reset()
            return None
        if service == 2:
            return self._acknowledged(request[1], request[2])
        self._send_block()
        return None

    def _acknowledged(self, good: int, segments: int) -> bytes | None:
        if not 1 <= segments <= 127:
            raise SdoAbort(_INVALID_BLOCK_SIZE)
        self._start += 7 * good
        self._segments = segments
        if self._start < len(self._data):
            self._send_block()
            return None
        unused = -len(self._data) % 7
        return _END.pack(0xC1 | unused << 2, crc_hqx(self._data, 0) if self._with_crc else 0)

    def _send_block(self) -> None:
        self._number = 0
        self._send_segment()

    def _send_segment(self) -> None:
        """Send the next segment, and so on until the block or the value ends."""
        start = self._start + 7 * self._number
        chunk = bytes(self._data[start : start + 7])
        self._number += 1
        last = start + 7 >= len(self._data)
        self._send(bytes((last << 7 | self._number,)) + chunk.ljust(7, b"\0"))
        more = not last and self._number < self._segments
        self._timer = asyncio.get_running_loop().call_later(SEGMENT_S, self._send_segment) if more else None
