"""Both clients against a server in a thread."""

from __future__ import annotations

import asyncio
import os
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import aclosing
from pathlib import Path

import pytest

from canhelm import aio, protocol
from canhelm.client import Client
from canhelm.errors import DaemonNotRunning, NodeAbsent, PermissionRefused, Refused, Timeout, UsageError
from daemon.api.server import Server
from vcan_tests.daemon.fake_backend import FakeBackend, served

STEER = """
import sys
from canhelm.client import Client
Client(sys.argv[1]).call("steer", pair="front", angle_deg=5)
"""


@pytest.fixture
def backend() -> FakeBackend:
    return FakeBackend(lease_timeout_s=0.5)


@pytest.fixture
def server(backend: FakeBackend, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Server]:
    monkeypatch.setattr(protocol, "RENEW_PERIOD_S", 0.1)
    with served(backend, tmp_path / "robot.sock") as server:
        yield server


def dismiss_everybody(server: Server, backend: FakeBackend) -> None:
    """As the server does with idle clients where there are too many."""

    def dismiss() -> None:
        for connection in list(server.connections):
            connection.dismiss()

    backend.loop.call_soon_threadsafe(dismiss)


@pytest.fixture
def silent(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A socket on which somebody listens and never says a word."""
    monkeypatch.setattr(protocol, "RENEW_PERIOD_S", 0.01)
    path = tmp_path / "silent.sock"
    with socket.socket(socket.AF_UNIX) as listener:
        listener.bind(os.fspath(path))
        listener.listen()
        yield path


def test_a_call_returns_the_result(server: Server) -> None:
    with Client(server.path) as client:
        assert client.status()["robot"] == "fake"


def test_an_error_is_raised_as_its_class(server: Server) -> None:
    with Client(server.path) as client, pytest.raises(NodeAbsent, match="node 7"):
        client.call("motor.enable", node=7)


def test_parameters_that_are_none_are_left_out(server: Server, backend: FakeBackend) -> None:
    with Client(server.path) as client:
        client.call("motor.velocity", node=1, velocity_rpm=1, duration_s=0.01, wheel_speed_m_s=None)
    assert backend.calls[0][1]["wheel_speed_m_s"] is None


def test_a_waiting_client_renews_its_lease(server: Server, backend: FakeBackend) -> None:
    with Client(server.path) as client:
        client.call("motor.velocity", node=1, velocity_rpm=1, duration_s=0.8)
    assert backend.renewals >= 4


def test_a_waiting_client_renews_although_samples_keep_coming(server: Server, backend: FakeBackend) -> None:
    samples: list[str] = []
    with Client(server.path) as client:
        client.on_notification = lambda method, params: samples.append(method)
        client.call("subscribe", rate_hz=50)
        client.call("motor.velocity", node=1, velocity_rpm=1, duration_s=0.8)
    assert len(samples) > 10
    assert not backend.stopped


def test_an_idle_client_does_not_renew(server: Server, backend: FakeBackend) -> None:
    with Client(server.path) as client:
        client.call("drive.set", direction_deg=0, speed_m_s=0.1)
        client.call("drive.set", direction_deg=0, speed_m_s=0.1)
    assert backend.renewals == 1


def test_notifications_come_at_the_chosen_rate(server: Server) -> None:
    with Client(server.path) as client:
        samples = client.notifications(rate_hz=50)
        assert [next(samples)[0] for _ in range(3)] == ["status"] * 3


def test_a_daemon_that_is_not_there_is_told_from_one_that_is_closed_to_us(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with pytest.raises(DaemonNotRunning):
        Client(tmp_path / "nobody.sock")

    def denied(self: socket.socket, address: str) -> None:
        raise PermissionError

    monkeypatch.setattr(socket.socket, "connect", denied)
    with pytest.raises(PermissionRefused, match="may not open"):
        Client(tmp_path / "closed.sock")


def test_a_daemon_that_goes_away_ends_the_call(backend: FakeBackend, tmp_path: Path) -> None:
    with served(backend, tmp_path / "s") as server:
        client = Client(server.path)
        client.status()
    with client, pytest.raises(DaemonNotRunning, match="hung up"):
        client.status()


def test_a_daemon_that_says_nothing_is_given_up(silent: Path) -> None:
    with Client(silent) as client, pytest.raises(Timeout, match="does not answer"):
        client.status()


def test_a_process_that_dies_leaves_no_motion(server: Server, backend: FakeBackend) -> None:
    with subprocess.Popen([sys.executable, "-c", STEER, server.path]) as process:
        assert backend.called.wait(10)
        process.kill()
    with Client(server.path) as other:
        other.stop()
    assert backend.stopped == ["lease-1"]
    assert not backend.ran_out.is_set()


def test_a_process_that_is_suspended_loses_its_motion(server: Server, backend: FakeBackend) -> None:
    with subprocess.Popen([sys.executable, "-c", STEER, server.path], stderr=subprocess.PIPE, text=True) as process:
        assert backend.called.wait(10)
        process.send_signal(signal.SIGSTOP)
        assert backend.ran_out.wait(5)
        process.send_signal(signal.SIGCONT)
        _, told = process.communicate(timeout=10)
    assert "canhelm.errors.Refused: the motion was stopped" in told


def test_the_client_package_needs_the_standard_library_alone() -> None:
    code = "import sys, canhelm.client, canhelm.aio; print(*{name.split('.')[0] for name in sys.modules})"
    loaded = subprocess.run(
        [sys.executable, "-S", "-c", code], capture_output=True, text=True, check=True
    ).stdout.split()
    assert set(loaded) - set(sys.stdlib_module_names) <= {"canhelm", "__main__", "__mp_main__"}


# -- asyncio ----------------------------------------------------------------------------------------------------------


@pytest.mark.real_time
async def test_calls_of_the_asyncio_client_overlap(server: Server) -> None:
    async with aio.Client(server.path) as client:
        moving = asyncio.create_task(client.call("motor.velocity", node=1, velocity_rpm=1, duration_s=0.2))
        await asyncio.sleep(0)
        assert (await client.call("status"))["robot"] == "fake"
        assert not moving.done()
        await moving


@pytest.mark.real_time
async def test_the_asyncio_client_renews_while_a_call_waits(server: Server, backend: FakeBackend) -> None:
    async with aio.Client(server.path) as client:
        await client.call("motor.velocity", node=1, velocity_rpm=1, duration_s=0.8)
    assert backend.renewals >= 4


@pytest.mark.real_time
async def test_the_asyncio_client_raises_the_class_that_was_raised(server: Server) -> None:
    async with aio.Client(server.path) as client:
        with pytest.raises(UsageError):
            await client.call("motor.enable", node=200)


@pytest.mark.real_time
async def test_the_asyncio_client_yields_notifications(server: Server) -> None:
    async with aio.Client(server.path) as client, aclosing(client.notifications(rate_hz=50)) as notifications:
        async for method, params in notifications:
            assert (method, params["robot"]) == ("status", "fake")
            break


@pytest.mark.real_time
async def test_the_asyncio_client_gives_up_a_daemon_that_says_nothing(silent: Path) -> None:
    async with aio.Client(silent) as client:
        with pytest.raises(Timeout):
            await client.call("status")


@pytest.mark.real_time
async def test_the_asyncio_client_hears_of_a_daemon_that_goes_away(backend: FakeBackend, tmp_path: Path) -> None:
    with served(backend, tmp_path / "s") as server:
        client = aio.Client(server.path)
        await client.connect()
        moving = asyncio.create_task(client.call("motor.velocity", node=1, velocity_rpm=1))
        await asyncio.to_thread(backend.called.wait, 5)
    with pytest.raises(DaemonNotRunning):
        await moving
    await client.close()


@pytest.mark.real_time
async def test_the_asynchronous_client_has_the_same_shorthands(server: Server, backend: FakeBackend) -> None:
    async with aio.Client(server.path) as client:
        assert (await client.status())["robot"] == "fake"
        assert await client.stop() == {"state": "idle"}


def test_a_client_that_lost_its_place_is_told_why(server: Server, backend: FakeBackend) -> None:
    with Client(server.path) as client:
        client.status()
        dismiss_everybody(server, backend)
        with pytest.raises(Refused, match="too many clients"):
            client.call("motor.velocity", node=1, velocity_rpm=1)


@pytest.mark.real_time
async def test_an_asynchronous_client_that_lost_its_place_is_told_why(server: Server, backend: FakeBackend) -> None:
    async with aio.Client(server.path) as client:
        await client.status()
        dismiss_everybody(server, backend)
        await asyncio.sleep(0.05)  # a write before the farewell is read would end the connection without it
        with pytest.raises(Refused, match="too many clients"):
            await client.call("motor.velocity", node=1, velocity_rpm=1)


def test_a_socket_with_another_robot_behind_it_is_refused(server: Server) -> None:
    with Client(server.path, "fake") as client:
        assert client.call("hello")["robot"] == "fake"
    with pytest.raises(UsageError, match="is robot fake, not lab1"):
        Client(server.path, "lab1")


def test_a_socket_with_another_robot_behind_it_is_refused_on_asyncio_too(server: Server) -> None:
    async def robot_behind(name: str) -> str:
        async with aio.Client(server.path, name) as client:
            return str((await client.call("hello"))["robot"])

    assert asyncio.run(robot_behind("fake")) == "fake"
    with pytest.raises(UsageError, match="is robot fake, not lab1"):
        asyncio.run(robot_behind("lab1"))
