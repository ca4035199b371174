"""SDO client (CiA 301 7.2.4): expedited, segmented and block transfers, one queue a node."""

from __future__ import annotations

import asyncio
import struct
from collections.abc import Awaitable, Callable

from canhelm.errors import Aborted, CanhelmError, DeviceFault, NodeAbsent, Timeout, UsageError
from drivers.canopen.codes import SDO_ABORTS
from drivers.canopen.counters import CanopenCounters
from drivers.canopen.objects import ObjectDef
from drivers.canopen.sdo_block import (
    BLOCK_FROM_BYTES,
    BlockBroken,
    BlockChannel,
    BlockRefused,
    NodeWentAway,
    SegmentedInstead,
    download,
    upload,
)
from drivers.canopen.sdo_frames import (
    ABORT,
    DOWNLOAD,
    DOWNLOAD_SEGMENT,
    MAX_UPLOAD_BYTES,
    UPLOAD,
    UPLOAD_SEGMENT,
    Address,
    AnswerKind,
    SdoAnswer,
    make_abort,
    make_download,
    make_download_segment,
    make_upload,
    make_upload_segment,
    parse_answer,
)

REQUEST_COB_ID = 0x600
ANSWER_COB_ID = 0x580
ABORT_TIMEOUT = 0x0504_0000
ABORT_UNKNOWN_COMMAND = 0x0504_0001
ABORT_OUT_OF_MEMORY = 0x0504_0005
ABORT_GENERAL = 0x0800_0000
NO_ANSWER_REMEDY = "check its power, its node id and the CAN cable"

SdoObject = ObjectDef | Address
"""An object of a table, or index and sub-index of any other, whose value is then plain bytes."""

_SEGMENTS = (UPLOAD_SEGMENT, DOWNLOAD_SEGMENT)


def _address(obj: SdoObject) -> Address:
    return (obj.index, obj.sub) if isinstance(obj, ObjectDef) else obj


def _words(obj: SdoObject) -> str:
    if isinstance(obj, ObjectDef):
        return f"{obj.address} ({obj.name})"
    return _plain(obj)


def _plain(obj: SdoObject) -> str:
    index, sub = _address(obj)
    return f"0x{index:04X}/{sub}" if sub else f"0x{index:04X}"


class SdoClient:
    """Reads and writes the objects of one node, one transfer at a time, in the order of the calls.

    An answer counts only when it names the object that is being asked for; every other one is dropped and counted.

    Args:
        node: node id.
        name: how people call the node.
        send: puts a frame on the bus: COB-ID, data, deadline.
        timeout_s: how long an answer may take.
        counters: where dropped answers are counted.
        segment_s: time to leave for each segment of a block.

    Attributes:
        blocks: whether long values go in blocks; ended by a server that does not know block transfer.
    """

    def __init__(
        self,
        node: int,
        name: str,
        send: Callable[[int, bytes, float], None],
        timeout_s: float,
        counters: CanopenCounters,
        segment_s: float = 0.001,
    ) -> None:
        self.node = node
        self.name = name
        self._send = send
        self._timeout_s = timeout_s
        self._counters = counters
        self._segment_s = segment_s
        self.blocks = True
        self._channel: BlockChannel | None = None
        self._turn = asyncio.Lock()
        self._object: SdoObject = (0, 0)
        self._address: Address = (0, 0)
        self._expected = (ABORT, 0)
        self._waiter: asyncio.Future[SdoAnswer] | None = None

    async def read(self, obj: SdoObject) -> int | str | bytes:
        """The value of an object in its type; bytes for an address without one.

        Raises:
            NodeAbsent: no answer.
            Timeout: the answers stopped in the middle of a transfer.
            Aborted: the node refused.
            DeviceFault: the value's length does not fit its type.
        """
        raw = await self.read_raw(obj)
        if not isinstance(obj, ObjectDef):
            return raw
        try:
            return obj.type.unpack(raw)
        except struct.error:
            raise DeviceFault(
                f"{self._who} answered {len(raw)} bytes for {_words(obj)}, expected {obj.type.bits // 8}",
                node=self.node,
                object=_plain(obj),
                remedy="check that the device is of the type that the profile names",
            ) from None

    async def read_int(self, obj: ObjectDef) -> int:
        """The value of an object that is a number; raises as :meth:`read` does."""
        value = await self.read(obj)
        if not isinstance(value, int):
            raise UsageError(f"{_words(obj)} is no number", object=_plain(obj), remedy="read it as text")
        return value

    async def write(self, obj: SdoObject, value: int | str | bytes) -> None:
        """Write an object.

        Raises:
            UsageError: the value does not fit the object's type; nothing was sent.
            NodeAbsent, Timeout, Aborted: as :meth:`read`.
        """
        await self.write_raw(obj, self._pack(obj, value))

    def _pack(self, obj: SdoObject, value: int | str | bytes) -> bytes:
        try:
            if isinstance(obj, ObjectDef) and (obj.type.bits or not isinstance(value, int)):
                return obj.type.pack(value)
            return value.encode("ascii") if isinstance(value, str) else bytes(memoryview(value))  # type: ignore[arg-type]
        except (struct.error, TypeError, UnicodeEncodeError):
            kind = obj.type.name if isinstance(obj, ObjectDef) else "bytes"
            raise UsageError(
                f"{value!r} does not fit {_words(obj)} of type {kind}",
                node=self.node,
                object=_plain(obj),
                value=value if isinstance(value, int | str) else None,
                remedy="give a value in the range of that type",
            ) from None

    async def read_raw(self, obj: SdoObject, timeout_s: float | None = None) -> bytes:
        """The little-endian bytes of an object; raises as :meth:`read` does."""
        async with self._turn:
            self._object, self._address = obj, _address(obj)
            timeout = timeout_s or self._timeout_s
            answer = await self._exchange(make_upload(*self._address), UPLOAD, 0, timeout)
            if answer.last:
                size = obj.type.bits // 8 if isinstance(obj, ObjectDef) else 0
                return answer.data[: size or 4] if not answer.sized else answer.data
            if self.blocks and answer.sized and int.from_bytes(answer.data, "little") >= BLOCK_FROM_BYTES:
                return await self._upload_blocks(timeout)
            return await self._upload_segments(timeout)

    async def write_raw(self, obj: SdoObject, data: bytes, timeout_s: float | None = None) -> None:
        """Write the little-endian bytes of an object; raises as :meth:`write` does."""
        async with self._turn:
            self._object, self._address = obj, _address(obj)
            timeout = timeout_s or self._timeout_s
            if self.blocks and len(data) >= BLOCK_FROM_BYTES and await self._download_blocks(data, timeout):
                return
            await self._exchange(make_download(*self._address, data), DOWNLOAD, 0, timeout)
            if not 1 <= len(data) <= 4:
                await self._download_segments(data, timeout)

    async def _upload_segments(self, timeout_s: float) -> bytes:
        value, toggle, last = bytearray(), 0, False
        while not last:
            request = make_upload_segment(toggle)
            answer = await self._segment(request, UPLOAD_SEGMENT, toggle, timeout_s)
            value += answer.data
            if len(value) > MAX_UPLOAD_BYTES:
                self._abort(ABORT_OUT_OF_MEMORY)
                raise self._error(DeviceFault, f"sends more than {MAX_UPLOAD_BYTES} bytes", "check the device")
            toggle, last = toggle ^ 1, answer.last
        return bytes(value)

    async def _download_segments(self, data: bytes, timeout_s: float) -> None:
        toggle = 0
        for start in range(0, max(len(data), 1), 7):
            request = make_download_segment(data[start : start + 7], toggle, start + 7 >= len(data))
            await self._segment(request, DOWNLOAD_SEGMENT, toggle, timeout_s)
            toggle ^= 1

    async def _upload_blocks(self, timeout_s: float) -> bytes:
        """Begin anew in blocks, now that the value is known to be long; in segments where the server cannot."""
        self._abort(ABORT_GENERAL)
        try:
            value = await self._in_blocks(upload, timeout_s)
        except SegmentedInstead:
            self.blocks = False
            return await self._upload_segments(timeout_s)
        if value is None:
            await self._exchange(make_upload(*self._address), UPLOAD, 0, timeout_s)
            return await self._upload_segments(timeout_s)
        return value

    async def _download_blocks(self, data: bytes, timeout_s: float) -> bool:
        """Write in blocks; False where the server does not know block transfer."""

        async def transfer(channel: BlockChannel) -> bytes:
            await download(channel, data, self._segment_s)
            return data

        return await self._in_blocks(transfer, timeout_s) is not None

    async def _in_blocks(self, transfer: Callable[[BlockChannel], Awaitable[bytes]], timeout_s: float) -> bytes | None:
        """Carry out a block transfer; None where the server does not know them."""
        channel = self._channel = BlockChannel(self._request, self._address, timeout_s)
        try:
            return await transfer(channel)
        except BlockRefused as refusal:
            if refusal.code != ABORT_UNKNOWN_COMMAND or channel.begun:
                raise self._aborted(refusal.code) from None
            self.blocks = False
            return None
        except BlockBroken as broken:
            self._abort(broken.code)
            raise self._error(DeviceFault, str(broken), "try again; look for a second SDO client") from None
        except NodeWentAway as gone:
            raise self._error(NodeAbsent, str(gone), NO_ANSWER_REMEDY) from None
        except TimeoutError:
            self._abort(ABORT_TIMEOUT)
            raise self._block_timeout(channel, timeout_s) from None
        except asyncio.CancelledError:
            self._abort(ABORT_TIMEOUT)
            raise
        finally:
            self._counters.late_answers += channel.stray
            self._channel = None

    def _block_timeout(self, channel: BlockChannel, timeout_s: float) -> CanhelmError:
        if channel.begun:
            return self._error(Timeout, "stopped answering in the middle of a transfer", "try again")
        return self._error(NodeAbsent, f"did not answer within {timeout_s * 1e3:.0f} ms", NO_ANSWER_REMEDY)

    async def _segment(self, request: bytes, kind: AnswerKind, toggle: int, timeout_s: float) -> SdoAnswer:
        try:
            return await self._exchange(request, kind, toggle, timeout_s)
        except NodeAbsent:
            raise self._error(Timeout, "stopped answering in the middle of a transfer", "try again") from None
        except asyncio.CancelledError:
            self._abort(ABORT_TIMEOUT)
            raise

    async def _exchange(self, request: bytes, kind: AnswerKind, toggle: int, timeout_s: float) -> SdoAnswer:
        loop = asyncio.get_running_loop()
        waiter: asyncio.Future[SdoAnswer] = loop.create_future()
        self._waiter, self._expected = waiter, (kind, toggle)
        deadline_s = loop.time() + timeout_s
        timer = loop.call_at(deadline_s, self._expire, waiter, timeout_s)
        self._send(REQUEST_COB_ID + self.node, request, deadline_s)
        try:
            answer = await waiter
        finally:
            timer.cancel()
            self._waiter = None
        if answer.kind is ABORT:
            raise self._aborted(answer.code)
        return answer

    def receive(self, can_id: int, data: bytes, timestamp: float) -> None:
        """Take a frame from the node's answer COB-ID."""
        if self._channel is not None:
            self._channel.put(data)
            return
        answer = parse_answer(data)
        if answer is None:
            self._counters.malformed += 1
        elif self._waiter is None or self._waiter.done() or not self._fits(answer):
            self._counters.late_answers += 1
        else:
            self._waiter.set_result(answer)

    def _fits(self, answer: SdoAnswer) -> bool:
        if answer.kind is ABORT:
            return answer.address == self._address
        kind, toggle = self._expected
        if answer.kind is not kind:
            return False
        return answer.toggle == toggle if kind in _SEGMENTS else answer.address == self._address

    def give_up(self, reason: str) -> None:
        """End the transfer that is running: the node has restarted and will not answer it."""
        if self._waiter is not None:
            self._fail(self._waiter, reason)
        if self._channel is not None:
            self._channel.end(reason)

    def _expire(self, waiter: asyncio.Future[SdoAnswer], timeout_s: float) -> None:
        """End what the server may have begun: one that has understood something else waits for more, and is deaf."""
        if not waiter.done():
            self._abort(ABORT_TIMEOUT)
        self._fail(waiter, f"did not answer within {timeout_s * 1e3:.0f} ms")

    def _fail(self, waiter: asyncio.Future[SdoAnswer], reason: str) -> None:
        if not waiter.done():
            waiter.set_exception(self._error(NodeAbsent, reason, NO_ANSWER_REMEDY))

    def _abort(self, code: int) -> None:
        self._request(make_abort(*self._address, code))

    def _request(self, data: bytes) -> None:
        self._send(REQUEST_COB_ID + self.node, data, asyncio.get_running_loop().time() + self._timeout_s)

    @property
    def _who(self) -> str:
        return f"node {self.node} ({self.name})" if self.name else f"node {self.node}"

    def _error(self, leaf: type[CanhelmError], what: str, remedy: str) -> CanhelmError:
        message = f"{self._who} {what}: {_words(self._object)}"
        return leaf(message, node=self.node, object=_plain(self._object), remedy=remedy)

    def _aborted(self, code: int) -> Aborted:
        known = SDO_ABORTS.get(code)
        return Aborted(
            f"{self._who} refused access to {_words(self._object)}: {known.name if known else 'abort'} (0x{code:08X})",
            node=self.node,
            object=_plain(self._object),
            value=code,
            remedy=known.cure if known else f"`canhelm explain 0x{code:08X}`",
        )
