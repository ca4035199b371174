"""An emergency stop contact at a digital input of a drive, over CAN and over a serial line."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

import msgspec
import pytest

from canhelm.errors import EmergencyStop, NodeAbsent
from drivers.epos.emergency_stop_input import STALE_S
from drivers.epos.objects import OBJECTS
from profiles.loader import load
from profiles.schema import EmergencyStopConfig, Profile
from vcan_tests.robot import Robot, running_robot

CYCLES = 3
"""Told in one, seen in the next, commanded in the one after it."""


def profile_with_button(drive: str = "front_left", pressed: str = "low") -> Profile:
    profile = load("max2d").profile
    button = msgspec.convert({"input": 1, "pressed": pressed}, EmergencyStopConfig)
    with_button = msgspec.structs.replace(profile.drives[drive], emergency_stop=button)
    return msgspec.structs.replace(profile, drives={**profile.drives, drive: with_button})


@asynccontextmanager
async def robot_with_button(drive: str = "front_left", bus: str = "simulated") -> AsyncIterator[Robot]:
    async with running_robot(profile=profile_with_button(drive), bus=bus, expect_errors=True) as robot:
        yield robot


@pytest.mark.parametrize(
    ("bus", "drive"), [("simulated", "front_left"), ("rs232", "front_left"), ("rs232", "rear_right")]
)
async def test_pressing_it_stops_a_robot_that_drives_and_latches(bus: str, drive: str) -> None:
    async with robot_with_button(drive, bus) as robot:
        driving = asyncio.create_task(robot.call("drive.parallel", angle_deg=0.0, speed_m_s=0.2, duration_s=9.0))
        await robot.until(lambda: robot.speed_m_s > 0.15)
        node = robot.app.devices.drives[drive].node
        await robot.call("simulation.input", node=node, input=1, level="low")
        seen_s = await robot.until(lambda: robot.state == "estop")
        assert seen_s <= CYCLES * robot.app.cycle.period_s
        await robot.until(lambda: robot.fastest_wheel_m_s < 0.01 and not robot.app.supervisor.anything_enabled)
        with pytest.raises(EmergencyStop):
            await driving
        assert "digital input 1, is pressed" in robot.app.service.status()["message"]


async def test_no_reset_helps_while_it_is_pressed_and_one_does_when_it_is_released() -> None:
    async with robot_with_button() as robot:
        await robot.call("simulation.input", node=3, input=1, level="low")
        await robot.until(lambda: robot.state == "estop")
        with pytest.raises(EmergencyStop, match=r"front_left.*pressed"):
            await robot.call("reset")
        assert "release it, then" in robot.app.service.status()["message"]
        await robot.call("simulation.input", node=3, input=1, level="high")
        await robot.until(lambda: not robot.app.devices.drives["front_left"].emergency_stop)
        assert robot.state == "estop"
        assert "release it" not in robot.app.service.status()["message"]
        await robot.call("reset")
        assert robot.state == "idle"


async def test_a_robot_that_boots_with_it_pressed_is_stopped_and_says_so() -> None:
    async with running_robot(profile=profile_with_button(pressed="high"), expect_errors=True) as robot:
        robot.network.power_off("front_left")
        robot.network.set_input(3, 1, True)
        robot.network.power_on("front_left")
        await robot.until(lambda: robot.state == "estop")


async def test_an_input_that_is_not_told_any_more_counts_as_pressed() -> None:
    async with robot_with_button() as robot:
        await robot.app.supervisor.master.sdo(3).write(OBJECTS["tpdo2_cob_id"], 0x80000283)
        seen_s = await robot.until(lambda: robot.state == "estop")
        assert seen_s <= STALE_S + CYCLES * robot.app.cycle.period_s
        assert "is not told any more" in robot.app.service.status()["message"]


async def test_only_drives_have_inputs() -> None:
    async with robot_with_button() as robot:
        with pytest.raises(NodeAbsent, match="no drive"):
            await robot.call("simulation.input", node=5, input=1, level="low")
