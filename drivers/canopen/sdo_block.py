"""SDO block transfer as a client (CiA 301 7.2.4.3): long values in blocks of segments, with a checksum."""

from __future__ import annotations

import asyncio
import struct
from binascii import crc_hqx
from collections.abc import Callable
from functools import partial
from typing import NamedTuple, TypeVar

from drivers.canopen.sdo_frames import MAX_UPLOAD_BYTES, Address

BLOCK_FROM_BYTES = 128
"""Length from which a block transfer is worth its overhead."""
SEGMENTS = 32
"""Segments a block that this client asks for; a server has to be able to queue as many frames."""
BURST = 8
"""Segments that are sent without a pause."""
TRIES = 3
"""Blocks in a row that may fail completely before a transfer is given up."""

INVALID_BLOCK_SIZE = 0x0504_0002
INVALID_SEQUENCE = 0x0504_0003
CRC_ERROR = 0x0504_0004
OUT_OF_MEMORY = 0x0504_0005
WRONG_LENGTH = 0x0607_0010

_SEGMENT_BYTES = 7
_SIZED = struct.Struct("<BHBI")
_BLOCK_SIZE = struct.Struct("<BHBB3x")
_END = struct.Struct("<BH5x")

T = TypeVar("T")


class Initiated(NamedTuple):
    """What a server says when a block transfer begins.

    Attributes:
        crc: it computes checksums.
        number: segments a block for a download, length of the value for an upload (0: not told).
    """

    crc: bool
    number: int


class Segment(NamedTuple):
    """One segment of a block: its number from 1 on, whether it is the last one of all, and 7 bytes."""

    number: int
    last: bool
    data: bytes


def block_crc(data: bytes) -> int:
    """CRC-16-CCITT of the whole value: polynomial 0x1021, start 0 (CiA 301 7.2.4.3.16)."""
    return crc_hqx(data, 0)


def make_block_download(index: int, sub: int, size: int) -> bytes:
    """Request to write an object of ``size`` bytes in blocks, with a checksum."""
    return _SIZED.pack(0xC6, index, sub, size)


def make_block_upload(index: int, sub: int, segments: int) -> bytes:
    """Request to read an object in blocks of so many segments, with a checksum."""
    return _BLOCK_SIZE.pack(0xA4, index, sub, segments)


def make_upload_start() -> bytes:
    """The server may send its first block."""
    return b"\xa3".ljust(8, b"\0")


def make_segment(number: int, chunk: bytes, last: bool) -> bytes:
    """One segment, 1 to 7 bytes."""
    return bytes((last << 7 | number,)) + chunk.ljust(_SEGMENT_BYTES, b"\0")


def make_block_answer(good: int, segments: int) -> bytes:
    """The block was received up to this segment; the next one shall have so many."""
    return bytes((0xA2, good, segments)).ljust(8, b"\0")


def make_download_end(size: int, crc: int) -> bytes:
    """Everything was sent: the bytes of the last segment that count, and the checksum."""
    return _END.pack(0xC1 | (-size % _SEGMENT_BYTES) << 2, crc)


def make_upload_end() -> bytes:
    """Everything was received and is right."""
    return b"\xa1".ljust(8, b"\0")


def parse_download_initiated(address: Address, data: bytes) -> Initiated | None:
    """The answer to :func:`make_block_download`, or None where the frame is another one."""
    if len(data) != 8 or data[0] & 0xFB != 0xA0 or _address(data) != address:
        return None
    return Initiated(bool(data[0] & 4), data[4])


def parse_upload_initiated(address: Address, data: bytes) -> Initiated | None:
    """The answer to :func:`make_block_upload`, or None where the frame is another one."""
    if len(data) != 8 or data[0] & 0xF9 != 0xC0 or _address(data) != address:
        return None
    return Initiated(bool(data[0] & 4), int.from_bytes(data[4:], "little") if data[0] & 2 else 0)


def parse_segment(data: bytes) -> Segment | None:
    """A segment of an upload, or None where the frame is none."""
    if len(data) != 8 or not data[0] & 0x7F:
        return None
    return Segment(data[0] & 0x7F, data[0] >= 0x80, data[1:])


def parse_block_answer(data: bytes) -> tuple[int, int] | None:
    """Last good segment and segments of the next block, from the server of a download; None for another frame."""
    return (data[1], data[2]) if len(data) == 8 and data[0] == 0xA2 else None


def parse_upload_end(data: bytes) -> tuple[int, int] | None:
    """Bytes of the last segment that do not count, and the checksum; None for another frame."""
    if len(data) != 8 or data[0] & 0xE3 != 0xC1:
        return None
    return data[0] >> 2 & 7, data[1] | data[2] << 8


def parse_download_end(data: bytes) -> bool | None:
    """True for the server's last word of a download, None for another frame."""
    return True if len(data) == 8 and data[0] == 0xA1 else None


def _address(data: bytes) -> Address:
    return data[1] | data[2] << 8, data[3]


class BlockRefused(Exception):
    """The server aborted. Args: abort code."""

    def __init__(self, code: int) -> None:
        super().__init__(f"0x{code:08X}")
        self.code = code


class BlockBroken(Exception):
    """The server broke the protocol and this client gives up. Args: abort code to send, what was wrong."""

    def __init__(self, code: int, what: str) -> None:
        super().__init__(what)
        self.code = code


class NodeWentAway(Exception):
    """The transfer was ended from outside. Args: why."""


class SegmentedInstead(Exception):
    """The server answered a block upload as an ordinary one, as it may (CiA 301 7.2.4.3.12)."""


class BlockChannel:
    """The frames of one block transfer.

    Args:
        send: puts a request on the bus.
        address: the object.
        timeout_s: how long an answer may take.

    Attributes:
        begun: the server has agreed to transfer in blocks.
        stray: frames that were no answer to what was asked.
    """

    def __init__(self, send: Callable[[bytes], None], address: Address, timeout_s: float) -> None:
        self.send = send
        self.address = address
        self.begun = False
        self.stray = 0
        self._timeout_s = timeout_s
        self._frames: asyncio.Queue[bytes | str] = asyncio.Queue()

    def put(self, data: bytes) -> None:
        """Take a frame from the server."""
        self._frames.put_nowait(data)

    def end(self, reason: str) -> None:
        """End the transfer from outside."""
        self._frames.put_nowait(reason)

    async def answer(self, parse: Callable[[bytes], T | None]) -> T:
        """The next frame that means something.

        Raises:
            BlockRefused: the server aborted.
            NodeWentAway: the transfer was ended from outside.
            TimeoutError: there was none in time.
        """
        async with asyncio.timeout(self._timeout_s):
            while True:
                data = await self._frames.get()
                if isinstance(data, str):
                    raise NodeWentAway(data)
                if len(data) == 8 and data[0] == 0x80 and _address(data) == self.address:
                    raise BlockRefused(int.from_bytes(data[4:], "little"))
                parsed = parse(data)
                if parsed is not None:
                    return parsed
                self.stray += 1


async def download(channel: BlockChannel, data: bytes, segment_s: float) -> None:
    """Write a value in blocks.

    Args:
        channel: to the server.
        data: the value, at least one byte.
        segment_s: time to leave for each segment, so that the transmit queue never fills.

    Raises:
        BlockRefused, BlockBroken, NodeWentAway, TimeoutError.
    """
    channel.send(make_block_download(*channel.address, len(data)))
    crc, segments = await channel.answer(partial(parse_download_initiated, channel.address))
    channel.begun = True
    sent = failed = 0
    while sent < len(data):
        if not 1 <= segments <= 127:
            raise BlockBroken(INVALID_BLOCK_SIZE, f"wants blocks of {segments} segments")
        block = data[sent : sent + _SEGMENT_BYTES * segments]
        count = await _send_block(channel, block, sent + len(block) == len(data), segment_s)
        good, segments = await channel.answer(parse_block_answer)
        failed = 0 if good else failed + 1
        if good > count or failed == TRIES:
            raise BlockBroken(INVALID_SEQUENCE, f"acknowledges {good} of {count} segments")
        sent = min(sent + _SEGMENT_BYTES * good, len(data))
    channel.send(make_download_end(len(data), block_crc(data) if crc else 0))
    await channel.answer(parse_download_end)


async def _send_block(channel: BlockChannel, block: bytes, last_block: bool, segment_s: float) -> int:
    """Send one block; the number of its segments."""
    chunks = [block[start : start + _SEGMENT_BYTES] for start in range(0, len(block), _SEGMENT_BYTES)]
    for number, chunk in enumerate(chunks, 1):
        channel.send(make_segment(number, chunk, last_block and number == len(chunks)))
        if number % BURST == 0:
            await asyncio.sleep(BURST * segment_s)
    return len(chunks)


async def upload(channel: BlockChannel) -> bytes:
    """Read a value in blocks.

    Raises:
        SegmentedInstead: the server answered as to an ordinary read.
        BlockRefused, BlockBroken, NodeWentAway, TimeoutError.
    """
    channel.send(make_block_upload(*channel.address, SEGMENTS))
    crc, size = await channel.answer(partial(_initiated_or_segmented, channel.address))
    channel.begun = True
    channel.send(make_upload_start())
    value, last, failed = bytearray(), False, 0
    while not last:
        good, last = await _receive_block(channel, value)
        failed = 0 if good else failed + 1
        if failed == TRIES:
            raise BlockBroken(INVALID_SEQUENCE, "does not begin its blocks with segment 1")
        if len(value) > MAX_UPLOAD_BYTES:
            raise BlockBroken(OUT_OF_MEMORY, f"sends more than {MAX_UPLOAD_BYTES} bytes")
        channel.send(make_block_answer(good, SEGMENTS))
    unused, checksum = await channel.answer(parse_upload_end)
    return _finished(channel, bytes(value[: len(value) - unused]), size, checksum if crc else None)


def _initiated_or_segmented(address: Address, data: bytes) -> Initiated | None:
    if len(data) == 8 and data[0] >> 5 == 2 and _address(data) == address:
        raise SegmentedInstead
    return parse_upload_initiated(address, data)


async def _receive_block(channel: BlockChannel, value: bytearray) -> tuple[int, bool]:
    """Append what comes in order; the number of good segments, and whether the last one of all is among them."""
    good = 0
    while good < SEGMENTS:
        try:
            segment = await channel.answer(parse_segment)
        except TimeoutError:
            if not good:
                raise
            break  # the end of the block was lost: ask for the rest
        if segment.number == good + 1:
            value += segment.data
            good += 1
            if segment.last:
                return good, True
        elif segment.last or segment.number == SEGMENTS:
            break
    return good, False


def _finished(channel: BlockChannel, value: bytes, size: int, checksum: int | None) -> bytes:
    if size and len(value) != size:
        raise BlockBroken(WRONG_LENGTH, f"announced {size} bytes and sent {len(value)}")
    if checksum is not None and checksum != block_crc(value):
        raise BlockBroken(CRC_ERROR, "sends a value that does not match its checksum")
    channel.send(make_upload_end())
    return value
