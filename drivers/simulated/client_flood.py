"""Clients of the daemon's own socket that ask as fast as they can, and never read an answer."""

from __future__ import annotations

import asyncio
import contextlib
import socket
from pathlib import Path
from typing import Final

from canhelm import protocol

_QUESTIONS: Final = protocol.make_request(1, "hello", {}) * 64
_AGAIN_S: Final = 0.1
"""After which a client comes back that was hung up on, or not let in."""


class ClientFlood:
    """A crowd of them.

    Args:
        path: of the socket.
        clients: how many.
    """

    def __init__(self, path: Path, clients: int) -> None:
        self._path = path
        self._count = clients
        self._clients: list[asyncio.Task[None]] = []

    def begin(self) -> None:
        """Let them come."""
        self._clients = [asyncio.create_task(self._flood(), name="a client that floods") for _ in range(self._count)]

    def end(self) -> None:
        """Let them hang up."""
        for client in self._clients:
            client.cancel()

    async def _flood(self) -> None:
        while True:
            with contextlib.suppress(OSError):
                await self._ask()
            await asyncio.sleep(_AGAIN_S)

    async def _ask(self) -> None:
        """Ask until the daemon hangs up. Raises OSError when it does."""
        loop = asyncio.get_running_loop()
        with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as client:
            client.setblocking(False)
            await loop.sock_connect(client, str(self._path))
            while True:
                await loop.sock_sendall(client, _QUESTIONS)
