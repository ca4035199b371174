"""A client of the socket that sends what it is told, and how tests wait for what comes of it."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Awaitable, Callable
from typing import Any

import pytest

from canhelm import protocol
from daemon.api.server import Server


class RawClient:
    """A client that sends what it is told, sense or nonsense."""

    def __init__(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self.reader = reader
        self.writer = writer

    def send(self, line: bytes) -> None:
        self.writer.write(line)

    async def answer(self) -> dict[str, Any]:
        line = await asyncio.wait_for(self.reader.readline(), 5)
        parsed = protocol.parse_message(line)
        assert isinstance(parsed, dict), line
        return parsed

    async def ask(self, method: str, /, **params: Any) -> dict[str, Any]:
        self.send(protocol.make_request(1, method, params))
        return await self.answer()

    async def close(self) -> None:
        self.writer.close()
        with contextlib.suppress(ConnectionError):
            await self.writer.wait_closed()

    async def ended(self) -> bool:
        try:
            while await asyncio.wait_for(self.reader.read(65536), 5):
                pass
        except ConnectionError:
            pass
        return True


Connect = Callable[[Server], Awaitable[RawClient]]


async def until(condition: Any) -> None:
    for _ in range(1000):
        if condition():
            return
        await asyncio.sleep(0.005)
    pytest.fail("it did not come true")
