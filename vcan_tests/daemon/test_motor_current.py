"""A motor's current that does not fit the motion of its wheel: the check on its own, and robots that are broken."""

from __future__ import annotations

import asyncio
import math
from dataclasses import astuple
from typing import Any

import pytest

from canhelm.errors import DeviceFault
from daemon.loops.motor_current import CurrentAndMotion, CurrentLimits, Misfit, current_limits
from profiles.loader import load
from vcan_tests.robot import running_robot

DT = 0.01
LIMITS = CurrentLimits(time_s=0.25, strong_a=2.0, weak_a=0.03, late_m_s=0.04, gain_m_s=0.2)
SECOND = 100


CYCLES_TO_NOTICE = 25


def found(current_a: float, speeds_m_s: list[float], commanded_m_s: float) -> tuple[Misfit, int] | None:
    """What is found first at these speeds, one a cycle, and in which cycle."""
    check = CurrentAndMotion(LIMITS)
    for cycle, speed in enumerate(speeds_m_s, 1):
        misfit = check.look(current_a, speed, commanded_m_s, DT)
        if misfit:
            return misfit, cycle
    return None


def speeding_up(acceleration_m_s2: float) -> list[float]:
    return [acceleration_m_s2 * cycle * DT for cycle in range(SECOND)]


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_much_current_that_does_not_turn_a_wheel_is_in_vain(sign: float) -> None:
    assert found(sign * 2.5, [0.0] * SECOND, sign * 0.4) == (Misfit.IN_VAIN, CYCLES_TO_NOTICE)


def test_much_current_that_keeps_a_wheel_at_its_speed_is_not_in_vain() -> None:
    assert found(2.5, [0.37] * SECOND, 0.4) is None


def test_much_current_that_speeds_a_late_wheel_up_is_not_in_vain() -> None:
    assert found(2.5, speeding_up(0.3), 1.0) is None


def test_a_wheel_that_hardly_speeds_up_under_much_current_is_held() -> None:
    assert found(2.5, speeding_up(0.1), 1.0) is not None


def test_a_wheel_that_is_late_with_little_current_may_be() -> None:
    assert found(1.5, [0.0] * SECOND, 0.4) is None


def test_current_away_from_the_command_is_not_in_vain() -> None:
    assert found(-2.5, [0.0] * SECOND, 0.4) is None


def test_a_wheel_that_is_late_without_current_has_no_motor() -> None:
    assert found(0.01, [0.2] * SECOND, 0.4) == (Misfit.NONE, CYCLES_TO_NOTICE)


def test_a_wheel_at_rest_needs_no_current() -> None:
    assert found(0.0, [0.0] * SECOND, 0.0) is None


def test_a_wheel_that_others_speed_up_without_its_own_current_has_no_motor() -> None:
    check = CurrentAndMotion(LIMITS)
    cycles = [check.look(0.0, speed, speed, DT) for speed in speeding_up(0.8)]
    assert cycles.index(Misfit.NONE) * DT == pytest.approx(0.25)


def test_a_wheel_that_slows_down_by_friction_alone_needs_no_current() -> None:
    check = CurrentAndMotion(LIMITS)
    assert not any(check.look(0.0, speed, speed, DT) for speed in reversed(speeding_up(0.8)))


def test_what_was_seen_before_a_new_beginning_does_not_count() -> None:
    check = CurrentAndMotion(LIMITS)
    for _ in range(10):
        assert not any(check.look(2.5, 0.0, 0.4, DT) for _ in range(20))
        check.begin_anew()


def test_the_limits_follow_from_motor_and_vehicle() -> None:
    """Of the MAX2D by hand: 0.9 of 2.64 A, a quarter of 0.12 A, 2 % of 2 m/s, 0.8 m/s2 in 0.25 s."""
    profile = load("max2d").profile
    limits = current_limits(profile, profile.drives["front_left"])
    assert astuple(limits) == pytest.approx((0.25, 2.376, 0.03, 0.04, 0.2))


STRAIGHT = {"angle_deg": 0.0, "speed_m_s": 0.4, "duration_s": 5.0}
HEADING = {"heading_deg": 0.0, "speed_m_s": 1.0, "duration_s": 5.0}
STREAM = {"speed_m_s": 0.3, "steering_deg": 20.0, "valid_for_ms": 9000.0}


@pytest.mark.parametrize(
    ("name", "method", "params", "part"),
    [
        ("max2d", "drive.parallel", STRAIGHT, "front_left"),
        ("ackermann", "drive.heading", HEADING, "rear_left"),
        ("semitrailer", "drive.set", STREAM, "drive"),
        ("turtle", "drive.to", {"x_m": 2.0, "y_m": 0.0}, "wheel_1"),
    ],
)
@pytest.mark.parametrize(("kind", "does"), [("motor_blocked", "in vain"), ("motor_open", "without current")])
async def test_a_motor_that_is_blocked_or_not_connected_stops_the_vehicle_by_name(
    name: str, method: str, params: dict[str, Any], part: str, kind: str, does: str
) -> None:
    async with running_robot(load(name).profile, expect_errors=True) as robot:
        await robot.call("simulation.fault", kind=kind, part=part)
        driving = robot.begin(method, **params)
        x, y, _ = robot.network.world.pose
        await robot.until(lambda: robot.state == "fault", 1.5)
        assert f"({part})" in robot.app.supervisor.message
        assert does in robot.app.supervisor.message
        assert math.dist((x, y), robot.network.world.pose[:2]) < 0.2
        await robot.until(lambda: not robot.app.supervisor.anything_enabled, 5.0)
        await driving


async def test_a_motor_that_is_blocked_while_it_drives_stops_the_robot_within_0_3_s() -> None:
    async with running_robot(expect_errors=True) as robot:
        driving = robot.begin("drive.parallel", **STRAIGHT)
        await robot.until(lambda: robot.speed_m_s > 0.38)
        await robot.call("simulation.fault", kind="motor_blocked", part="rear_right")
        assert await robot.until(lambda: robot.state == "fault", 1.0) < 0.3
        error = await driving
        assert isinstance(error, DeviceFault)
        assert "node 1 (rear_right) has 5 A in vain: its wheel turns at 0.00 m/s of 0.40 m/s" in error.message
        assert error.limit == pytest.approx(2.376)


async def test_after_the_reset_the_robot_drives_again_with_its_motor_connected() -> None:
    async with running_robot(expect_errors=True) as robot:
        await robot.call("simulation.fault", kind="motor_open", part="front_left")
        assert isinstance(await robot.begin("drive.parallel", **STRAIGHT), DeviceFault)
        await robot.call("simulation.clear_faults")
        await robot.call("reset")
        await robot.call("drive.parallel", angle_deg=0.0, speed_m_s=0.4, duration_s=0.3)


@pytest.mark.parametrize(("pair", "angle_deg"), [("front", 30.0), ("front", -85.0), ("rear", 12.0)])
async def test_a_brake_that_does_not_open_stops_the_steering_by_its_motors_current(pair: str, angle_deg: float) -> None:
    async with running_robot(expect_errors=True) as robot:
        await robot.call("simulation.fault", kind="brake_stuck", part=pair)
        begun_s = asyncio.get_running_loop().time()
        error = await robot.begin("steer", pair=pair, angle_deg=angle_deg)
        assert asyncio.get_running_loop().time() - begun_s < 1.5
        assert isinstance(error, DeviceFault)
        assert f"({pair}_" in error.message
        assert "in vain" in error.message
        assert "brake" in (error.remedy or "")


async def test_a_person_who_turns_a_single_motor_knows_what_stands_against_it() -> None:
    async with running_robot() as robot:
        await robot.call("simulation.fault", kind="motor_blocked", part="front_left")
        await robot.call("motor.velocity", node=3, velocity_rpm=500.0, duration_s=1.0)
