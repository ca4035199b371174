"""A server over a backend that is none, and clients of it."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from pathlib import Path

import pytest
import pytest_asyncio

from daemon.api.server import Server
from vcan_tests.daemon.api.raw_client import Connect, RawClient
from vcan_tests.daemon.fake_backend import FakeBackend


@pytest.fixture
def backend() -> FakeBackend:
    return FakeBackend()


@pytest_asyncio.fixture
async def server(backend: FakeBackend, tmp_path: Path) -> AsyncIterator[Server]:
    server = Server(backend, tmp_path / "robot.sock")
    await server.start()
    yield server
    await server.close()


@pytest_asyncio.fixture
async def connect() -> AsyncIterator[Connect]:
    """Opens connections, and closes them at the end."""
    opened: list[RawClient] = []

    async def connect(server: Server) -> RawClient:
        opened.append(RawClient(*await asyncio.open_unix_connection(server.path, limit=1 << 22)))
        return opened[-1]

    yield connect
    for client in opened:
        await client.close()


@pytest_asyncio.fixture
async def client(server: Server, connect: Connect) -> RawClient:
    return await connect(server)
