"""Which daemon a command asks: a socket or a robot that is named, or that of the environment."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from canhelm import protocol
from daemon.api.server import Server
from vcan_tests.daemon.cli.shell import run
from vcan_tests.daemon.fake_backend import FakeBackend, served


@pytest.fixture
def nearby(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[FakeBackend]:
    """Another robot, ``other``, whose daemon listens in the folder of sockets."""
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    monkeypatch.setattr(protocol, "SYSTEM_FOLDER", tmp_path / "no-system")
    (tmp_path / "canhelm").mkdir()
    other = FakeBackend()
    other.robot = "other"
    with served(other, tmp_path / "canhelm" / "other.sock"):
        yield other


@pytest.mark.real_time
def test_a_robot_that_is_named_goes_before_a_socket_in_the_environment(
    server: Server, backend: FakeBackend, nearby: FakeBackend
) -> None:
    assert run("estop --robot other") == 0
    assert ([call[0] for call in nearby.calls], backend.calls) == (["estop"], [])


@pytest.mark.real_time
def test_a_robot_that_does_not_run_is_no_reason_to_ask_another(
    server: Server, backend: FakeBackend, nearby: FakeBackend, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run("steer front 5 --robot third") == 3
    assert ("third.sock" in capsys.readouterr().err, backend.calls, nearby.calls) == (True, [], [])


@pytest.mark.real_time
def test_a_socket_that_is_named_goes_before_a_robot_in_the_environment(
    server: Server, backend: FakeBackend, nearby: FakeBackend, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("CANHELM_ROBOT", "other")
    assert run(f"stop --socket {server.path}") == 0
    assert ([call[0] for call in backend.calls], nearby.calls) == (["stop"], [])


@pytest.mark.real_time
def test_a_robot_that_is_not_the_one_behind_the_named_socket_is_refused(
    server: Server, backend: FakeBackend, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(f"motor velocity 1 100 --socket {server.path} --robot other") == 2
    assert "is robot fake, not other" in capsys.readouterr().err
    assert run(f"stop --socket {server.path} --robot fake") == 0
    assert [call[0] for call in backend.calls] == ["stop"]
