"""The Debian package: put on, exchanged under a moving robot, and taken away again."""

from __future__ import annotations

import json
import pwd
from pathlib import Path

import pytest

import canhelm
from vcan_tests.systemd.bench import PACKAGE, SERVICE, Journal, Robot, tell, told

pytestmark = [pytest.mark.systemd, pytest.mark.timeout(300)]
NEWER = "9.0.0"
PERSONS = (Path("/etc/canhelm/robots/lab1.yaml"), Path("/etc/canhelm/lab1.env"))
"""Files that somebody has written."""


def write_a_persons_files() -> None:
    for file in PERSONS:
        file.write_text("# by a person\n")


def persons_files_are_kept() -> bool:
    return all(file.read_text() == "# by a person\n" for file in PERSONS)


def program_is_there() -> bool:
    return Path("/opt/canhelm").exists()


@pytest.fixture(scope="module")
def newer(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The package of a version to come."""
    folder = tmp_path_factory.mktemp("newer")
    tree = folder / "tree"
    told("dpkg-deb", "--raw-extract", str(PACKAGE), str(tree))
    control = tree / "DEBIAN/control"
    control.write_text(control.read_text().replace(f"Version: {canhelm.__version__}", f"Version: {NEWER}"))
    (module,) = tree.glob("opt/canhelm/lib/python3.*/site-packages/canhelm/__init__.py")
    module.write_text(module.read_text().replace(canhelm.__version__, NEWER))
    told("dpkg-deb", "-Znone", "--build", str(tree), str(folder / "newer.deb"))
    return folder / "newer.deb"


def test_after_installing_everything_is_there_and_nothing_runs(dark_robot: Robot) -> None:
    assert json.loads(told("canhelm", "version"))["canhelm"] == canhelm.__version__
    assert told("dpkg", "--verify", "canhelm") == ""
    assert pwd.getpwnam("canhelm").pw_dir == "/var/lib/canhelm"
    assert tell("systemctl", "is-enabled", SERVICE).stdout.strip() == "disabled"
    assert told("systemctl", "list-units", "--plain", "--no-legend", "canhelm@*.service") == ""


async def test_an_upgrade_lets_a_moving_robot_move_until_somebody_restarts_it(robot: Robot, newer: Path) -> None:
    write_a_persons_files()
    await robot.drive()
    pid = robot.pid
    upgraded = told("dpkg", "--install", str(newer))
    assert f"{SERVICE} goes on with the version before" in upgraded
    assert robot.pid == pid
    assert robot.speed_m_s() > 0.2, robot.show("StatusText")
    assert robot.call("hello")["version"] == canhelm.__version__
    assert persons_files_are_kept()
    told("systemctl", "restart", SERVICE)
    await robot.until_state("idle")
    assert robot.call("hello")["version"] == NEWER


async def test_removing_stops_the_robot_in_order_and_keeps_what_is_a_persons(robot: Robot) -> None:
    write_a_persons_files()
    await robot.drive()
    journal = Journal()
    told("dpkg", "--remove", "canhelm")
    await journal.has("the vehicle is at rest and its drives are off")
    assert (robot.powered(), robot.released()) == ([], [])
    assert tell("systemctl", "cat", SERVICE).returncode != 0
    assert not program_is_there()
    assert persons_files_are_kept()


def test_purging_takes_state_and_logs_but_no_profile(dark_robot: Robot) -> None:
    write_a_persons_files()
    Path("/var/lib/canhelm/lab1").mkdir(parents=True, exist_ok=True)
    told("dpkg", "--purge", "canhelm")
    assert not Path("/var/lib/canhelm").exists()
    assert not Path("/etc/canhelm/canhelm.env").exists()
    assert persons_files_are_kept()
