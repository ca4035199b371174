"""The simulated Turtle driven over the bus on a floor with ice, its slip answered by one of three ways."""

from __future__ import annotations

import asyncio

import msgspec

from daemon.runtime.clock import run_virtual
from daemon.runtime.omni_motions import OmniMotion
from daemon.runtime.omni_vehicle import OmniVehicle
from drivers.simulated.omni import OmniWorld
from profiles.loader import load
from profiles.schema import FloorPatch, Profile
from vcan_tests.daemon.gripping_robot import LONGEST_S, Cycle, Drive, Way
from vcan_tests.daemon.test_turtle import without_accelerometer
from vcan_tests.robot import Robot, running_robot

WAY_M = 3.0


def drive(ice: FloorPatch | None, seed: int, way: Way, *, by_currents: bool) -> Drive:
    """Drive 3 m straight ahead.

    Args:
        ice: on the floor; None: all of it is dry.
        seed: of the simulated network.
        way: how slip is answered.
        by_currents: without an accelerometer.
    """
    profile = without_accelerometer() if by_currents else load("turtle").profile
    return run_virtual(_drive(_on(profile, ice), seed, way))


def _on(profile: Profile, ice: FloorPatch | None) -> Profile:
    assert profile.simulation is not None
    simulation = msgspec.structs.replace(profile.simulation, floor={"ice": ice} if ice else {})
    return msgspec.structs.replace(profile, simulation=simulation)


async def _drive(profile: Profile, seed: int, way: Way) -> Drive:
    driven = Drive()
    async with running_robot(profile, seed=seed, expect_errors=True) as robot:
        vehicle = robot.app.vehicle
        assert isinstance(vehicle, OmniVehicle)
        vehicle.senses.observing = vehicle.senses.observing and way is Way.IMPROVED
        robot.app.supervisor.observers.append(lambda: _look(robot, driven))
        planner = "published" if way is Way.PUBLISHED else "optimal"
        try:
            async with asyncio.timeout(LONGEST_S):
                result = await robot.call("drive.to", x_m=WAY_M, y_m=0.0, planner=planner)
            driven.arrived_s = result["duration_s"]
        except TimeoutError:
            await robot.call("stop")
    return driven


def _look(robot: Robot, driven: Drive) -> None:
    world, now = robot.network.world, asyncio.get_running_loop().time()
    assert isinstance(world, OmniWorld)
    for motion in robot.app.supervisor.motions.values():
        if isinstance(motion, OmniMotion) and motion.record:
            told, slip = motion.record.guidance, max(map(abs, world.slip_m_s))
            place = complex(*world.pose[:2])
            driven.cycles.append(Cycle(now, place, told.safety_factor, any(told.slip), slip))
