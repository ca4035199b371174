"""A wheel that disagrees with the body: the check on its own, and simulated robots with a wheel that is broken."""

from __future__ import annotations

import asyncio
import math

import pytest

from canhelm.errors import DeviceFault
from daemon.loops.least_squares import Fits
from daemon.loops.wheels_and_body import WheelsAndBody, rows_of, wheel_limit_m
from profiles.loader import load
from vcan_tests.robot import running_robot

DT = 0.01
LIMIT_M = 0.02
OMNI = [(math.cos(angle), math.sin(angle), 0.2) for angle in (0.3, 1.9, 3.4, 5.0)]


def drive(
    rows: list[tuple[float, float, float]], twist: tuple[float, float, float], broken: dict[int, float]
) -> tuple[int, float] | None:
    """Roll for two seconds as a twist commands; broken wheels roll by this factor of it."""
    check, fit = WheelsAndBody(LIMIT_M), Fits(lambda _: rows).at(())
    wheels = 4
    speeds = [sum(a * b for a, b in zip(row, twist, strict=True)) for row in rows[:wheels]]
    for cycle in range(201):
        travel = [broken.get(wheel, 1.0) * speed * cycle * DT for wheel, speed in enumerate(speeds)]
        found = check.look(fit, travel, speeds, DT)
        if found:
            return found.index, cycle * DT
    return None


def test_wheels_that_roll_as_they_are_told_agree_with_the_body() -> None:
    assert drive(rows_of(load("max2d").profile, (0.3, -0.2)), (0.5, 0.2, 0.4), {}) is None


def test_a_body_that_is_held_or_late_is_no_contradiction() -> None:
    """Straight ahead, all wheels roll half of what they are told."""
    rows = rows_of(load("max2d").profile, (0.0, 0.0))
    assert drive(rows, (0.5, 0.0, 0.0), dict.fromkeys(range(4), 0.5)) is None


@pytest.mark.parametrize("wheel", range(4))
@pytest.mark.parametrize("factor", [0.0, -1.0, 2.0])
@pytest.mark.parametrize("rows", [rows_of(load("max2d").profile, (0.0, 0.0)), OMNI], ids=["paired", "omni"])
def test_the_wheel_that_is_off_is_named(rows: list[tuple[float, float, float]], wheel: int, factor: float) -> None:
    twist = (0.5, 0.0, 0.0) if len(rows) > 4 else (0.0, 0.0, 2.0)
    found = drive(rows, twist, {wheel: factor})
    assert found is not None
    assert found[0] == wheel


def test_three_free_wheels_cannot_contradict_each_other() -> None:
    assert rows_of(load("turtle").profile, ()) == []


@pytest.mark.parametrize(("name", "limit_m"), [("max2d", 0.02), ("ackermann", 0.03)])
def test_the_limit_is_the_way_of_a_cycle_at_the_fastest(name: str, limit_m: float) -> None:
    assert wheel_limit_m(load(name).profile) == pytest.approx(limit_m)


WAY_M = {"max2d": 0.25, "ackermann": 0.7}
"""That the robot drives until the fault is noticed."""
BROKEN = [("encoder_stuck", 0.2), ("encoder_stuck", 1.0), ("encoder_reversed", 0.4), ("motor_blocked", 0.4)]


@pytest.mark.parametrize(
    ("name", "method", "part"),
    [
        ("max2d", "drive.parallel", "front_left"),
        ("max2d", "drive.parallel", "rear_right"),
        ("ackermann", "drive.heading", "rear_left"),
    ],
)
@pytest.mark.parametrize(("kind", "speed_m_s"), BROKEN)
async def test_a_broken_wheel_stops_the_robot_by_name(
    name: str, method: str, part: str, kind: str, speed_m_s: float
) -> None:
    async with running_robot(load(name).profile, expect_errors=True) as robot:
        direction = {"angle_deg": 0.0} if name == "max2d" else {"heading_deg": 0.0}
        driving = robot.begin(method, **direction, speed_m_s=speed_m_s, duration_s=10.0)
        await robot.until(lambda: robot.speed_m_s > 0.9 * speed_m_s)
        await robot.call("simulation.fault", kind=kind, part=part)
        x, y, _ = robot.network.world.pose
        await robot.until(lambda: robot.state == "fault", 5.0)
        way_m = math.hypot(robot.network.world.pose[0] - x, robot.network.world.pose[1] - y)
        await robot.until(lambda: not robot.app.supervisor.anything_enabled, 5.0)
        error = await driving
        assert isinstance(error, DeviceFault)
        assert f"({part})" in error.message
        assert way_m < WAY_M[name]


async def test_a_car_that_swerves_from_lock_to_lock_at_full_speed_is_left_in_peace() -> None:
    async with running_robot(load("ackermann").profile) as robot:
        for steering_deg in (45.0, -45.0, 45.0, -45.0):
            await robot.call("drive.set", speed_m_s=2.0, steering_deg=steering_deg, valid_for_ms=4000)
            await asyncio.sleep(2.0)
        await robot.call("drive.set", speed_m_s=0.2, steering_deg=45.0, valid_for_ms=4000)
        await asyncio.sleep(2.0)
        assert robot.state == "active"
