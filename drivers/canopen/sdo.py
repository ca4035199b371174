"""SDO client (CiA 301 7.2.4): expedited and segmented transfers, one queue a node."""

from __future__ import annotations

import asyncio
import struct
from collections.abc import Callable
from enum import IntEnum
from typing import NamedTuple

from canhelm.errors import Aborted, CanhelmError, DeviceFault, NodeAbsent, Timeout, UsageError
from drivers.canopen.codes import SDO_ABORTS
from drivers.canopen.counters import CanopenCounters
from drivers.canopen.objects import ObjectDef

REQUEST_COB_ID = 0x600
ANSWER_COB_ID = 0x580
ABORT_TIMEOUT = 0x0504_0000
ABORT_OUT_OF_MEMORY = 0x0504_0005
MAX_UPLOAD_BYTES = 65536
"""A node that sends more than this in one transfer is stopped."""

_INITIATE = struct.Struct("<BHB4s")
_ABORT = struct.Struct("<BHBI")

Address = tuple[int, int]
SdoObject = ObjectDef | Address
"""An object of a table, or index and sub-index of any other, whose value is then plain bytes."""


class AnswerKind(IntEnum):
    """What a server answers: the command specifier, top three bits of byte 0."""

    UPLOAD_SEGMENT = 0
    DOWNLOAD_SEGMENT = 1
    UPLOAD = 2
    DOWNLOAD = 3
    ABORT = 4


_SEGMENTS = (AnswerKind.UPLOAD_SEGMENT, AnswerKind.DOWNLOAD_SEGMENT)


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
    if len(data) != 8 or data[0] >> 5 > AnswerKind.ABORT:
        return None
    kind, toggle = AnswerKind(data[0] >> 5), data[0] >> 4 & 1
    if kind is AnswerKind.UPLOAD_SEGMENT:
        return SdoAnswer(kind, toggle=toggle, data=data[1 : 8 - (data[0] >> 1 & 7)], last=bool(data[0] & 1))
    if kind is AnswerKind.DOWNLOAD_SEGMENT:
        return SdoAnswer(kind, toggle=toggle)
    command, index, sub, code = _ABORT.unpack(data)
    if kind is AnswerKind.ABORT:
        return SdoAnswer(kind, (index, sub), code=code)
    if kind is AnswerKind.DOWNLOAD:
        return SdoAnswer(kind, (index, sub))
    expedited, sized = bool(command & 2), bool(command & 1)
    value = data[4 : 8 - (command >> 2 & 3)] if expedited and sized else data[4:]
    return SdoAnswer(kind, (index, sub), data=value, last=expedited, sized=sized)


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
    """

    def __init__(
        self,
        node: int,
        name: str,
        send: Callable[[int, bytes, float], None],
        timeout_s: float,
        counters: CanopenCounters,
    ) -> None:
        self.node = node
        self.name = name
        self._send = send
        self._timeout_s = timeout_s
        self._counters = counters
        self._turn = asyncio.Lock()
        self._object: SdoObject = (0, 0)
        self._expected = (AnswerKind.ABORT, 0)
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
            self._object = obj
            timeout = timeout_s or self._timeout_s
            answer = await self._exchange(make_upload(*_address(obj)), AnswerKind.UPLOAD, 0, timeout)
            if answer.last:
                size = obj.type.bits // 8 if isinstance(obj, ObjectDef) else 0
                return answer.data[: size or 4] if not answer.sized else answer.data
            return await self._upload_segments(timeout)

    async def write_raw(self, obj: SdoObject, data: bytes, timeout_s: float | None = None) -> None:
        """Write the little-endian bytes of an object; raises as :meth:`write` does."""
        async with self._turn:
            self._object = obj
            timeout = timeout_s or self._timeout_s
            await self._exchange(make_download(*_address(obj), data), AnswerKind.DOWNLOAD, 0, timeout)
            if not 1 <= len(data) <= 4:
                await self._download_segments(data, timeout)

    async def _upload_segments(self, timeout_s: float) -> bytes:
        value, toggle, last = bytearray(), 0, False
        while not last:
            request = make_upload_segment(toggle)
            answer = await self._segment(request, AnswerKind.UPLOAD_SEGMENT, toggle, timeout_s)
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
            await self._segment(request, AnswerKind.DOWNLOAD_SEGMENT, toggle, timeout_s)
            toggle ^= 1

    async def _segment(self, request: bytes, kind: AnswerKind, toggle: int, timeout_s: float) -> SdoAnswer:
        try:
            return await self._exchange(request, kind, toggle, timeout_s)
        except NodeAbsent:
            self._abort(ABORT_TIMEOUT)
            raise self._error(Timeout, "stopped answering in the middle of a transfer", "try again") from None
        except asyncio.CancelledError:
            self._abort(ABORT_TIMEOUT)
            raise

    async def _exchange(self, request: bytes, kind: AnswerKind, toggle: int, timeout_s: float) -> SdoAnswer:
        loop = asyncio.get_running_loop()
        waiter: asyncio.Future[SdoAnswer] = loop.create_future()
        self._waiter, self._expected = waiter, (kind, toggle)
        timer = loop.call_later(timeout_s, self._fail, waiter, f"did not answer within {timeout_s * 1e3:.0f} ms")
        self._send(REQUEST_COB_ID + self.node, request, loop.time() + timeout_s)
        try:
            answer = await waiter
        finally:
            timer.cancel()
            self._waiter = None
        if answer.kind is AnswerKind.ABORT:
            raise self._aborted(answer.code)
        return answer

    def receive(self, can_id: int, data: bytes, timestamp: float) -> None:
        """Take a frame from the node's answer COB-ID."""
        answer = parse_answer(data)
        if answer is None:
            self._counters.malformed += 1
        elif self._waiter is None or self._waiter.done() or not self._fits(answer):
            self._counters.late_answers += 1
        else:
            self._waiter.set_result(answer)

    def _fits(self, answer: SdoAnswer) -> bool:
        if answer.kind is AnswerKind.ABORT:
            return answer.address == _address(self._object)
        kind, toggle = self._expected
        if answer.kind is not kind:
            return False
        return answer.toggle == toggle if kind in _SEGMENTS else answer.address == _address(self._object)

    def give_up(self, reason: str) -> None:
        """End the transfer that is running: the node has restarted and will not answer it."""
        if self._waiter is not None:
            self._fail(self._waiter, reason)

    def _fail(self, waiter: asyncio.Future[SdoAnswer], reason: str) -> None:
        if not waiter.done():
            remedy = "check its power, its node id and the CAN cable"
            waiter.set_exception(self._error(NodeAbsent, reason, remedy))

    def _abort(self, code: int) -> None:
        deadline = asyncio.get_running_loop().time() + self._timeout_s
        self._send(REQUEST_COB_ID + self.node, make_abort(*_address(self._object), code), deadline)

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
