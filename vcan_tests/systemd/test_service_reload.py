"""What `systemctl reload` does: a good profile is taken over, a bad one and a moving robot are not."""

from __future__ import annotations

import pytest

from canhelm.errors import LimitExceeded
from vcan_tests.systemd.bench import PATIENT, PROFILE, SERVICE, Journal, Robot, tell, told, until

pytestmark = [pytest.mark.systemd, pytest.mark.timeout(240)]


def drive_at(robot: Robot, speed_m_s: float) -> None:
    """Drive for a moment. Raises LimitExceeded."""
    robot.call("drive.parallel", angle_deg=0.0, speed_m_s=speed_m_s, duration_s=0.2)


async def test_a_good_profile_is_taken_over_by_the_same_process(robot: Robot) -> None:
    pid = robot.pid
    drive_at(robot, 0.3)
    PROFILE.write_text(PATIENT + "limits: {speed_m_s: 0.2}\n")
    told("systemctl", "reload", SERVICE)
    await robot.until_state("idle")
    with pytest.raises(LimitExceeded, match=r"0\.2 m/s"):
        drive_at(robot, 0.3)
    assert robot.pid == pid


async def test_a_profile_with_a_mistake_fails_the_reload_and_the_one_before_stays(robot: Robot) -> None:
    PROFILE.write_text(PATIENT + "limits: {speed_m_s: fast}\n")
    journal = Journal()
    assert tell("systemctl", "reload", SERVICE).returncode != 0
    await until(lambda: "reload refused" in robot.show("StatusText"))
    assert "max2d.yaml:4: limits.speed_m_s" in robot.show("StatusText")
    await journal.has("max2d.yaml:4: limits.speed_m_s", "--priority=err")
    drive_at(robot, 0.3)


async def test_a_robot_that_moves_goes_on_moving_with_its_profile(robot: Robot) -> None:
    await robot.drive(0.3)
    journal = Journal()
    PROFILE.write_text(PATIENT + "limits: {speed_m_s: 0.2}\n")
    tell("systemctl", "reload", SERVICE)
    await until(lambda: "reload refused" in robot.show("StatusText"))
    reason = "reload refused: the vehicle's state is active"
    assert reason in robot.show("StatusText")
    await journal.has(reason, "--priority=err")
    assert robot.speed_m_s() > 0.2
