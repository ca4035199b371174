"""One page and one daemon: requests and answers go both ways as they come, within what the page may do.

Each page has a connection of its own to the daemon, so that lease, subscription and place are its own there, too. What
a page asks for is written to the daemon at once; what the daemon says waits for a page that reads slowly.
"""

from __future__ import annotations

import asyncio
import logging
import socket
from typing import Any, Final

from aiohttp import WSMessage, WSMsgType, web

from canhelm import protocol
from canhelm.errors import CanhelmError, DaemonNotRunning, PermissionRefused, Refused, UsageError
from daemon.api.parameters import Method, Role, validate
from daemon.station.lateness import Lateness
from daemon.station.limits import lowered, refusal
from daemon.station.methods import METHODS, PREFIX, Function
from daemon.station.outbox import Outbox
from daemon.station.requests import make_line, parse_request
from daemon.station.robots import Robot

LOGGER: Final = logging.getLogger("canhelm.station")
NO_DAEMON: Final = 4404
"""Code of a WebSocket whose daemon is not there, or has gone."""
POLICY: Final = 1008
"""Code of one whose page sends nonsense (RFC 6455, 7.4.1)."""
MAX_MALFORMED: Final = 50
"""Messages that are no request after which a page is hung up on."""
MAX_PENDING: Final = 8
"""Methods of the station itself that one page may have under way."""
STALLED_S: Final = 10.0
"""Time without reading after which a page is hung up on."""
FLUSH_S: Final = 1.0
"""How long a page is sent what waits for it when its daemon has gone."""
UNSENT_BYTES: Final = 16 * 1024
"""What the kernel holds for a page beyond what is on its way: samples that wait there would only get older."""
_REASON_BYTES: Final = 123
"""Of the reason with which a WebSocket closes (RFC 6455, 5.5)."""
NAMES: Final = "client.name"
SENT: Final = "sent_ms"
"""Member of a request: when it was sent, by the page's clock; the daemon does not see it."""
_FAREWELL: Final = b'{"jsonrpc":"2.0","id":null,"error"'

Ending = tuple[int, str]
"""Code and reason with which a WebSocket closes."""


class Link:
    """A page that is connected to a robot's daemon.

    Args:
        page: the WebSocket.
        transport: of the page.
        robot: the robot.
        limit: the most that the page may do.
        name: what people call the page.
    """

    def __init__(
        self,
        page: web.WebSocketResponse,
        transport: asyncio.Transport,
        robot: Robot,
        limit: Role,
        name: str,
    ) -> None:
        self._name = name
        self._page = page
        self._transport = transport
        self._robot = robot
        self._limit = limit
        self._outbox = Outbox()
        self._lateness = Lateness()
        self._malformed = 0
        self._own: set[asyncio.Task[None]] = set()

    async def run(self, connection: socket.socket) -> None:
        """Carry messages until one end hangs up, then hang up on the other.

        Args:
            connection: to the daemon.
        """
        self._transport.set_write_buffer_limits(high=0)
        page_socket = self._transport.get_extra_info("socket")
        page_socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NOTSENT_LOWAT, UNSENT_BYTES)
        connection.setblocking(False)
        reader, writer = await asyncio.open_connection(sock=connection, limit=protocol.MAX_ANSWER_BYTES)
        asking, hearing = asyncio.create_task(self._ask(writer)), asyncio.create_task(self._hear(reader))
        telling = asyncio.create_task(self._tell())
        writer.write(protocol.make_notification(NAMES, {"name": self._name}))  # nobody answers that
        try:
            done, _ = await asyncio.wait([asking, hearing, telling], return_when=asyncio.FIRST_COMPLETED)
        finally:
            writer.close()
            await _cancel([asking, hearing, *self._own])
            self._outbox.end()
            await asyncio.wait([telling], timeout=FLUSH_S)  # not cancelled while aiohttp compresses in a thread
            await _cancel([telling])
        ending = next((way.result() for way in (asking, hearing) if way in done and way.result()), None)
        if ending is not None:
            await hang_up(self._page, *ending)
        LOGGER.info("a page of %s has gone; %d notifications came too fast for it", self._robot.name, self._outbox.lost)

    def _give_up(self, reason: str) -> None:
        """Hang up on a page that would not read a farewell."""
        LOGGER.warning("a page of %s is hung up on: %s", self._robot.name, reason)
        self._transport.abort()

    # -- from the page ------------------------------------------------------------------------------------------------

    async def _ask(self, daemon: asyncio.StreamWriter) -> Ending | None:
        """Carry requests to the daemon."""
        async for message in self._page:
            try:
                line = self._taken(message)
            except UsageError as error:
                self._malformed += 1
                self._answer(None, error, protocol.INVALID_REQUEST)
                line = b""
            if self._malformed >= MAX_MALFORMED:
                return POLICY, "this page sends nonsense"
            if self._outbox.overfull:
                self._give_up("it does not read its answers")
                return None
            daemon.write(line)
            try:
                await daemon.drain()
            except ConnectionError:
                return self._gone()
            await asyncio.sleep(0)  # other pages get their turn, too
        return None

    def _taken(self, message: WSMessage) -> bytes:
        """The line that goes to the daemon for a message: none for what the station answers itself.

        Raises:
            UsageError: the message is no request.
        """
        request = parse_request(message.data if message.type is WSMsgType.TEXT else "")
        request_id, name = request.get("id"), request["method"]
        self._lateness.look(request.pop(SENT, None), asyncio.get_running_loop().time())
        refused = refusal(name, self._limit) or self._lateness.refusal(name)
        if name == NAMES:
            refused = PermissionRefused("the station names its pages", remedy="leave client.name out")
        if refused is not None:
            self._answer(request_id, refused)
        elif name.startswith(PREFIX):
            self._begin(request_id, name, request.get("params", {}))
        else:
            return make_line(request)
        return b""

    # -- methods of the station itself --------------------------------------------------------------------------------

    def _begin(self, request: int | str | None, name: str, params: dict[str, Any]) -> None:
        try:
            method, function = self._own_method(name)
            checked = validate(method, params)
        except CanhelmError as error:
            self._answer(request, error, error.rpc_code if name in METHODS else protocol.METHOD_NOT_FOUND)
            return
        task = asyncio.create_task(self._carry_out(request, method, function, checked))
        self._own.add(task)
        task.add_done_callback(self._own.discard)

    def _own_method(self, name: str) -> tuple[Method, Function]:
        if name not in METHODS:
            raise UsageError(f"no method {name[:80]!r}", remedy=f"the station has {', '.join(METHODS)}")
        if len(self._own) >= MAX_PENDING:
            raise Refused("too many requests under way", limit=MAX_PENDING, remedy="wait for answers")
        return METHODS[name]

    async def _carry_out(
        self, request: int | str | None, method: Method, function: Function, params: dict[str, Any]
    ) -> None:
        try:
            result = await function(self._robot, params)
        except CanhelmError as error:
            self._answer(request, error)
        except Exception:
            LOGGER.exception("%s failed", method.name)
            defect = CanhelmError(f"{method.name} failed inside the station", remedy="report it with the station's log")
            self._answer(request, defect, protocol.INTERNAL_ERROR)
        else:
            self._outbox.put(protocol.make_result(request, result))

    def _answer(self, request: int | str | None, error: CanhelmError, code: int | None = None) -> None:
        self._outbox.put(protocol.make_error(request, code or error.rpc_code, error.message, error.data()))

    # -- to the page --------------------------------------------------------------------------------------------------

    async def _hear(self, daemon: asyncio.StreamReader) -> Ending | None:
        """Take what the daemon says."""
        farewell = ""
        try:
            while line := await daemon.readline():
                farewell = _farewell(line)
                self._outbox.put(line)
                if self._outbox.overfull:
                    self._give_up("it does not read its answers")
                    return None
        except (OSError, ValueError):
            pass  # a broken pipe and an endless line end the connection like a hang-up
        return self._gone(farewell)

    async def _tell(self) -> None:
        """Carry that to the page."""
        while line := await self._outbox.get():
            try:
                async with asyncio.timeout(STALLED_S):
                    await self._page.send_frame(lowered(line, self._limit).rstrip(), WSMsgType.TEXT)
            except TimeoutError:
                self._give_up("it stopped reading")
                return
            except ConnectionError:
                return

    def _gone(self, farewell: str = "") -> Ending:
        if farewell:
            return NO_DAEMON, farewell
        told = f"the daemon of {self._robot.name} hung up"
        self._answer(None, DaemonNotRunning(told, remedy=protocol.how_to_start(self._robot.socket)))
        return NO_DAEMON, told


async def turn_away(page: web.WebSocketResponse, error: CanhelmError) -> None:
    """Tell a page why it gets no daemon and what to do, for which the reason of a farewell has no room; hang up."""
    line = protocol.make_error(None, error.rpc_code, error.message, error.data())
    await page.send_str(line.decode().rstrip())
    await hang_up(page, NO_DAEMON, error.message)


async def hang_up(page: web.WebSocketResponse, code: int, reason: str) -> None:
    """Close a WebSocket with a code and as much of a reason as fits."""
    await page.close(code=code, message=reason.encode()[:_REASON_BYTES].decode(errors="ignore").encode())


def _farewell(line: bytes) -> str:
    """What a daemon says before it hangs up; empty for other messages."""
    if not line.startswith(_FAREWELL):
        return ""
    message = protocol.parse_message(line)
    return str(message["error"].get("message", "")) if isinstance(message, dict) else ""


async def _cancel(tasks: list[asyncio.Task[Any]]) -> None:
    for task in tasks:
        task.cancel()
    await asyncio.gather(*tasks, return_exceptions=True)
