"""A robot with a holding brake on one wheel: nothing moves against it, and it does not let a free axis go."""

from __future__ import annotations

import msgspec
import pytest

from canhelm.errors import Interlock
from profiles.loader import load
from profiles.schema import BrakeConfig, Profile
from vcan_tests.robot import running_robot


def robot_with_a_holding_brake() -> Profile:
    profile = load("max2d").profile
    held = BrakeConfig(kind="holding", drive="rear_left", open_time_s=0.03, close_time_s=0.02)
    return msgspec.structs.replace(profile, brakes={**profile.brakes, "wheel": held})


async def test_a_motor_does_not_move_against_its_holding_brake() -> None:
    async with running_robot(robot_with_a_holding_brake()) as robot:
        with pytest.raises(Interlock, match="holds rear_left"):
            await robot.call("motor.velocity", node="rear_left", velocity_rpm=100.0, duration_s=0.5)
        with pytest.raises(Interlock, match="holds rear_left"):
            await robot.call("drive.parallel", angle_deg=0.0, speed_m_s=0.2, duration_s=1.0)


async def test_a_holding_brake_is_not_released_on_a_disabled_axis_unless_forced() -> None:
    async with running_robot(robot_with_a_holding_brake()) as robot:
        with pytest.raises(Interlock, match="would not hold"):
            await robot.call("brake.release", pair="wheel")
        released = await robot.call("brake.release", pair="wheel", force=True)
        assert released["brakes"][0]["state"] == "released"


async def test_with_the_brake_released_on_an_enabled_axis_the_wheel_turns() -> None:
    async with running_robot(robot_with_a_holding_brake()) as robot:
        await robot.call("motor.enable", node="rear_left")
        await robot.call("brake.release", pair="wheel")
        result = await robot.call("motor.velocity", node="rear_left", velocity_rpm=100.0, duration_s=0.5)
        assert result["wheel_travel_m"] > 0.01


async def test_a_drive_is_switched_off_only_with_its_holding_brake_engaged() -> None:
    async with running_robot(robot_with_a_holding_brake()) as robot:
        await robot.call("motor.enable", node="rear_left")
        await robot.call("brake.release", pair="wheel")
        await robot.call("motor.disable", node="rear_left")
        assert robot.app.devices.brakes["wheel"].state == "engaged"


async def test_the_emergency_stop_engages_holding_brakes_before_the_power_goes() -> None:
    async with running_robot(robot_with_a_holding_brake(), expect_errors=True) as robot:
        await robot.call("motor.enable", node="rear_left")
        await robot.call("brake.release", pair="wheel")
        states: list[tuple[str, str]] = []
        drive, brake = robot.app.devices.drives["rear_left"], robot.app.devices.brakes["wheel"]
        robot.app.supervisor.observers.append(lambda: states.append((drive.state, brake.state)))
        await robot.call("estop")
        await robot.until(lambda: drive.state == "disabled", 3.0)
        assert ("quick_stop", "engaged") in states
        assert ("disabled", "released") not in states
