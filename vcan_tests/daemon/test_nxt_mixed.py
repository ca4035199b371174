"""Robots with an NXT brick and EPOS drives together."""

from __future__ import annotations

import asyncio
from pathlib import Path

import pytest

from canhelm.errors import CanhelmError
from profiles.loader import load
from profiles.schema import Profile
from vcan_tests.daemon.nxt_twin import turning, twin_of
from vcan_tests.robot import running_robot

ARM = """
schema_version: 1
extends: nxt
drives:
  arm: {extends: devices/turtle_wheel_drive, node: 5}
simulation: {extends: vehicles/arm_simulation}
"""
GRIPPER = """
schema_version: 1
extends: max2d
bricks:
  hand:
    motors:
      gripper: {output: A, wheel_radius_m: 0.01, max_speed_m_s: 0.1, quick_stop_m_s2: 1.0}
"""
TWO_EPOS = """
schema_version: 1
drives:
  right: {extends: devices/turtle_wheel_drive, node: 1}
  left: {extends: devices/turtle_wheel_drive, node: 2}
vehicle: {type: differential, half_track_m: 0.2, wheels: [right, left]}
limits: {speed_m_s: 0.3, acceleration_m_s2: 1.0, wheel_speed_m_s: 0.5}
simulation: {extends: supply}
"""
SUPPLY = """
supply_voltage_v: 24
wheel_inertia_kg_m2: 0.0005
tyre:
  {friction: 0.7, slip_stiffness: 30, cornering_stiffness_per_rad: 10, relaxation_length_m: 0.02}
"""


@pytest.fixture
def arm(tmp_path: Path) -> Profile:
    """The NXT robot with an arm on CAN."""
    (tmp_path / "supply.yaml").write_text(SUPPLY)
    (tmp_path / "lab.yaml").write_text(ARM.replace("vehicles/arm_simulation", "supply"))
    return load(tmp_path / "lab.yaml").profile


@pytest.fixture
def gripper(tmp_path: Path) -> Profile:
    """The MAX2D with a gripper at a brick."""
    (tmp_path / "lab.yaml").write_text(GRIPPER)
    return load(tmp_path / "lab.yaml").profile


async def test_a_robot_on_a_brick_drives_while_its_arm_on_can_turns(arm: Profile) -> None:
    async with running_robot(arm, seed=3) as robot:
        turned, driven = await asyncio.gather(
            robot.call("motor.velocity", node="arm", wheel_speed_m_s=0.2, duration_s=2.0),
            robot.call("drive.to", x_m=0.2, y_m=0.0),
        )
        assert turned["wheel_travel_m"] == pytest.approx(0.4, abs=0.08)
        assert driven["result"] == "arrived"
        assert robot.state == "idle"


async def test_a_max2d_drives_while_its_gripper_at_a_brick_turns(gripper: Profile) -> None:
    async with running_robot(gripper, seed=3) as robot:
        turned, driven = await asyncio.gather(
            robot.call("motor.velocity", node="gripper", velocity_rpm=30.0, duration_s=2.0),
            robot.call("drive.parallel", angle_deg=0.0, speed_m_s=0.3, duration_s=2.0),
        )
        assert turned["wheel_travel_m"] == pytest.approx(0.063, rel=0.15)
        assert driven["duration_s"] > 2.0


@pytest.mark.parametrize("part", ["hand", "front_left"])
async def test_losing_one_of_them_in_motion_stops_the_other(gripper: Profile, part: str) -> None:
    async with running_robot(gripper, seed=3, expect_errors=True) as robot:
        motion = asyncio.create_task(robot.call("motor.velocity", node="gripper", velocity_rpm=30.0))
        driving = asyncio.create_task(robot.call("drive.parallel", angle_deg=0.0, speed_m_s=0.3, duration_s=10.0))
        await robot.until(lambda: turning(robot, "hand") and robot.speed_m_s > 0.2)
        await robot.call("simulation.power", node=part, on=False)
        await robot.until(lambda: robot.state == "fault")
        for task in (motion, driving):
            with pytest.raises(CanhelmError):
                await task
        await robot.until(lambda: robot.speed_m_s < 0.01 and not turning(robot, "hand"), timeout_s=5.0)


async def test_two_wheels_on_can_are_driven_by_the_same_law(tmp_path: Path) -> None:
    """On a stand: where the robot would be is known by its wheels alone."""
    (tmp_path / "supply.yaml").write_text(SUPPLY)
    (tmp_path / "lab.yaml").write_text(TWO_EPOS)
    async with running_robot(load(tmp_path / "lab.yaml").profile, seed=3) as robot:
        result = await robot.call("drive.to", x_m=0.5, y_m=0.2, heading_deg=90.0)
        assert result["error_m"] < 0.004
        assert abs(result["heading_error_deg"]) < 3.0
        assert robot.app.vehicle.methods == ("drive.to", "drive.set")


async def test_a_robot_waits_for_its_brick(gripper: Profile) -> None:
    async with running_robot(gripper, seed=3, powered=False, booted=False, expect_errors=True) as robot:
        for name in (*robot.network.drives, *robot.network.encoders):
            robot.network.power_on(name)
        await robot.until(lambda: "no brick in reach" in robot.app.supervisor.message)
        twin_of(robot, "hand").power_on()
        await robot.until(lambda: robot.state == "idle")
