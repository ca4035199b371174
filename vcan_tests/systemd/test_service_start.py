"""How the service comes up: by its unit or by its socket, with motor power before it, late, or never; and with whom."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Iterator

import pytest

from vcan_tests.systemd.bench import PROFILE, SERVICE, SETTINGS, SOCKET_UNIT, Journal, Robot, tell, told, until

pytestmark = [pytest.mark.systemd, pytest.mark.timeout(240)]
WAITS = "waiting for node {}: no boot-up; is motor power on?"


def test_systemctl_status_tells_in_one_line_how_the_robot_is(robot: Robot) -> None:
    assert 'Status: "idle"' in told("systemctl", "status", SERVICE)


async def test_it_is_ready_without_motor_power_and_connects_when_that_comes(dark_robot: Robot) -> None:
    told("systemctl", "start", SERVICE)
    sentence = WAITS.format("1 (rear_right)") + " (and 5 more)"
    await until(lambda: dark_robot.show("StatusText") == sentence)
    assert dark_robot.show("ActiveState") == "active"
    dark_robot.simulate()
    await dark_robot.until_state("idle")


async def test_a_drive_that_never_comes_is_named_wherever_somebody_looks(dark_robot: Robot) -> None:
    journal, sentence = Journal(), WAITS.format("3 (front_left)")
    dark_robot.simulate("--nodes", "1,2,4,5,6")
    told("systemctl", "start", SERVICE)
    await until(lambda: dark_robot.show("StatusText") == sentence)
    assert sentence in json.loads(told("canhelm", "status"))["message"]
    await journal.has(f"front_left: {sentence}")


async def test_it_waits_for_an_interface_that_comes_after_it(dark_robot: Robot, late_interface: str) -> None:
    SETTINGS.write_text(f"CANHELM_BUS=socketcan:{late_interface}\n")
    journal = Journal()
    told("systemctl", "start", SERVICE)
    await until(lambda: f"{late_interface} is down or missing" in dark_robot.show("StatusText"))
    await journal.has(f"{late_interface} is down or missing", "--priority=err")
    told("ip", "link", "add", late_interface, "type", "vcan")
    told("ip", "link", "set", late_interface, "up")
    await until(lambda: dark_robot.show("StatusText").startswith(WAITS.format("1 (rear_right)")))


@pytest.fixture
def late_interface() -> Iterator[str]:
    """Name of an interface that is not there yet."""
    yield "late0"
    tell("ip", "link", "delete", "late0")


def test_the_first_client_of_the_socket_starts_the_service_and_is_answered(dark_robot: Robot) -> None:
    told("systemctl", "start", SOCKET_UNIT)
    assert dark_robot.show("ActiveState") == "inactive"
    assert dark_robot.call("hello")["robot"] == "max2d"
    assert dark_robot.show("ActiveState") == "active"


async def test_an_invalid_profile_is_told_with_its_line_and_not_tried_again(dark_robot: Robot) -> None:
    PROFILE.write_text("schema_version: 1\nextends: robots/max2d\nlimits: {speed_m_s: fast}\n")
    journal = Journal()
    assert tell("systemctl", "start", SERVICE).returncode != 0
    assert dark_robot.show("ActiveState") == "failed"
    assert dark_robot.restarts == 0
    await journal.has("max2d.yaml:3: limits.speed_m_s", "--priority=err")


# -- who may do what --------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def people() -> Iterator[None]:
    """alice drives, carol configures, wanda watches, mallory is nobody here."""
    Robot().clear()
    members = {"alice": "canhelm", "carol": "canhelm-admin", "wanda": "canhelm-watch", "mallory": ""}
    for name, groups in members.items():
        told("useradd", "--no-create-home", "--groups", groups, name)
    yield
    for name in members:
        told("userdel", name)


def canhelm(user: str, *arguments: str) -> subprocess.CompletedProcess[str]:
    return tell("canhelm", *arguments, user=user)


@pytest.mark.usefixtures("people")
def test_a_member_of_the_group_drives(robot: Robot) -> None:
    driven = canhelm("alice", "drive", "parallel", "--angle", "0", "--speed", "0.2", "--duration", "0.5")
    assert (driven.returncode, driven.stderr) == (0, "")


@pytest.mark.usefixtures("people")
def test_a_member_of_the_group_does_not_configure_and_is_told_who_does(robot: Robot) -> None:
    refused = canhelm("alice", "sdo", "write", "1", "max_following_error", "1000")
    assert refused.returncode == 3
    assert "sudo usermod -aG canhelm-admin alice" in refused.stderr


@pytest.mark.usefixtures("people")
def test_an_administrator_configures(robot: Robot) -> None:
    assert canhelm("carol", "sdo", "write", "1", "max_following_error", "2000").returncode == 0


@pytest.mark.usefixtures("people")
def test_who_watches_sees_and_stops_the_robot_and_does_not_drive_it(robot: Robot) -> None:
    assert canhelm("wanda", "status").returncode == 0
    assert canhelm("wanda", "stop").returncode == 0
    refused = canhelm("wanda", "drive", "parallel", "--angle", "0", "--speed", "0.2", "--duration", "0.5")
    assert refused.returncode == 3
    assert "sudo usermod -aG canhelm wanda" in refused.stderr


@pytest.mark.usefixtures("people")
@pytest.mark.parametrize("command", ["status", "stop", "drive parallel --angle 0 --speed 0.2 --duration 1"])
def test_anybody_else_is_refused_and_told_the_way_in(robot: Robot, command: str) -> None:
    refused = canhelm("mallory", *command.split())
    assert (refused.returncode, refused.stdout) == (3, "")
    assert "this user may not open" in refused.stderr
    assert "sudo usermod -aG canhelm $USER" in refused.stderr
