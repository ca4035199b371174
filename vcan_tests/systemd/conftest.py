"""The robot that the service's tests share; each finds it idle."""

from __future__ import annotations

import pytest

from vcan_tests.systemd.bench import Robot


@pytest.fixture
async def robot() -> Robot:
    """max2d as a service, at rest and without a fault."""
    robot = Robot()
    await robot.make_idle()
    return robot


@pytest.fixture
def dark_robot() -> Robot:
    """max2d without motor power, and without its daemon."""
    robot = Robot()
    robot.clear()
    return robot
