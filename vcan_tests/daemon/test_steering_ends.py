"""A person who turns a steering motor on and on, on whole simulated vehicles: the axle is held before its stops."""

from __future__ import annotations

import asyncio
import math

import pytest

from drivers.simulated.ackermann import AckermannWorld
from drivers.simulated.semitrailer import SemitrailerWorld
from profiles.loader import load
from vcan_tests.robot import Robot, running_robot

LOOK_S = 0.01
pytestmark = pytest.mark.parametrize("name", ["ackermann", "semitrailer"])


def angle_rad(robot: Robot) -> float:
    world = robot.network.world
    assert isinstance(world, AckermannWorld | SemitrailerWorld)
    world.advance(asyncio.get_running_loop().time())
    return world.steering.angle_rad


@pytest.mark.parametrize("side", [1, -1])
async def test_the_axle_never_comes_to_its_stop_and_rests_without_current(name: str, side: int) -> None:
    profile = load(name).profile
    stop_rad = math.radians(profile.vehicle.steering.stop_deg)  # type: ignore[union-attr]
    async with running_robot(profile) as robot:
        steering = robot.app.devices.drives["steering"]
        turning = robot.begin("motor.velocity", node="steering", velocity_rpm=side * 400.0, duration_s=7.0)
        await robot.until(lambda: "steering_stop" in robot.app.supervisor.active_limits)
        angles, targets = [], []
        for _ in range(300):
            await asyncio.sleep(LOOK_S)
            angles.append(side * angle_rad(robot))
            targets.append(steering.target_speed_m_s)
        assert max(angles) < stop_rad
        assert set(targets[50:]) == {0.0}
        assert robot.app.supervisor.active_limits == ("steering_stop",)
        assert abs(steering.current_a) < 0.3
        await turning


async def test_from_there_it_can_be_turned_back(name: str) -> None:
    async with running_robot(load(name).profile) as robot:
        await robot.call("motor.velocity", node="steering", velocity_rpm=400.0, duration_s=4.0)
        end_rad = angle_rad(robot)
        await robot.call("motor.velocity", node="steering", velocity_rpm=-400.0, duration_s=0.5)
        assert angle_rad(robot) < end_rad - math.radians(3.0)
