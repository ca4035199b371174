"""The socket server: JSON-RPC 2.0, one object a line, on a Unix socket.

Whatever a client sends or fails to do, the daemon lives: nonsense is answered, a client that hangs up loses its lease,
one that stops reading loses samples and then its connection.
"""

from __future__ import annotations

import asyncio
import logging
import os
import socket
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Protocol

from canhelm import protocol
from canhelm.errors import Refused
from daemon.api.connection import Connection
from daemon.api.listeners import open_listener, remove_socket
from daemon.api.metering import Meters
from daemon.api.peers import Rights

LOGGER = logging.getLogger("canhelm.api")
MAX_CLIENTS = 32
RESERVED_CLIENTS = 8
"""Further clients that may only stop: a crowd must not keep anybody from stopping the robot."""
IDLE_S = 2.0
"""The least silence after which a client may lose its place to another one."""


class Backend(Protocol):
    """What the server asks of the daemon behind it."""

    @property
    def robot(self) -> str:
        """Name of the robot."""
        ...

    @property
    def events(self) -> list[Callable[[dict[str, Any]], None]]:
        """Callbacks that hear of each event; the server adds its own."""
        ...

    @property
    def state(self) -> str:
        """State of the vehicle."""
        ...

    @property
    def lease_timeout_s(self) -> float:
        """How long a motion goes on without a renewal."""
        ...

    def status(self) -> dict[str, Any]:
        """State at a glance, for JSON."""
        ...

    def open_lease(self, client: str, details: Mapping[str, Any]) -> str:
        """A lease for a client that is about to move something; returns its id."""
        ...

    def renew_lease(self, lease: str) -> None:
        """Keep a lease alive. Raises Refused where it has run out."""
        ...

    def close_lease(self, lease: str, reason: str = "its client hung up") -> None:
        """The client is gone: its motions stop."""
        ...

    async def end_lease(self, lease: str, reason: str) -> None:
        """The client lets go: its motions stop; returns when they have ended."""
        ...

    async def take_lease(self, lease: str) -> str | None:
        """Take the robot over for a lease; returns who had it, once the motions of others have ended."""
        ...

    async def call(self, method: str, params: dict[str, Any], lease: str | None) -> dict[str, Any]:
        """Carry out a method with validated parameters. Raises CanhelmError leaves."""
        ...


@dataclass(slots=True)
class Counters:
    """What the server has seen.

    Attributes:
        clients: connected now.
        requests: lines that were requests.
        malformed: lines that were not.
        refused: requests of clients that sent too many at once.
        lost_samples: status samples and events not sent to clients that read too slowly.
        dropped_clients: connections ended because of what the client did or did not do.
        internal_errors: requests that failed by a defect of the daemon (each is logged with its traceback).
    """

    clients: int = 0
    requests: int = 0
    malformed: int = 0
    refused: int = 0
    lost_samples: int = 0
    dropped_clients: int = 0
    internal_errors: int = 0


class Server:
    """The daemon's end of the socket.

    Args:
        backend: what carries the methods out.
        path: where to listen.
        inherited: a socket that listens there already; whoever has opened it takes it away.
        rights: who may do what.
    """

    def __init__(
        self,
        backend: Backend,
        path: Path,
        inherited: socket.socket | None = None,
        rights: Rights | None = None,
    ) -> None:
        self.backend = backend
        self.path = path
        self.rights = rights or Rights()
        self.counters = Counters()
        self.meters = Meters()
        self.connections: set[Connection] = set()
        self.tasks: set[asyncio.Task[None]] = set()
        self._inherited = inherited
        self._listener: socket.socket | None = None
        self._server: asyncio.Server | None = None
        self._inode = 0
        self._told_of_crowd = False

    async def start(self) -> None:
        """Open the socket.

        Raises:
            Refused: another daemon answers there.
            ConfigError: the path cannot be used.
            PermissionRefused: this user may not create it.
        """
        if self._inherited is not None:
            self._listener = self._inherited.dup()
        else:
            self._listener = open_listener(self.path, self.rights)
            self._inode = os.stat(self.path).st_ino
        # not create_unix_server: from Python 3.13 on that takes the path away, whoever owns it
        self._server = await asyncio.get_running_loop().create_server(self._accept, sock=self._listener)
        self.backend.events.append(self._on_event)

    async def close(self) -> None:
        """Hang up on everybody and take the socket away."""
        if self._server is None or self._listener is None:
            return
        asyncio.get_running_loop().remove_reader(self._listener)
        await asyncio.sleep(0)  # asyncio loses a connection that it has just accepted when its server closes
        self._server.close()
        self._server = None
        self.backend.events.remove(self._on_event)
        for connection in list(self.connections):
            connection.end()
        for task in list(self.tasks):
            task.cancel()
        if self.tasks:
            await asyncio.wait(list(self.tasks))
        await asyncio.sleep(0)
        for deaf in list(self.connections):
            deaf.abort()
        remove_socket(self.path, self._inode)

    def status(self) -> dict[str, Any]:
        """The backend's status with the server's own counters."""
        return {**self.backend.status(), "api": {"pid": os.getpid(), **asdict(self.counters)}}

    def _accept(self) -> Connection:
        return Connection(self)

    def admit(self, connection: Connection) -> None:
        """Take a new connection in, unless the server goes down.

        Where all places are taken, the client that has been idle longest loses its own. While none is idle, a new one
        may only stop the robot, and for that there is a place as long as not all of those are just being used to stop.
        """
        if self._server is None:
            connection.abort()
            return
        ordinary = {each for each in self.connections if not each.crowded}
        if len(ordinary) >= MAX_CLIENTS and not self._dismiss_idle(ordinary, self._idle_enough_s):
            connection.crowded = True
            others = self.connections - ordinary
            if len(others) >= RESERVED_CLIENTS and not self._dismiss_idle(others, 0.0):
                connection.dismiss()
                return
        self.connections.add(connection)
        self.counters.clients = len(self.connections)

    def crowd_refusal(self) -> Refused:
        """What a client is told for whom there was no place."""
        longest_s = max((each.idle_s for each in self.connections if not each.crowded), default=0.0)
        wait_s = max(0.0, self._idle_enough_s - longest_s)
        told = f"a place gets free in {wait_s:.1f} s at the earliest, from a client that says nothing for that long"
        return Refused("too many clients: this one may only stop", remedy=f"close other clients, or try again: {told}")

    @property
    def _idle_enough_s(self) -> float:
        """Silence after which a client loses its place to another one; longer than a lease lives without renewal."""
        return max(IDLE_S, self.backend.lease_timeout_s)

    def leave(self, connection: Connection) -> None:
        """A connection has ended."""
        self.connections.discard(connection)
        self.counters.clients = len(self.connections)
        self._told_of_crowd = self._told_of_crowd and self.counters.clients > MAX_CLIENTS // 2

    def _dismiss_idle(self, connections: set[Connection], least_s: float) -> bool:
        """Hang up on the one of them that has been idle longest; False where none has been idle for that long."""
        if not self._told_of_crowd:
            self._told_of_crowd = True
            LOGGER.warning("too many clients (%d): the longest idle one is hung up on for each new one", MAX_CLIENTS)
        longest = max(connections, key=lambda each: each.idle_s)
        if longest.idle_s <= least_s:
            return False
        longest.dismiss()
        self.leave(longest)
        return True

    def _on_event(self, event: dict[str, Any]) -> None:
        line = protocol.make_notification("event", event)
        for connection in self.connections:
            if connection.subscribed:
                connection.publish(line)
