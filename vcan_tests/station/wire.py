"""The network between page and station, in a test's hand: it can be frozen, cut and mended, and counts what goes by."""

from __future__ import annotations

import asyncio
import contextlib
import threading
from collections.abc import Coroutine, Iterator
from contextlib import contextmanager
from typing import Any, Literal

PIECE_BYTES = 65_536
Way = Literal["up", "down"]
WAYS: tuple[Way, ...] = ("up", "down")


class Wire:
    """A TCP proxy in a thread of its own, on a free port of the loopback interface.

    Args:
        port: of the station behind it.

    Attributes:
        url: of the page through it.
        bytes_of: went up (to the station) and down (to the page).
    """

    def __init__(self, port: int) -> None:
        self.bytes_of: dict[Way, int] = {"up": 0, "down": 0}
        self._target = port
        self._open = True
        self._writers: set[asyncio.StreamWriter] = set()
        self._loop = asyncio.new_event_loop()
        self._flows: dict[Way, asyncio.Event] = {"up": asyncio.Event(), "down": asyncio.Event()}
        self.thaw()
        self._thread = threading.Thread(target=self._loop.run_forever, daemon=True)
        self._thread.start()
        self._server = self._do(asyncio.start_server(self._serve, "127.0.0.1", 0))
        self.url = f"http://127.0.0.1:{self._server.sockets[0].getsockname()[1]}/"

    def freeze(self, *ways: Way) -> None:
        """Let nothing through any more, as a radio link does that is lost; nobody is told.

        Args:
            ways: that are lost; both where none is named.
        """
        for way in ways or WAYS:
            self._loop.call_soon_threadsafe(self._flows[way].clear)

    def thaw(self) -> None:
        """Let through what has waited, and what comes."""
        for flow in self._flows.values():
            self._loop.call_soon_threadsafe(flow.set)

    def cut(self) -> None:
        """Reset every connection, and each new one, until it is mended."""
        self._loop.call_soon_threadsafe(self._cut)

    def mend(self) -> None:
        """Serve new connections again."""
        self._loop.call_soon_threadsafe(self._open_again)

    def close(self) -> None:
        """End it."""
        self._do(self._end())
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()
        self._loop.close()

    def _do(self, work: Coroutine[Any, Any, Any]) -> Any:
        return asyncio.run_coroutine_threadsafe(work, self._loop).result(10.0)

    def _cut(self) -> None:
        self._open = False
        for writer in self._writers:
            writer.transport.abort()

    def _open_again(self) -> None:
        self._open = True

    async def _end(self) -> None:
        self._server.close()
        self.thaw()
        self._cut()
        tasks = asyncio.all_tasks() - {asyncio.current_task()}
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        if not self._open:
            writer.transport.abort()
            return
        with contextlib.suppress(OSError, asyncio.CancelledError):  # the station is away, or the test is over
            await self._join(reader, writer)
        writer.transport.abort()

    async def _join(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        behind, ahead = await asyncio.open_connection("127.0.0.1", self._target)
        ends = {writer, ahead}
        self._writers |= ends
        try:
            await asyncio.gather(self._carry(reader, ahead, "up"), self._carry(behind, writer, "down"))
        finally:
            ahead.transport.abort()
            self._writers -= ends

    async def _carry(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter, way: Way) -> None:
        with contextlib.suppress(ConnectionError):
            while piece := await reader.read(PIECE_BYTES):
                await self._flows[way].wait()
                self.bytes_of[way] += len(piece)
                writer.write(piece)
                await writer.drain()
        writer.close()


@contextmanager
def wire_to(port: int) -> Iterator[Wire]:
    """A wire while the ``with`` block lasts."""
    wire = Wire(port)
    try:
        yield wire
    finally:
        wire.close()
