"""A service manager for tests: the other end of the notification socket."""

from __future__ import annotations

import os
import select
import socket
from pathlib import Path


class Manager:
    """The service manager's end of the socket."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self._socket.bind(os.fspath(path))
        self._socket.setblocking(False)

    def heard(self) -> list[list[str]]:
        """The lines of each message since the last call."""
        messages = []
        while True:
            try:
                messages.append(self._socket.recv(4096).decode().split("\n"))
            except BlockingIOError:
                return messages

    def hears(self, within_s: float) -> bool:
        """Wait for a message; False where none comes in that time."""
        return bool(select.select([self._socket], [], [], within_s)[0])

    def fed(self) -> int:
        """How often the watchdog was fed since the last call."""
        return sum("WATCHDOG=1" in message for message in self.heard())

    def close(self) -> None:
        """Listen no more."""
        self._socket.close()
