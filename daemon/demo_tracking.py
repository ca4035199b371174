"""A tracking system as in a laboratory, for demos: it tells a vehicle ten times a second where it is, with noise."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from random import Random
from typing import Final

from daemon.demo_robot import DemoRobot
from daemon.loops.odometry import Pose

FIX_S: Final = 0.1
NOISE_M, NOISE_RAD = 0.005, math.radians(0.3)
"""Standard deviation of a reading of the tracking system (assumed)."""
WEIGHT: Final = 0.1
"""Of one reading against the odometry."""


@contextmanager
def tracked(
    robot: DemoRobot,
    truth: Callable[[], tuple[float, float, float]],
    locate: Callable[[Pose, float], None],
    seed: int,
) -> Iterator[None]:
    """While it is open, the tracking system works.

    Args:
        robot: whose control cycles pace it.
        truth: pose of the vehicle's reference point.
        locate: tells the vehicle, with a weight.
        seed: of the noise.
    """
    random, loop = Random(seed), asyncio.get_running_loop()
    due_s = loop.time()

    def look() -> None:
        nonlocal due_s
        if loop.time() < due_s:
            return
        due_s += FIX_S
        (x, y, yaw), noise = truth(), random.gauss
        locate(Pose(x + noise(0.0, NOISE_M), y + noise(0.0, NOISE_M), yaw + noise(0.0, NOISE_RAD)), WEIGHT)

    robot.app.supervisor.observers.append(look)
    try:
        yield
    finally:
        robot.app.supervisor.observers.remove(look)
