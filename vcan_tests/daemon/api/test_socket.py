"""The socket itself: its place and its rights, a dead daemon's and a live one's, and its end."""

from __future__ import annotations

import asyncio
import contextlib
import errno
import os
import socket
import stat
from pathlib import Path
from typing import Any

import pytest

from canhelm import protocol
from canhelm.errors import CanhelmError, ConfigError, PermissionRefused, Refused
from daemon.api import listeners
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


@pytest.mark.parametrize(
    ("reason", "kind"),
    [
        (errno.EACCES, PermissionRefused),
        (errno.EPERM, PermissionRefused),
        (errno.EROFS, ConfigError),
        (errno.ENOSPC, ConfigError),
        (errno.ENOENT, ConfigError),
    ],
)
@pytest.mark.parametrize("step", [(Path, "mkdir"), (listeners, "_bind")])
async def test_a_place_that_cannot_be_used_is_told_in_one_sentence_with_the_way_out(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, step: tuple[Any, str], reason: int, kind: type[CanhelmError]
) -> None:
    def refuse(*_: object, **__: object) -> None:
        raise OSError(reason, os.strerror(reason))

    path = tmp_path / "robot.sock"
    monkeypatch.setattr(*step, refuse)
    with pytest.raises(kind) as caught:
        await Server(FakeBackend(), path).start()
    assert caught.value.message == f"no socket can be opened at {path}: {os.strerror(reason)}"
    assert caught.value.remedy == "choose another place with --socket PATH"
    assert not path.exists()


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
