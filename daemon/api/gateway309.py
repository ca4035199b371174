"""The CiA 309-3 ASCII gateway: existing CANopen tools reach the bus through the daemon that owns it.

Each client has a conversation of its own: its requests are carried out one after the other, in their order, and each
answer goes out in one piece. Whatever a client sends or fails to read, the control cycle keeps its time.
"""

from __future__ import annotations

import asyncio
import logging
import os
import socket
from dataclasses import dataclass
from pathlib import Path

from canhelm.errors import ConfigError
from daemon.api.gateway309_answers import ErrorNumber, make_error
from daemon.api.gateway309_session import Session
from daemon.api.gateway309_text import MAX_LINE_BYTES
from daemon.api.listeners import open_listener, remove_socket
from daemon.api.parameters import Role
from daemon.api.peers import Rights
from daemon.runtime.supervisor import Supervisor

LOGGER = logging.getLogger("canhelm.gateway")
LOOPBACK = "127.0.0.1"
MAX_CLIENTS = 16
STALLED_S = 10.0
"""How long a client may leave its answers unread."""
_CLOSED = "this gateway only reads: start the daemon with --gateway-write"
_TCP_READS = "over TCP the gateway only reads: use its Unix socket"


@dataclass(slots=True)
class Counters:
    """What the gateway has seen.

    Attributes:
        clients: connected now.
        requests: lines that were answered.
        dropped_clients: turned away, or hung up on because they did not read.
        internal_errors: requests that failed by a defect of the daemon (each is logged with its traceback).
    """

    clients: int = 0
    requests: int = 0
    dropped_clients: int = 0
    internal_errors: int = 0


class Gateway309:
    """The gateway's sockets and clients.

    Args:
        supervisor: what decides, and what the bus is reached through.
        path: where to listen.
        tcp_port: port on the loopback interface to listen on as well, read-only; 0 for any free one, None for none.
        writable: clients of the Unix socket may write objects, command network states and use LSS.
        inherited: a socket that listens at ``path`` already; whoever has opened it takes it away.
        rights: who may do what.
    """

    def __init__(
        self,
        supervisor: Supervisor,
        path: Path,
        *,
        tcp_port: int | None = None,
        writable: bool = False,
        inherited: socket.socket | None = None,
        rights: Rights | None = None,
    ) -> None:
        self.path = path
        self.tcp_port = tcp_port
        self.counters = Counters()
        self._supervisor = supervisor
        self._writable = writable
        self._inherited = inherited
        self._rights = rights or Rights()
        self._listeners: list[socket.socket] = []
        self._servers: list[asyncio.Server] = []
        self._inode = 0
        self._clients: set[asyncio.Task[None]] = set()

    async def start(self) -> None:
        """Open the sockets.

        Raises:
            Refused: another daemon answers there.
            ConfigError: the path or the port cannot be used.
            PermissionRefused: this user may not create the socket.
        """
        if self._inherited is not None:
            unix = self._inherited.dup()
        else:
            unix = open_listener(self.path, self._rights, "--gateway")
            self._inode = os.stat(self.path).st_ino
        self._listeners.append(unix)
        # not start_unix_server: from Python 3.13 on that takes the path away, whoever owns it
        self._servers.append(await asyncio.start_server(self._on_unix, sock=unix, limit=MAX_LINE_BYTES))
        if self.tcp_port is not None:
            tcp = _listen_on_loopback(self.tcp_port)
            self._listeners.append(tcp)
            self.tcp_port = tcp.getsockname()[1]
            self._servers.append(await asyncio.start_server(self._on_tcp, sock=tcp, limit=MAX_LINE_BYTES))

    async def close(self) -> None:
        """Hang up on everybody and take the socket away."""
        for listener in self._listeners:
            asyncio.get_running_loop().remove_reader(listener)
        await asyncio.sleep(0)  # asyncio loses a connection that it has just accepted when its server closes
        for server in self._servers:
            server.close()
        for client in self._clients:
            client.cancel()
        if self._clients:
            await asyncio.wait(self._clients)
        if self._listeners:
            remove_socket(self.path, self._inode)
        self._listeners.clear()
        self._servers.clear()

    # -- clients ------------------------------------------------------------------------------------------------------

    async def _on_unix(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        peer = self._rights.peer(writer.get_extra_info("socket"))
        refusal = self._rights.refusal(peer, Role.WATCH, "the gateway")
        if refusal is not None:
            await self._turn_away(writer, str(refusal))
            return
        denied = self._rights.refusal(peer, Role.CONFIGURE, "writing")
        await self._admit(reader, writer, str(denied or "") if self._writable else _CLOSED)

    async def _on_tcp(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        await self._admit(reader, writer, _TCP_READS)

    async def _admit(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter, read_only: str) -> None:
        if len(self._clients) >= MAX_CLIENTS:
            await self._turn_away(writer, "too many clients: close one of them")
            return
        task = asyncio.current_task()
        assert task is not None
        self._clients.add(task)
        self.counters.clients = len(self._clients)
        try:
            await self._converse(reader, writer, Session(self._supervisor, read_only))
        except asyncio.CancelledError:
            LOGGER.info("the gateway hung up on a client: the daemon is going down")
        finally:
            self._clients.discard(task)
            self.counters.clients = len(self._clients)
            writer.close()

    async def _turn_away(self, writer: asyncio.StreamWriter, reason: str) -> None:
        self.counters.dropped_clients += 1
        writer.write(make_error(0, ErrorNumber.INTERNAL_STATE, reason))
        writer.close()

    async def _converse(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter, session: Session) -> None:
        try:
            while (line := await _next_line(reader)) is not None and not writer.is_closing():
                writer.write(await self._answer(session, line))
                async with asyncio.timeout(STALLED_S):
                    await writer.drain()
                await asyncio.sleep(0)  # many lines at once must not keep the control cycle waiting
        except ConnectionError:
            LOGGER.info("a client of the gateway hung up in the middle of its answers")
        except TimeoutError:
            LOGGER.warning("a client of the gateway was dropped: it does not read its answers")
            self.counters.dropped_clients += 1
            writer.transport.abort()

    async def _answer(self, session: Session, line: bytes) -> bytes:
        self.counters.requests += 1
        try:
            return await session.answer(line)
        except Exception:
            LOGGER.exception("the gateway failed at the line %r", line)
            self.counters.internal_errors += 1
            return make_error(session.sequence, ErrorNumber.INTERNAL_STATE, "the daemon failed; report it with its log")


async def _next_line(reader: asyncio.StreamReader) -> bytes | None:
    """The next line without its end, the beginning of one that is too long; None when there are no more."""
    head = b""
    while True:
        try:
            line = await reader.readuntil(b"\n")
        except asyncio.IncompleteReadError:
            return None
        except asyncio.LimitOverrunError as error:
            head = (head + await reader.readexactly(error.consumed))[:MAX_LINE_BYTES]
        else:
            return (head + line)[:-1][:MAX_LINE_BYTES]


def _listen_on_loopback(port: int) -> socket.socket:
    try:
        return socket.create_server((LOOPBACK, port))
    except (OSError, OverflowError) as error:
        raise ConfigError(
            f"the gateway cannot listen on {LOOPBACK} port {port}: {error}",
            remedy="choose another port with --gateway-tcp PORT",
        ) from None
