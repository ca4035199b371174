"""The port on which clients come over TCP: who shows a token there talks to the server like any other client."""

from __future__ import annotations

import asyncio
import logging
from dataclasses import replace
from functools import partial
from typing import Final

from canhelm import protocol
from canhelm.errors import CanhelmError, ConfigError, PermissionRefused, UsageError
from daemon.api.connection import Connection
from daemon.api.parameters import Role
from daemon.api.peers import Peer
from daemon.api.server import Server
from daemon.api.tokens import Tokens
from daemon.runtime.clock import pace

LOGGER = logging.getLogger("canhelm.api")
LOOPBACK: Final = "127.0.0.1"
MAX_WAITING: Final = 8
"""Clients that have not shown a token yet."""
PATIENCE_S: Final = 5.0
"""How long such a client may take."""
WRONG_S: Final = 1.0
"""How long one with a wrong token waits for its answer."""
MAX_LINE_BYTES: Final = 4096


class Door:
    """The port and who waits at it.

    Args:
        server: that clients are handed to.
        host: address to listen on.
        port: to listen on; 0 for any free one.
        tokens: that open it.
    """

    def __init__(self, server: Server, host: str, port: int, tokens: Tokens) -> None:
        self.server = server
        self.tokens = tokens
        self.host, self.port = host, port
        self.waiting: set[Visitor] = set()
        self._listening: asyncio.Server | None = None

    async def start(self) -> None:
        """Listen. Raises ConfigError where that is not possible."""
        loop = asyncio.get_running_loop()
        try:
            self._listening = await loop.create_server(partial(Visitor, self), self.host, self.port)
        except (OSError, OverflowError) as error:
            reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
            raise ConfigError(
                f"the API cannot listen on {self.host} port {self.port}: {reason}",
                remedy="choose another one with --tcp [HOST:]PORT",
            ) from None
        self.port = self._listening.sockets[0].getsockname()[1]
        if self.host != LOOPBACK:
            LOGGER.warning(
                "the API listens on %s port %d: whoever hears the network hears tokens", self.host, self.port
            )

    def close(self) -> None:
        """Listen no more, and hang up on who has shown no token; the server hangs up on the others."""
        if self._listening is not None:
            self._listening.close()
        for visitor in list(self.waiting):
            visitor.turn_away()


class Visitor(asyncio.Protocol):
    """Who has not shown a token yet: its first line has to be the request ``login``.

    Args:
        door: that it waits at.
    """

    def __init__(self, door: Door) -> None:
        self._door = door
        self._received = bytearray()
        self._transport: asyncio.Transport | None = None
        self._patience: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Somebody is there."""
        assert isinstance(transport, asyncio.Transport)
        self._transport = transport
        if len(self._door.waiting) >= MAX_WAITING:
            transport.abort()
            return
        self._door.waiting.add(self)
        self._patience = asyncio.get_running_loop().call_later(PATIENCE_S * pace(), self.turn_away)

    def connection_lost(self, exc: Exception | None) -> None:
        """It has gone."""
        self._leave()
        self._transport = None

    def data_received(self, data: bytes) -> None:
        """Bytes came in."""
        self._received += data
        if len(self._received) > MAX_LINE_BYTES:
            self.turn_away()
        elif b"\n" in self._received and self._transport is not None:
            self._transport.pause_reading()
            self._judge(self._transport, bytes(self._received))

    def turn_away(self) -> None:
        """Hang up."""
        self._leave()
        if self._transport is not None:
            self._transport.abort()

    def _leave(self) -> None:
        self._door.waiting.discard(self)
        if self._patience is not None:
            self._patience.cancel()

    def _judge(self, transport: asyncio.Transport, received: bytes) -> None:
        line, _, rest = received.partition(b"\n")
        request, token = _login(protocol.parse_message(line))
        if token is None:
            self._refuse(UsageError("the first request over TCP is login", remedy="log in with a token"))
            return
        role = self._door.tokens.role_of(token)
        if role is not None:
            self._let_in(transport, role, request, rest)
            return
        LOGGER.warning("somebody at %s showed a wrong token", _host(transport))
        refusal = PermissionRefused("the token is wrong", remedy="give one of the daemon's --tokens file")
        asyncio.get_running_loop().call_later(WRONG_S * pace(), self._refuse, refusal)

    def _let_in(self, transport: asyncio.Transport, role: Role, request: int | str | None, rest: bytes) -> None:
        """From now on it is a client like any other."""
        self._leave()
        peer = replace(Peer.nobody(), role=role, name=f"a token for {role} at {_host(transport)}")
        connection = Connection(self._door.server, peer)
        transport.write(protocol.make_result(request, {"role": role.value}))
        transport.set_protocol(connection)
        connection.connection_made(transport)
        transport.resume_reading()
        if rest:
            connection.data_received(rest)

    def _refuse(self, refusal: CanhelmError) -> None:
        self._leave()
        if self._transport is not None:
            self._transport.write(protocol.make_error(None, refusal.rpc_code, refusal.message, refusal.data()))
            self._transport.close()


def _login(message: dict[str, object] | str) -> tuple[int | str | None, str | None]:
    """Id and token of a request to log in; no token where it is none."""
    if isinstance(message, str) or message.get("method") != "login":
        return None, None
    request, params = message.get("id"), message.get("params")
    token = params.get("token") if isinstance(params, dict) else None
    return request if isinstance(request, int | str) else None, token if isinstance(token, str) else None


def _host(transport: asyncio.Transport) -> str:
    return str(transport.get_extra_info("peername")[0])
