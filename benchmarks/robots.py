"""Simulated robots to measure: booted, standing or driving, taken down at the end."""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass

from msgspec.structs import replace

from daemon.demo_robot import DemoRobot
from drivers.simulated.bus import SimulatedPort
from profiles.loader import load
from profiles.schema import Profile

ROBOT = "max2d"
FOREVER_S = 36_000.0
SEED = 1
FRAMES_A_DRIVE = 2
"""In the transmit queue at a time: a target and a guard request."""


@dataclass(frozen=True)
class Scene:
    """What a robot does while it is measured.

    Attributes:
        words: what it does.
        method, params: the motion; None: it stands, its drives off.
    """

    words: str
    method: str | None = None
    params: tuple[tuple[str, float], ...] = ()


STANDING = Scene("stands, drives off")
STRAIGHT = Scene("drives straight on, 0.6 m/s", "drive.parallel", (("angle_deg", 0.0), ("speed_m_s", 0.6)))
TURNING = Scene("drives a turn, 0.4 m/s", "drive.turn", (("rear_deg", 8.0), ("front_deg", -16.0), ("speed_m_s", 0.4)))


def robot_at(cycle_hz: float) -> Profile:
    """The MAX2D with another rate of control cycles."""
    profile = load(ROBOT).profile
    return replace(profile, network=replace(profile.network, cycle_hz=cycle_hz))


@asynccontextmanager
async def booted(profile: Profile, bus: str = "simulated") -> AsyncIterator[DemoRobot]:
    """A robot that has booted. Raises Timeout where it does not.

    A simulated bus has a transmit queue in which all targets of a cycle find room.
    """
    robot = DemoRobot(profile, SEED, None, lambda _: None, bus=bus)
    if isinstance(robot.app.bus, SimulatedPort):
        robot.app.bus.depth = max(robot.app.bus.depth, FRAMES_A_DRIVE * len(profile.drives))
    await robot.app.start()
    try:
        await robot.boot("the robot")
        yield robot
    finally:
        await robot.app.close()


async def begin(robot: DemoRobot, scene: Scene) -> None:
    """Let it do something until it is taken down."""
    if scene.method is not None:
        params = {**dict(scene.params), "duration_s": FOREVER_S, "wait": False}
        await robot.app.service.call(scene.method, params, None)
