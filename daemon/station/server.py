"""The station's server: the page, who may use it, and a WebSocket for each page and robot."""

from __future__ import annotations

import asyncio
import errno
import logging
import os
import re
import socket
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any, Final

from aiohttp import web
from aiohttp.http import HttpProcessingError

from canhelm import __version__, protocol
from canhelm.errors import CanhelmError, ConfigError, DaemonNotRunning, PermissionRefused, Refused, UsageError
from daemon.api.parameters import Role
from daemon.api.tokens import Tokens
from daemon.station import runs
from daemon.station.guard import EVERYWHERE, Guard, own_address, say_what_is_allowed
from daemon.station.link import Link, hang_up, turn_away
from daemon.station.robots import Robot, Robots
from daemon.station.sessions import Sessions

LOGGER: Final = logging.getLogger("canhelm.station")
GOING_AWAY: Final = 1001
"""Code of a WebSocket whose server goes down (RFC 6455, 7.4.1)."""
PAGE: Final = Path(__file__).with_name("page")
MAX_BODY_BYTES: Final = 4096
HEARTBEAT_S: Final = 4.0
"""A page that answers no ping within half of this is gone; its robot comes to rest by the lease before."""
FAREWELL_S: Final = 1.0
"""How long a page may take to answer a farewell."""
CONNECT_S: Final = 2.0
"""How long a daemon may take to accept a connection."""
_STATUS_CODES: Final = {UsageError: 404, DaemonNotRunning: 404, PermissionRefused: 403, Refused: 409, ConfigError: 409}
_PAGE_NUMBER: Final = re.compile("[1-9][0-9]{2}")

Handler = Callable[[web.Request], Awaitable[web.StreamResponse]]


class Station:
    """The control station.

    Args:
        robots: that it offers.
        tokens: that it asks for; None: for none.
        host: address to listen on.
        port: to listen on; 0 for any free one.
    """

    def __init__(self, robots: Robots, tokens: Tokens | None, host: str, port: int) -> None:
        self.host, self.port = host, port
        self._robots = robots
        self._sessions = Sessions(tokens)
        self._guard = Guard(host)
        self._pages: dict[web.WebSocketResponse, str | None] = {}
        self._files = {path.name for path in PAGE.iterdir() if path.is_file()}
        self._runner = web.AppRunner(self._app(), access_log=None, logger=_defects(), shutdown_timeout=FAREWELL_S)

    @property
    def url(self) -> str:
        """The address of the page; of all addresses of this machine the one that others most likely reach it by."""
        host = own_address() if self.host in EVERYWHERE else self.host
        return f"http://{f'[{host}]' if ':' in host else host}:{self.port}/"

    async def start(self) -> None:
        """Listen. Raises ConfigError where that is not possible."""
        await self._runner.setup()
        try:
            await web.TCPSite(self._runner, self.host, self.port).start()
        except (OSError, OverflowError) as error:
            await self._runner.cleanup()
            message = f"the control station cannot listen on {self.host} port {self.port}: {_reason(error)}"
            raise ConfigError(message, remedy=_cure(error)) from None
        self.port = self._runner.addresses[0][1]

    async def close(self) -> None:
        """Listen no more, and hang up on every page."""
        await self._runner.cleanup()

    def _app(self) -> web.Application:
        app = web.Application(middlewares=[self._check], client_max_size=MAX_BODY_BYTES)
        app.on_response_prepare.append(say_what_is_allowed)
        app.on_shutdown.append(self._hang_up_on_all)
        app.add_routes(
            [
                web.get("/", self._page),
                web.get("/page/{file}", self._file),
                web.get("/session", self._session),
                web.post("/login", self._log_in),
                web.post("/logout", self._log_out),
                web.get("/robots", self._list_robots),
                web.get("/ws/{robot}", self._connect),
                web.get("/runs/{robot}/{run}/plot", self._run_plot),
                web.get("/runs/{robot}/{run}/{file}", self._run_file),
            ]
        )
        return app

    @web.middleware
    async def _check(self, request: web.Request, handler: Handler) -> web.StreamResponse:
        """Look at no request of a foreign page, and tell what goes wrong with the others."""
        refusal = self._guard.refusal(request)
        if refusal is not None:
            return _told(refusal, 403)
        try:
            return await handler(request)
        except CanhelmError as error:
            code = next((code for kind, code in _STATUS_CODES.items() if isinstance(error, kind)), 500)
            return _told(error, code)
        except web.HTTPError as error:
            return _told(UsageError(f"{request.path[:80]}: {error.reason}"), error.status)
        except ConnectionError:  # it hung up before it was answered
            return web.Response(status=400)

    # -- the page -----------------------------------------------------------------------------------------------------

    async def _page(self, request: web.Request) -> web.StreamResponse:
        return web.FileResponse(PAGE / "index.html")

    async def _file(self, request: web.Request) -> web.StreamResponse:
        name = request.match_info["file"]
        if name not in self._files:
            raise web.HTTPNotFound
        return web.FileResponse(PAGE / name)

    # -- who is there -------------------------------------------------------------------------------------------------

    @property
    def _cookie(self) -> str:
        """Name of the session's cookie: browsers send the cookies of one port to every other one, too."""
        return f"canhelm_{self.port}"

    def _role(self, request: web.Request) -> Role:
        """What the person behind a request may do. Raises PermissionRefused where that is nothing."""
        role = self._sessions.role_of(request.cookies.get(self._cookie))
        if role is None:
            raise PermissionRefused("this station wants a token", remedy="log in on its page")
        return role

    async def _session(self, request: web.Request) -> web.StreamResponse:
        role = self._sessions.role_of(request.cookies.get(self._cookie))
        told = {"login_needed": self._sessions.needed, "role": role and role.value, "version": __version__}
        return web.json_response(told)

    async def _log_in(self, request: web.Request) -> web.StreamResponse:
        body = protocol.parse_message(await request.read())
        token = body.get("token") if isinstance(body, dict) else None
        if not isinstance(token, str):
            return _told(UsageError("a login needs a token", remedy='send {"token": "..."}'), 400)
        session = await self._sessions.begin(token.strip(), request.remote or "an unknown address")
        answer = web.json_response({"role": self._sessions.role_of(session)})
        answer.set_cookie(self._cookie, session, httponly=True, samesite="Strict")
        return answer

    async def _log_out(self, request: web.Request) -> web.StreamResponse:
        session = request.cookies.get(self._cookie)
        self._sessions.end(session)
        await self._hang_up([page for page, whose in self._pages.items() if session and whose == session], "logged out")
        answer = web.json_response({})
        answer.del_cookie(self._cookie, httponly=True, samesite="Strict")
        return answer

    # -- robots -------------------------------------------------------------------------------------------------------

    async def _list_robots(self, request: web.Request) -> web.StreamResponse:
        self._role(request)
        return web.json_response({"robots": await self._robots.told()})

    async def _connect(self, request: web.Request) -> web.StreamResponse:
        role = self._role(request)
        page = web.WebSocketResponse(
            timeout=FAREWELL_S,
            heartbeat=HEARTBEAT_S,
            max_msg_size=protocol.MAX_REQUEST_BYTES,
            writer_limit=0,
        )
        await page.prepare(request)
        self._pages[page] = request.cookies.get(self._cookie)
        try:
            await self._link(page, request, role)
        finally:
            del self._pages[page]
        return page

    async def _link(self, page: web.WebSocketResponse, request: web.Request, role: Role) -> None:
        try:
            robot = self._robots.find(request.match_info["robot"])
            connection = await asyncio.to_thread(protocol.open_socket, robot.socket, CONNECT_S)
        except CanhelmError as error:
            await turn_away(page, error)
            return
        transport = request.transport
        if transport is None:
            connection.close()
            return
        name = _page_name(request)
        LOGGER.info("%s is connected to %s with the role %s", name, robot.name, role)
        await Link(page, transport, robot, role, name).run(connection)

    # -- runs ---------------------------------------------------------------------------------------------------------

    async def _run_file(self, request: web.Request) -> web.StreamResponse:
        path = await runs.run_file(*self._run(request), request.match_info["file"])
        return web.FileResponse(path, headers={"Content-Disposition": "attachment"})

    async def _run_plot(self, request: web.Request) -> web.StreamResponse:
        return web.Response(body=await runs.draw(*self._run(request)), content_type="image/png")

    def _run(self, request: web.Request) -> tuple[Robot, str]:
        self._role(request)
        return self._robots.find(request.match_info["robot"]), request.match_info["run"]

    # -- the end ------------------------------------------------------------------------------------------------------

    async def _hang_up_on_all(self, app: web.Application) -> None:
        await self._hang_up(list(self._pages), "the station ends")

    async def _hang_up(self, pages: list[web.WebSocketResponse], reason: str) -> None:
        await asyncio.gather(*(hang_up(page, GOING_AWAY, reason) for page in pages), return_exceptions=True)


def _defects() -> logging.Logger:
    """What aiohttp's server tells its errors to: those of strangers who speak no HTTP, or hang up, are none of ours."""
    logger = LOGGER.getChild("http")
    logger.addFilter(_is_ours)
    return logger


def _is_ours(record: logging.LogRecord) -> bool:
    return not isinstance(record.exc_info[1] if record.exc_info else None, HttpProcessingError | ConnectionError)


def _page_name(request: web.Request) -> str:
    """What people call a page: by the number that it has drawn, which outlives its connections, and its address."""
    number = request.query.get("page", "")
    which = f"page {number}" if _PAGE_NUMBER.fullmatch(number) else "a page"
    return f"{which} at {request.remote or 'an unknown address'}"


def _reason(error: OSError | OverflowError) -> str:
    """Without the address, which asyncio puts into the text of its errors."""
    number = getattr(error, "errno", None) or 0
    return os.strerror(number) if number > 0 else getattr(error, "strerror", None) or str(error)


def _cure(error: OSError | OverflowError) -> str:
    number = getattr(error, "errno", None)
    if isinstance(error, socket.gaierror) or number == errno.EADDRNOTAVAIL:
        return "give --host an address of this machine (`ip address` lists them), or leave it out"
    if number == errno.EACCES:
        return "choose a port from 1024 on with --port"
    return "choose another port with --port, or end what listens there"


def _told(error: CanhelmError, status: int) -> web.Response:
    told: dict[str, Any] = {"message": error.message, "remedy": error.remedy}
    return web.json_response(told, status=status)
