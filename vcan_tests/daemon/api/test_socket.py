"""The socket itself: its place and its rights, a dead daemon's and a live one's, and its end."""

from __future__ import annotations

import asyncio
import contextlib
import os
import socket
import stat
from pathlib import Path

import pytest

from canhelm import protocol
from canhelm.errors import ConfigError, Refused
from daemon.api.server import Server
from vcan_tests.daemon.api.raw_client import Connect, until
from vcan_tests.daemon.fake_backend import FakeBackend

pytestmark = pytest.mark.real_time


async def test_the_socket_is_for_owner_and_group_alone(server: Server) -> None:
    assert stat.S_IMODE(server.path.stat().st_mode) == 0o660


async def test_the_socket_of_a_dead_daemon_is_replaced(tmp_path: Path) -> None:
    path = tmp_path / "robot.sock"
    dead = socket.socket(socket.AF_UNIX)
    dead.bind(os.fspath(path))
    dead.close()
    server = Server(FakeBackend(), path)
    await server.start()
    await server.close()


async def test_the_socket_of_a_live_daemon_is_refused(server: Server) -> None:
    with pytest.raises(Refused, match="already answers"):
        await Server(FakeBackend(), server.path).start()


async def test_a_file_is_not_taken_for_a_socket(tmp_path: Path) -> None:
    (tmp_path / "robot.sock").write_text("precious")
    with pytest.raises(ConfigError, match="no socket"):
        await Server(FakeBackend(), tmp_path / "robot.sock").start()


async def test_a_path_that_is_too_long_is_refused_with_the_limit(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="107"):
        await Server(FakeBackend(), tmp_path / ("x" * 120)).start()


async def test_a_server_that_closes_takes_its_socket_away(tmp_path: Path) -> None:
    server = Server(FakeBackend(), tmp_path / "robot.sock")
    await server.start()
    await server.close()
    assert not server.path.exists()


async def test_a_server_that_closes_hangs_up_on_motions(server: Server, connect: Connect, backend: FakeBackend) -> None:
    client = await connect(server)
    client.send(protocol.make_request(1, "motor.velocity", {"node": 1, "velocity_rpm": 100}))
    await until(lambda: backend.calls)
    await server.close()
    assert await client.ended()


@pytest.mark.parametrize("turns", range(5))
async def test_a_connection_that_is_being_accepted_is_not_lost_by_closing(server: Server, turns: int) -> None:
    with socket.socket(socket.AF_UNIX) as late:
        late.connect(os.fspath(server.path))
        for _ in range(turns):
            await asyncio.sleep(0)
        await server.close()
        for _ in range(5):
            await asyncio.sleep(0)
        late.settimeout(1.0)
        with contextlib.suppress(ConnectionResetError):
            while late.recv(65536):
                pass
