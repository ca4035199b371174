"""SDO transfers of the master over the serial line: its frames become requests, the answers become frames.

The gateway hands values over whole (up to 4 bytes) or in segments of its own; segments of CAN frames are cut and joined
here.
"""

from __future__ import annotations

import asyncio
import struct
from collections.abc import Callable, Coroutine
from typing import Any

from canhelm.errors import Aborted, CanhelmError, Timeout
from drivers.canopen.objects import ObjectTable
from drivers.epos.serial_answers import Answer
from drivers.epos.serial_frames import (
    MAX_SEGMENT_BYTES,
    make_initiate_segmented_read,
    make_initiate_segmented_write,
    make_read_object,
    make_segment_read,
    make_segment_write,
    make_write_object,
)
from drivers.epos.serial_line import SerialLine

UNKNOWN_COMMAND = 0x0504_0001
_HEAD = struct.Struct("<BHB4s")
_ABORT = struct.Struct("<BHBI")


class SdoBridge:
    """The transfers of one node.

    Args:
        node: node id as the gateway takes it.
        line: carries the requests.
        table: the node's object dictionary, which tells an object's length.
        long_transfers: held by a transfer in segments, as the gateway keeps only one at a time.
        answer: takes each SDO answer of the node, 8 bytes.
        on_failure: called with the node when it did not answer the gateway (True) or the line failed (False); the
            master then waits in vain.
    """

    def __init__(
        self,
        node: int,
        line: SerialLine,
        table: ObjectTable,
        long_transfers: asyncio.Lock,
        answer: Callable[[bytes], None],
        on_failure: Callable[[int, bool], None],
    ) -> None:
        self._node = node
        self._line = line
        self._table = table
        self._long_transfers = long_transfers
        self._answer = answer
        self._on_failure = on_failure
        self._address = (0, 0)
        self._value = b""
        self._task: asyncio.Task[None] | None = None

    @property
    def transferring(self) -> bool:
        """Whether a transfer in segments runs or waits; another request to the node would end it."""
        return self._task is not None and not self._task.done()

    def take(self, data: bytes, deadline_s: float) -> None:
        """Take one request frame of the master."""
        specifier = data[0] >> 5
        if specifier == 2:
            self._begin_upload(data, deadline_s)
        elif specifier == 1:
            self._begin_download(data, deadline_s)
        elif specifier == 3:
            self._hand_over_segment(data[0] & 0x10)
        elif specifier == 0:
            self._take_segment(data, deadline_s)
        elif specifier != 4:
            _, index, sub, _ = _HEAD.unpack(data)
            self._answer(_ABORT.pack(0x80, index, sub, UNKNOWN_COMMAND))

    def close(self) -> None:
        """Give a long transfer up."""
        if self._task is not None:
            self._task.cancel()

    # --- reading -------------------------------------------------------------------------------------------------

    def _begin_upload(self, data: bytes, deadline_s: float) -> None:
        _, index, sub, _ = _HEAD.unpack(data)
        self._address = (index, sub)
        size = self._size(index, sub)
        if size is not None and size not in (1, 2, 4):
            self._run(self._read_long(index, sub))
            return

        def done(result: Answer | CanhelmError) -> None:
            if self._failed(result):
                return
            assert isinstance(result, Answer)
            command = 0x42 if size is None else 0x43 | (4 - size) << 2
            self._answer(_HEAD.pack(command, index, sub, result.data))

        self._line.submit(make_read_object(self._node, index, sub), done, deadline_s)

    def _size(self, index: int, sub: int) -> int | None:
        """Bytes of an object, 0 where its length varies, None where the table does not have it."""
        entry = self._table.at(index, sub)
        return None if entry is None else entry.type.bits // 8

    async def _read_long(self, index: int, sub: int) -> None:
        await self._line.request(make_initiate_segmented_read(self._node, index, sub))
        value, toggle, more = bytearray(), 0, True
        while more:
            segment = await self._line.request(make_segment_read(toggle))
            value += segment.data
            toggle, more = toggle ^ 1, segment.more
        self._value = bytes(value)
        self._answer(_HEAD.pack(0x41, index, sub, len(value).to_bytes(4, "little")))

    def _hand_over_segment(self, toggle: int) -> None:
        chunk, self._value = self._value[:7], self._value[7:]
        command = toggle | (7 - len(chunk)) << 1 | (not self._value)
        self._answer(bytes((command,)) + chunk.ljust(7, b"\0"))

    # --- writing -------------------------------------------------------------------------------------------------

    def _begin_download(self, data: bytes, deadline_s: float) -> None:
        command, index, sub, value = _HEAD.unpack(data)
        self._address = (index, sub)
        if not command & 2:
            self._value = b""
            self._answer(_HEAD.pack(0x60, index, sub, b""))
            return
        size = 4 - (command >> 2 & 3) if command & 1 else 4

        request, again = make_write_object(self._node, index, sub, value[:size]), True

        def done(result: Answer | CanhelmError) -> None:
            nonlocal again
            if again and isinstance(result, Timeout):
                again = False  # the same value once more does no harm, whether the first one arrived or not
                self._line.submit(request, done, deadline_s)
            elif not self._failed(result):
                self._answer(_HEAD.pack(0x60, index, sub, b""))

        self._line.submit(request, done, deadline_s)

    def _take_segment(self, data: bytes, deadline_s: float) -> None:
        toggle = data[0] & 0x10
        self._value += data[1 : 8 - (data[0] >> 1 & 7)]
        if data[0] & 1:
            self._run(self._write_long(self._value, toggle))
        else:
            self._answer(bytes((0x20 | toggle, 0, 0, 0, 0, 0, 0, 0)))

    async def _write_long(self, value: bytes, last_toggle: int) -> None:
        await self._line.request(make_initiate_segmented_write(self._node, *self._address, len(value)))
        toggle = 0
        for start in range(0, len(value), MAX_SEGMENT_BYTES):
            await self._line.request(make_segment_write(value[start : start + MAX_SEGMENT_BYTES], toggle))
            toggle ^= 1
        self._answer(bytes((0x20 | last_toggle, 0, 0, 0, 0, 0, 0, 0)))

    # --- ends ----------------------------------------------------------------------------------------------------

    def _run(self, transfer: Coroutine[Any, Any, None]) -> None:
        async def guarded() -> None:
            try:
                async with self._long_transfers:
                    await transfer
            except CanhelmError as error:
                self._failed(error)

        self._task = asyncio.get_running_loop().create_task(guarded(), name=f"serial SDO of node {self._node}")

    def _failed(self, result: Answer | CanhelmError) -> bool:
        """Hand an abort code up as an abort; a node that is silent stays silent. True where it was no success."""
        code = result.value if isinstance(result, Aborted) else result.error if isinstance(result, Answer) else None
        if code == 0:
            return False
        if not isinstance(code, int) or code in SILENT:
            self._on_failure(self._node, code in SILENT)
        else:
            self._answer(_ABORT.pack(0x80, *self._address, code))
        return True


SILENT = frozenset((0x0504_0000, 0x0F00_FFB9))
"""What the gateway answers for a node that does not: SDO time-out, wrong node id."""
