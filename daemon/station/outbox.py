"""What goes to one page: answers and events in order, and of the samples of the status the newest alone."""

from __future__ import annotations

import asyncio
from collections import deque
from typing import Final

from canhelm import protocol

MAX_UNSENT_BYTES: Final = 2 * protocol.MAX_ANSWER_BYTES
"""Unsent answers at which a page is given up."""
SLOW_BYTES: Final = 64 * 1024
"""Unsent bytes from which on events are lost."""
_STATUS: Final = b'{"jsonrpc":"2.0","method":"status"'
_NOTIFICATION: Final = b'{"jsonrpc":"2.0","method":'
"""How messages of the daemon begin (:func:`canhelm.protocol.make_notification`)."""


class Outbox:
    """Messages that wait for a page that reads more slowly than the daemon writes.

    Attributes:
        lost: notifications that were not sent.
    """

    def __init__(self) -> None:
        self.lost = 0
        self._lines: deque[bytes] = deque()
        self._unsent_bytes = 0
        self._status: bytes | None = None
        self._ended = False
        self._filled = asyncio.Event()

    @property
    def overfull(self) -> bool:
        """Whether too many answers wait."""
        return self._unsent_bytes > MAX_UNSENT_BYTES

    def put(self, line: bytes) -> None:
        """Take a message."""
        if line.startswith(_STATUS):
            self.lost += self._status is not None
            self._status = line
        elif line.startswith(_NOTIFICATION) and self._unsent_bytes > SLOW_BYTES:
            self.lost += 1
        else:
            self._lines.append(line)
            self._unsent_bytes += len(line)
        self._filled.set()

    def end(self) -> None:
        """Nothing more comes."""
        self._ended = True
        self._filled.set()

    async def get(self) -> bytes:
        """The next message to send, as soon as there is one, samples of the status last; empty where none comes."""
        while not self._lines and self._status is None and not self._ended:
            self._filled.clear()
            await self._filled.wait()
        if self._lines:
            line = self._lines.popleft()
            self._unsent_bytes -= len(line)
            return line
        line, self._status = self._status or b"", None
        return line
