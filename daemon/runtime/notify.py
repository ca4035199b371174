"""What a daemon tells the service manager: ready, status, watchdog, reloading, stopping (sd_notify(3)).

Where no service manager asked for it (no NOTIFY_SOCKET in the environment) nothing is sent.
"""

from __future__ import annotations

import asyncio
import logging
import socket
from collections.abc import Callable, Mapping

LOGGER = logging.getLogger("canhelm")
FEEDS_PER_TIMEOUT = 4
"""The watchdog is fed this often in the time after which it bites."""
STATUS_S = 0.5
"""Time between two looks at the status where no watchdog asks for more."""


class ServiceManager:
    """The service manager's end of the conversation, as far as a daemon speaks to it.

    Args:
        address: of its datagram socket, ``@`` for the first byte of an abstract one; empty where there is none.
        watchdog_s: time without a good control cycle after which it takes the daemon for hung; None: it does not watch.

    Attributes:
        sentence: says in one line how the vehicle is.
        remark: what else a person should know of this daemon until it is reloaded; empty for nothing.
    """

    def __init__(self, address: str = "", watchdog_s: float | None = None) -> None:
        self.sentence: Callable[[], str] = str
        self.remark = ""
        self._address = "\0" + address[1:] if address.startswith("@") else address
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) if address else None
        self._pause_s = STATUS_S if watchdog_s is None else min(STATUS_S, watchdog_s / FEEDS_PER_TIMEOUT)
        self._due_s = 0.0
        self._told = ""
        self._mute = False

    @classmethod
    def of(cls, environment: Mapping[str, str], pid: int) -> ServiceManager:
        """The one that started this process.

        Args:
            environment: of this process, with NOTIFY_SOCKET, WATCHDOG_USEC and WATCHDOG_PID.
            pid: its id; a watchdog that was meant for another process is none.
        """
        micros, watched = environment.get("WATCHDOG_USEC", ""), environment.get("WATCHDOG_PID", str(pid))
        watchdog_s = int(micros) / 1e6 if micros.isdecimal() and watched == str(pid) else None
        return cls(environment.get("NOTIFY_SOCKET", ""), watchdog_s)

    @property
    def present(self) -> bool:
        """Whether a service manager listens."""
        return self._socket is not None

    def ready(self) -> None:
        """The daemon can be asked; also the end of a reload, whether it was carried out or refused."""
        self._told = self._status()
        self._send("READY=1", f"STATUS={self._told}")

    def good_cycle(self, now_s: float) -> None:
        """Feed the watchdog and keep the status current; called by each control cycle that met its deadline."""
        if now_s < self._due_s:
            return
        self._due_s = now_s + self._pause_s
        status = self._status()
        if status == self._told:
            self._send("WATCHDOG=1")
        elif self._send("WATCHDOG=1", f"STATUS={status}"):
            self._told = status

    def reloading(self) -> None:
        """A reload has begun; :meth:`ready` ends it."""
        micros = round(asyncio.get_running_loop().time() * 1e6)
        self._send("RELOADING=1", f"MONOTONIC_USEC={micros}", "STATUS=reloading the profile")

    def stopping(self, status: str) -> None:
        """The daemon goes down."""
        self._send("STOPPING=1", f"STATUS={status}")

    def close(self) -> None:
        """Say no more."""
        if self._socket is not None:
            self._socket.close()
            self._socket = None

    def _status(self) -> str:
        sentence = self.sentence()
        return " ".join((f"{sentence} - {self.remark}" if self.remark else sentence).split())

    def _send(self, *lines: str) -> bool:
        """Whether it was heard."""
        if self._socket is None:
            return False
        try:
            self._socket.sendto("\n".join(lines).encode(), socket.MSG_DONTWAIT | socket.MSG_NOSIGNAL, self._address)
            self._mute = False
        except OSError as error:
            if not self._mute:
                LOGGER.warning("the service manager does not hear %s: %s", lines[0], error)
            self._mute = True
            return False
        return True
