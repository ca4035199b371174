"""Readings that contradict each other: each check on its own, and the whole simulated robot with the truth changed."""

from __future__ import annotations

import asyncio
import math
from typing import Any

import msgspec
import pytest

from canhelm.errors import CanhelmError, DeviceFault
from daemon.loops.plausibility import EncoderJumps
from daemon.loops.plausibility_limits import encoder_rates_rad_s, jump_margins_rad
from profiles.loader import load
from profiles.plausibility import PlausibilityConfig
from vcan_tests.robot import Robot, running_robot

PERIOD_S = 0.01
CYCLES_TO_NOTICE = 2
"""The reading comes with a SYNC, and is looked at in its cycle."""
JUMP_LIMIT_DEG = 1.0 + 2 * 360 / 4096 + 2 * math.degrees(0.15 / 0.075) * PERIOD_S
"""Of the MAX2D by hand: 1 deg, two counts, and twice the way in a cycle at 0.15 m/s on an arm of 0.075 m."""


def jumps() -> EncoderJumps:
    return EncoderJumps((1.0,), (0.01,), PERIOD_S)


# An encoder that jumps


@pytest.mark.parametrize(("step_rad", "found"), [(0.029, False), (0.031, True), (-0.031, True), (math.nan, True)])
def test_a_step_beyond_margin_and_twice_the_turning_is_a_jump(step_rad: float, found: bool) -> None:
    check = jumps()
    assert check.look((0.5,), (0.0,)) is None
    assert (check.look((0.5 + step_rad,), (PERIOD_S,)) is not None) is found


def test_the_same_reading_twice_is_no_reading() -> None:
    check = jumps()
    check.look((0.0,), (0.0,))
    assert check.look((9.0,), (0.0,)) is None


def test_after_a_reading_that_came_late_the_next_one_may_be_as_far_off() -> None:
    """It tells where the axis was before it was late; the next one comes at once and tells where it is."""
    check = jumps()
    check.look((0.0,), (0.0,))
    assert check.look((0.01,), (0.05,)) is None
    assert check.look((0.06,), (0.051,)) is None
    assert check.look((0.16,), (0.061,)) is not None


def test_after_a_new_beginning_any_angle_is_true() -> None:
    check = jumps()
    check.look((0.0,), (0.0,))
    check.begin_anew()
    assert check.look((9.0,), (PERIOD_S,)) is None


@pytest.mark.parametrize(
    ("name", "rates_deg_s"), [("max2d", (114.592, 114.592)), ("ackermann", (180.0,)), ("semitrailer", (60.0, 110.686))]
)
def test_the_fastest_turning_of_each_axis_is_that_of_its_vehicle(name: str, rates_deg_s: tuple[float, ...]) -> None:
    """The bending angle by hand: 0.4 m/s (k + (1 + 0.013 k) / 0.615) with k = tan(34 deg) / 0.215 = 3.1373 1/m."""
    rates = tuple(map(math.degrees, encoder_rates_rad_s(load(name).profile)))
    assert rates == pytest.approx(rates_deg_s, rel=1e-3)


def test_a_margin_of_the_profile_counts_instead_of_the_derived_one() -> None:
    profile = load("max2d").profile
    given = msgspec.structs.replace(profile, plausibility=PlausibilityConfig(encoder_jump_deg=0.5))
    assert jump_margins_rad(profile, ("rear",)) == pytest.approx((math.radians(1.0 + 2 * 360 / 4096),))
    assert jump_margins_rad(given, ("rear",)) == (math.radians(0.5),)


def _begin(robot: Robot, method: str, **params: Any) -> asyncio.Task[object]:
    async def ask() -> object:
        try:
            return await robot.call(method, **params)
        except CanhelmError as error:
            return error

    return asyncio.create_task(ask())


async def _time_to_fault(robot: Robot) -> float:
    """Until the vehicle is in fault; afterwards it comes to rest, with every power stage off."""
    noticed_s = await robot.until(lambda: robot.state == "fault", 5.0)
    await robot.until(lambda: not robot.app.supervisor.anything_enabled, 5.0)
    await robot.until(lambda: robot.fastest_wheel_m_s < 0.01, 0.5)
    return noticed_s


def _let_jump(robot: Robot, encoder: str, by_deg: float) -> None:
    node = robot.app.profile.encoders[encoder].node
    now_rad = robot.app.devices.encoders[encoder].heading_rad
    robot.network.turn_sensor(node, now_rad + math.radians(by_deg))


@pytest.mark.parametrize("by_deg", [JUMP_LIMIT_DEG + 0.2, -JUMP_LIMIT_DEG - 0.2, 5.0, -12.0, 45.0, -90.0, 180.0])
async def test_a_jump_while_it_drives_stops_the_robot_in_two_cycles_by_name(by_deg: float) -> None:
    async with running_robot(expect_errors=True) as robot:
        driving = _begin(robot, "drive.parallel", angle_deg=0.0, speed_m_s=0.4, duration_s=10.0)
        await robot.until(lambda: robot.speed_m_s > 0.3)
        _let_jump(robot, "front", by_deg)
        assert await _time_to_fault(robot) <= CYCLES_TO_NOTICE * PERIOD_S + 1e-6
        error = await driving
        assert isinstance(error, DeviceFault)
        assert "node 6 (front) jumped by" in error.message
        assert error.value == pytest.approx(abs(by_deg), abs=0.2)
        assert error.limit == pytest.approx(JUMP_LIMIT_DEG, abs=0.02)


@pytest.mark.parametrize("by_deg", [-20.0, 8.0])
async def test_a_jump_while_the_pair_turns_stops_it(by_deg: float) -> None:
    async with running_robot(expect_errors=True) as robot:
        turning = _begin(robot, "steer", pair="rear", angle_deg=60.0)
        await robot.until(lambda: robot.app.devices.encoders["rear"].heading_rad > 0.5)
        _let_jump(robot, "rear", by_deg)
        assert await _time_to_fault(robot) <= CYCLES_TO_NOTICE * PERIOD_S + 1e-6
        assert "node 5 (rear) jumped by" in str(await turning)


@pytest.mark.parametrize(("name", "encoder"), [("ackermann", "steering_angle"), ("semitrailer", "bending_angle")])
async def test_a_jump_of_any_steered_vehicles_encoder_stops_it(name: str, encoder: str) -> None:
    async with running_robot(load(name).profile, expect_errors=True) as robot:
        _begin(robot, "drive.set", speed_m_s=0.2, steering_deg=0.0, valid_for_ms=9000)
        await robot.until(lambda: robot.speed_m_s > 0.1)
        _let_jump(robot, encoder, 10.0)
        assert await _time_to_fault(robot) <= CYCLES_TO_NOTICE * PERIOD_S + 1e-6
        assert encoder in robot.app.supervisor.message


async def test_without_power_an_axis_may_be_turned_as_fast_as_one_likes() -> None:
    async with running_robot() as robot:
        _let_jump(robot, "front", 30.0)
        await asyncio.sleep(0.1)
        robot.network.turn_sensor(robot.app.profile.encoders["front"].node, None)
        await asyncio.sleep(0.1)
        assert robot.state == "idle"
        await robot.call("steer", pair="front", angle_deg=5.0)
