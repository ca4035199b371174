"""`drive to` by the published planner: it arrives, or is given up, and what it never ends with is refused."""

from __future__ import annotations

import math

import pytest

from canhelm.errors import Timeout, UsageError
from daemon.loops.planner import PlanarLimits, PlanarState
from daemon.runtime.omni_motions import longest_drive_s
from daemon.runtime.omni_vehicle import OmniVehicle
from drivers.simulated.omni import OmniWorld
from profiles.loader import load
from vcan_tests.robot import running_robot

TURTLE = load("turtle").profile


async def test_it_drives_to_a_place() -> None:
    async with running_robot(TURTLE) as robot:
        result = await robot.call("drive.to", x_m=1.0, y_m=0.5, planner="published")
        assert result["result"] == "arrived"
        assert isinstance(robot.network.world, OmniWorld)
        assert math.dist(robot.network.world.pose[:2], (1.0, 0.5)) < 0.015


@pytest.mark.parametrize(
    ("given", "told"),
    [
        ({"end_vx_m_s": 0.4}, "the published planner drives to a goal with a velocity again and again"),
        ({"end_vy_m_s": -0.1}, "the published planner drives to a goal with a velocity again and again"),
        ({"heading_deg": 90.0}, "the published planner turns no robot"),
    ],
)
async def test_what_it_never_ends_with_is_refused(given: dict[str, float], told: str) -> None:
    async with running_robot(TURTLE) as robot:
        with pytest.raises(UsageError) as refused:
            await robot.call("drive.to", x_m=2.0, y_m=0.5, planner="published", **given)
        assert (refused.value.message, robot.state) == (told, "idle")


async def test_a_drive_that_does_not_arrive_is_given_up_and_comes_to_rest() -> None:
    async with running_robot(TURTLE) as robot:
        vehicle = robot.app.vehicle
        assert isinstance(vehicle, OmniVehicle)
        passing = vehicle.to_goal(PlanarState(1.0, 0.3, 0.0, 0.6, 0.0), vehicle.limits, None, published=True)
        robot.app.supervisor.admit(passing)
        with pytest.raises(Timeout, match=r"drive\.to: the published planner did not arrive in 21\.7 s"):
            await passing.result()
        assert robot.speed_m_s < 0.01
        await robot.until(lambda: robot.state == "idle")


def test_the_longest_drive_is_twice_that_with_the_least_acceleration_of_its_traction_control() -> None:
    assert longest_drive_s(2.0, PlanarLimits(1.0, 0.5, 1.0, 1.0)) == pytest.approx(2 * (2.0 / 1.0 + 1.0 / 0.05))
