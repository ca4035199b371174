"""Somebody at a browser, as far as the network sees it, and how tests wait for what comes of it."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Awaitable, Callable
from typing import Any

from aiohttp import ClientResponse, ClientSession, ClientWebSocketResponse, WSMsgType

TIMEOUT_S = 10.0
Answer = dict[str, Any]


class Page:
    """A page that is connected to a robot.

    Args:
        socket: its WebSocket.

    Attributes:
        sent_ms: when it says that it sends what it sends; None: it does not say.
    """

    def __init__(self, socket: ClientWebSocketResponse) -> None:
        self.socket = socket
        self.sent_ms: float | None = None
        self._last_id = 0

    async def send(self, method: str, **params: Any) -> int:
        """Send a request; its id."""
        self._last_id += 1
        request = {"jsonrpc": "2.0", "id": self._last_id, "method": method, "params": params}
        if self.sent_ms is not None:
            request["sent_ms"] = self.sent_ms
        await self.socket.send_str(json.dumps(request))
        return self._last_id

    async def ask(self, method: str, **params: Any) -> Answer:
        """Send a request, and wait for its answer."""
        request = await self.send(method, **params)
        return await self.hear(lambda message: message.get("id") == request)

    async def hear(self, wanted: Callable[[Answer], bool]) -> Answer:
        """The next message of a kind; others are thrown away."""
        async with asyncio.timeout(TIMEOUT_S):
            while not wanted(message := json.loads(await self.socket.receive_str())):
                pass
        assert isinstance(message, dict)
        return message

    async def closed(self) -> tuple[Any, str]:
        """Code and reason with which the station has closed; messages before it are thrown away."""
        async with asyncio.timeout(TIMEOUT_S):
            while (message := await self.socket.receive()).type is WSMsgType.TEXT:
                pass
        return message.data, str(message.extra or "")


class Visitor:
    """Somebody with a browser.

    Args:
        session: with their cookies.
        url: of the station, without a slash at its end.
    """

    def __init__(self, session: ClientSession, url: str) -> None:
        self.session = session
        self.url = url

    async def get(self, path: str, **headers: str) -> ClientResponse:
        """The answer to a request for a path; words of a header's name have an underscore between them."""
        return await self.session.get(f"{self.url}{path}", headers=_named(headers))

    async def login(self, token: Any) -> ClientResponse:
        """The answer to a token."""
        return await self.session.post(f"{self.url}/login", json={"token": token})

    async def open(self, robot: str = "fake", **headers: str) -> Page:
        """A page that is connected to a robot."""
        address = f"{self.url}/ws/{robot}"
        return Page(await self.session.ws_connect(address, headers=_named(headers), compress=15, autoping=True))


def _named(headers: dict[str, str]) -> dict[str, str]:
    return {name.replace("_", "-"): value for name, value in headers.items()}


Visit = Callable[..., Awaitable[Visitor]]
"""Opens a station, if need be with tokens, and sends somebody there."""
