"""A station before a daemon that is none, and somebody who visits it."""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import AsyncExitStack
from pathlib import Path

import pytest
import pytest_asyncio
from aiohttp import ClientSession, CookieJar

from canhelm import protocol
from daemon.api.parameters import Role
from daemon.api.server import Server
from daemon.api.tokens import SHORTEST, Tokens
from daemon.station.robots import Robots
from daemon.station.server import Station
from vcan_tests.daemon.fake_backend import FakeBackend
from vcan_tests.daemon.station.visitor import Visit, Visitor

TOKENS = {role: role.value[0] * SHORTEST for role in (Role.WATCH, Role.DRIVE, Role.CONFIGURE)}


@pytest.fixture
def runtime_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Where daemons open their sockets."""
    monkeypatch.setattr(protocol, "SYSTEM_FOLDER", tmp_path / "nowhere")
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    folder = tmp_path / "canhelm"
    folder.mkdir()
    return folder


@pytest.fixture
def backend() -> FakeBackend:
    return FakeBackend()


@pytest_asyncio.fixture
async def daemon(backend: FakeBackend, runtime_folder: Path) -> AsyncIterator[Server]:
    server = Server(backend, runtime_folder / "fake.sock")
    await server.start()
    yield server
    await server.close()


@pytest_asyncio.fixture
async def visit(runtime_folder: Path) -> AsyncIterator[Visit]:
    async with AsyncExitStack() as ends:

        async def visit(*, guarded: bool = False) -> Visitor:
            tokens = Tokens({token: role for role, token in TOKENS.items()}) if guarded else None
            station = Station(Robots(), tokens, "127.0.0.1", 0)
            await station.start()
            ends.push_async_callback(station.close)
            session = await ends.enter_async_context(ClientSession(cookie_jar=CookieJar(unsafe=True)))
            return Visitor(session, station.url.rstrip("/"))

        yield visit


@pytest_asyncio.fixture
async def visitor(visit: Visit, daemon: Server) -> Visitor:
    """Somebody at a station that wants no tokens."""
    return await visit()


@pytest_asyncio.fixture
async def guest(visit: Visit, daemon: Server) -> Visitor:
    """Somebody at a station that wants tokens, without one."""
    return await visit(guarded=True)
