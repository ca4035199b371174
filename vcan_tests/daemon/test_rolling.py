"""A vehicle whose wheels turn although no drive has power."""

from __future__ import annotations

import asyncio

import pytest

from profiles.loader import load
from vcan_tests.robot import running_robot

TURTLE = load("turtle").profile


@pytest.mark.parametrize("part", ["wheel_1", None], ids=["ice under a wheel", "dry"])
async def test_wheels_that_turn_on_after_a_stop_because_the_robot_slides_are_told_of(part: str | None) -> None:
    async with running_robot(TURTLE) as robot:
        driving = robot.begin("drive.to", x_m=4.0, y_m=4.0)
        await asyncio.sleep(1.6)
        if part:
            await robot.call("simulation.fault", kind="ice", part=part)
        await robot.call("stop")
        await driving
        await asyncio.sleep(0.3)
        assert robot.app.supervisor.message.endswith("m/s without power" if part else "")
        await robot.until(lambda: not robot.app.supervisor.message, 60.0)
        told = [event["message"] for event in robot.app.supervisor.log.events]
        assert len([message for message in told if "without power" in message]) == bool(part)
