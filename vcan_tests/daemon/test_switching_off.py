"""A whole simulated MAX2D whose drives are to be switched off, and what may keep them from it."""

from __future__ import annotations

import asyncio
import math

import pytest

from daemon.runtime.rest import AT_REST_CYCLES, AT_REST_M_S, RestWatch
from daemon.runtime.stopping import OVERRUN_S
from vcan_tests.robot import Robot, running_robot


def _powered(robot: Robot) -> list[str]:
    return [name for name, drive in robot.network.drives.items() if drive.motion.powered]


@pytest.mark.parametrize("moment_s", [0.0, 0.004, 0.008, 0.012, 0.016])
async def test_a_stop_while_drives_are_switched_off_leaves_none_with_power(moment_s: float) -> None:
    async with running_robot() as robot:
        driving = robot.begin("drive.parallel", angle_deg=0.0, speed_m_s=0.1, duration_s=0.2)
        await robot.until(lambda: robot.speed_m_s > 0.09)
        await robot.until(lambda: robot.app.supervisor.motions["1"].ended.done())
        await asyncio.sleep(AT_REST_CYCLES * 0.01 + moment_s)
        await robot.call("stop")
        await driving
        await asyncio.sleep(0.5)
        assert _powered(robot) == []


@pytest.mark.parametrize("later_s", [0.0, 0.003, 0.006, 0.009, 0.02, 0.03])
async def test_a_stop_has_ended_when_the_wheels_have_settled_without_their_torque(later_s: float) -> None:
    async with running_robot() as robot:
        driving = robot.begin("drive.parallel", angle_deg=0.0, speed_m_s=0.4, duration_s=5.0)
        await robot.until(lambda: robot.speed_m_s > 0.38)
        await asyncio.sleep(later_s)
        await robot.call("stop")
        assert max(abs(drive.speed_m_s) for drive in robot.app.devices.drives.values()) < AT_REST_M_S
        await asyncio.sleep(0.01)
        assert max(abs(drive.speed_m_s) for drive in robot.app.devices.drives.values()) < AT_REST_M_S
        await driving


async def test_a_drive_that_hears_nothing_does_not_push_on_alone_when_the_others_are_off() -> None:
    async with running_robot(expect_errors=True) as robot:
        driving = robot.begin("drive.parallel", angle_deg=0.0, speed_m_s=0.3, duration_s=0.5)
        await robot.until(lambda: robot.speed_m_s > 0.28)
        await robot.call("simulation.fault", kind="lose", cob_id=0x203)
        await robot.until(lambda: robot.speed_m_s < 0.01)
        begin = robot.network.world.pose[:2]
        await driving
        await asyncio.sleep(2.0)
        assert math.dist(begin, robot.network.world.pose[:2]) < 0.02
        assert _powered(robot) == []


@pytest.mark.parametrize("deaf_at", ["0x6041", "0x6040", "0x100D", "0x100C"])
async def test_a_turning_drive_that_is_configured_again_and_does_not_answer_stops_by_life_guarding(
    deaf_at: str,
) -> None:
    async with running_robot(expect_errors=True) as robot:
        driving = robot.begin("drive.parallel", angle_deg=0.0, speed_m_s=0.3, duration_s=5.0)
        await robot.until(lambda: robot.speed_m_s > 0.28)
        await robot.call("simulation.fault", kind="sdo_timeout", part="front_left", object=deaf_at)
        await robot.call("simulation.fault", kind="lose", cob_id=0x703)
        await robot.until(lambda: robot.state == "fault", 0.5)
        await asyncio.sleep(1.0)
        assert robot.fastest_wheel_m_s < 0.01
        assert not robot.network.drives["front_left"].motion.powered
        await driving


async def test_a_wheel_that_does_not_brake_is_switched_off_soon_after_its_ramp_should_be_over() -> None:
    async with running_robot(expect_errors=True) as robot:
        driving = robot.begin("drive.parallel", angle_deg=0.0, speed_m_s=0.3, duration_s=5.0)
        await robot.until(lambda: robot.speed_m_s > 0.28)
        await robot.call("simulation.fault", kind="encoder_reversed", part="front_left")
        await robot.until(lambda: robot.state == "fault")
        ramp_s = 0.3 / min(drive.quick_stop_m_s2 for drive in robot.app.profile.drives.values())
        await asyncio.sleep(ramp_s + OVERRUN_S + 0.1)
        assert _powered(robot) == []
        await driving


async def test_a_stop_that_too_few_cycles_have_watched_tells_so_and_names_no_wheel(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    async with running_robot(expect_errors=True) as robot:
        monkeypatch.setattr(RestWatch, "look", lambda *_: None)
        await robot.call("stop")
        told = [event["message"] for event in robot.app.supervisor.log.events]
        assert told[-1] == "slow now, but not seen at rest for long enough in the time that the ramp needs"


async def test_a_stop_on_which_a_wheel_goes_on_turning_names_the_wheel() -> None:
    async with running_robot(expect_errors=True) as robot:
        driving = robot.begin("drive.parallel", angle_deg=0.0, speed_m_s=0.3, duration_s=5.0)
        await robot.until(lambda: robot.speed_m_s > 0.28)
        await robot.call("simulation.fault", kind="encoder_reversed", part="front_left")
        await driving
        told = [event["message"] for event in robot.app.supervisor.log.events]
        assert "not at rest in the time that the ramp needs: front_left" in told
