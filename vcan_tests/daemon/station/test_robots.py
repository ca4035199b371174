"""Which robots a station offers."""

from __future__ import annotations

import socket
from contextlib import ExitStack
from pathlib import Path

import pytest

from canhelm import protocol
from canhelm.errors import DaemonNotRunning, UsageError
from daemon.station.robots import Robots

pytestmark = pytest.mark.real_time


def listener(path: Path) -> socket.socket:
    """A socket that answers to a connection."""
    opened = socket.socket(socket.AF_UNIX)
    opened.bind(str(path))
    opened.listen()
    return opened


async def test_every_robot_with_a_socket_is_offered_also_one_that_has_died(runtime_folder: Path) -> None:
    with ExitStack() as stack:
        for name in ("b", "c.309", "dead"):
            stack.enter_context(listener(runtime_folder / f"{name}.sock"))
        stack.pop_all().close()
        (runtime_folder / "b.sock").unlink()
        (runtime_folder / "file.sock").touch()
        stack.enter_context(listener(runtime_folder / "b.sock"))
        stack.enter_context(listener(runtime_folder / "a.sock"))
        told = await Robots().told()
    assert told == [{"name": name, "alive": alive} for name, alive in (("a", True), ("b", True), ("dead", False))]


async def test_robots_are_looked_for_anew(runtime_folder: Path) -> None:
    robots = Robots()
    before = await robots.told()
    with listener(runtime_folder / "late.sock"):
        after = await robots.told()
    assert (before, after) == ([], [{"name": "late", "alive": True}])


async def test_robots_that_are_named_are_offered_and_no_others(runtime_folder: Path) -> None:
    robots = Robots(["one", "two"])
    with listener(runtime_folder / "two.sock"), listener(runtime_folder / "three.sock"):
        told = await robots.told()
    assert told == [{"name": "one", "alive": False}, {"name": "two", "alive": True}]
    with pytest.raises(DaemonNotRunning, match="no robot three"):
        robots.find("three")


@pytest.mark.parametrize("name", ["", "..", "../x", "a/b", "\0"])
def test_what_is_no_name_is_refused(name: str) -> None:
    with pytest.raises(UsageError):
        Robots([name])


def test_a_persons_robot_keeps_its_files_with_the_person(runtime_folder: Path, tmp_path: Path) -> None:
    assert Robots().find("lab1").folder == tmp_path / "state" / "canhelm" / "lab1"


def test_a_service_keeps_its_files_where_services_do(runtime_folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(protocol, "SYSTEM_FOLDER", runtime_folder)
    (runtime_folder / "lab1.sock").touch()
    assert Robots().find("lab1").folder == Path("/var/lib/canhelm/lab1")
