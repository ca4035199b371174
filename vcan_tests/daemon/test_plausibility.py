"""Readings that contradict each other: each check on its own, and the whole simulated robot with the truth changed."""

from __future__ import annotations

import asyncio
import math

import msgspec
import pytest

from canhelm.errors import DeviceFault
from daemon import demo_ackermann, demo_max2d_path, demo_semitrailer, demo_turtle
from daemon.demo import FIGURES, Demo
from daemon.loops.motor_current import TIME_S
from daemon.loops.plausibility import AxisTurning, EncoderJumps, SteeredBy, Turning
from daemon.loops.plausibility_limits import encoder_rates_rad_s, jump_margins_rad, steered_axes, turning_limits_rad
from daemon.loops.wheels_and_body import wheel_limit_m
from daemon.runtime.clock import run_virtual
from profiles.loader import load
from profiles.plausibility import PlausibilityConfig
from profiles.schema import Profile
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
        driving = robot.begin("drive.parallel", angle_deg=0.0, speed_m_s=0.4, duration_s=10.0)
        await robot.until(lambda: robot.speed_m_s > 0.3)
        _let_jump(robot, "front", by_deg)
        assert await _time_to_fault(robot) <= CYCLES_TO_NOTICE * PERIOD_S + 1e-6
        error = await driving
        assert isinstance(error, DeviceFault)
        assert "node 6 (front) jumped" in error.message
        assert error.value == pytest.approx(abs(by_deg), abs=0.2)
        assert error.limit == pytest.approx(JUMP_LIMIT_DEG, abs=0.02)


@pytest.mark.parametrize("by_deg", [-20.0, 8.0])
async def test_a_jump_while_the_pair_turns_stops_it(by_deg: float) -> None:
    async with running_robot(expect_errors=True) as robot:
        turning = robot.begin("steer", pair="rear", angle_deg=60.0)
        await robot.until(lambda: robot.app.devices.encoders["rear"].heading_rad > 0.5)
        _let_jump(robot, "rear", by_deg)
        assert await _time_to_fault(robot) <= CYCLES_TO_NOTICE * PERIOD_S + 1e-6
        assert "node 5 (rear) jumped" in str(await turning)


@pytest.mark.parametrize(("name", "encoder"), [("ackermann", "steering_angle"), ("semitrailer", "bending_angle")])
async def test_a_jump_of_any_steered_vehicles_encoder_stops_it(name: str, encoder: str) -> None:
    async with running_robot(load(name).profile, expect_errors=True) as robot:
        robot.begin("drive.set", speed_m_s=0.2, steering_deg=0.0, valid_for_ms=9000)
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


# An axis that its wheels turn


@pytest.mark.parametrize(
    ("share", "found"),
    [(1.0, None), (0.75, None), (1.25, None), (0.0, Turning.STANDS), (-1.0, Turning.AGAINST), (0.5, Turning.OFF)],
)
def test_an_encoder_has_to_turn_about_as_much_as_its_wheels_turn_its_axis(share: float, found: Turning | None) -> None:
    check = AxisTurning(0.05)
    turned = [check.look(share * way / 100, way / 100, 0.01) for way in range(100)]
    assert next((how for result in turned if result for how in [result[0]]), None) is found


def test_what_turns_with_its_wheels_against_the_command_is_found_after_the_limit() -> None:
    check = AxisTurning(0.05)
    turned = [check.look(-way / 1000, -way / 1000, 0.001) for way in range(100)]
    first, found = next((index, result) for index, result in enumerate(turned) if result)
    assert found[0] is Turning.AGAINST
    assert found[1:] == pytest.approx((first / 1000, 0.05 + 0.3 * first / 1000))
    assert first / 1000 == pytest.approx(0.05 / 0.7, abs=0.001)


def test_slow_slip_does_not_add_up_over_a_long_way() -> None:
    check = AxisTurning(0.05)
    assert not any(check.look(0.8 * way / 100, way / 100, 0.01) for way in range(10_000))


def test_a_pair_turns_by_half_the_difference_of_its_wheels_over_the_arm() -> None:
    rear, front = steered_axes(load("max2d").profile)
    assert rear.angle((0.075, -0.075, 0.0, 0.0)) == pytest.approx(1.0)
    assert front.angle((9.0, 9.0, -0.075, 0.075)) == pytest.approx(1.0)
    assert rear.angle((0.075, 0.075, 0.0, 0.0)) == pytest.approx(0.0)


def test_a_steered_axle_turns_by_its_own_drive() -> None:
    (axle,) = steered_axes(load("ackermann").profile)
    arm_m = load("ackermann").profile.drives["steering"].wheel_radius_m
    assert axle == SteeredBy(0, ((2, 1 / arm_m),))


async def _steering_fault(robot: Robot, kind: str, begin_deg: float, goal_deg: float) -> tuple[DeviceFault, float]:
    """Steer the front pair with a broken encoder; the fault, and the true angle by which it turned until it rested."""
    if begin_deg:
        await robot.call("steer", pair="front", angle_deg=begin_deg)
    await robot.call("simulation.fault", kind=kind, part="front")
    await asyncio.sleep(0.1)
    before_rad = robot.network.world.heading_rad("front")
    steering = robot.begin("steer", pair="front", angle_deg=goal_deg)
    await _time_to_fault(robot)
    error = await steering
    assert isinstance(error, DeviceFault)
    return error, abs(math.degrees(robot.network.world.heading_rad("front") - before_rad))


@pytest.mark.parametrize(("begin_deg", "goal_deg"), [(0.0, 8.0), (0.0, -60.0), (30.0, 85.0), (30.0, -85.0)])
async def test_an_encoder_that_stands_stops_its_pair_within_twelve_degrees(begin_deg: float, goal_deg: float) -> None:
    async with running_robot(expect_errors=True) as robot:
        error, turned_deg = await _steering_fault(robot, "encoder_stuck", begin_deg, goal_deg)
        assert "node 6 (front) stands while its wheels turn its axis" in error.message
        assert turned_deg < 12.0


@pytest.mark.parametrize("goal_deg", [6.0, 30.0, -85.0])
async def test_a_pair_that_turns_against_its_command_stops_within_eight_degrees(goal_deg: float) -> None:
    async with running_robot(expect_errors=True) as robot:
        error, turned_deg = await _steering_fault(robot, "encoder_reversed", 0.0, goal_deg)
        assert "node 6 (front) turns against its command" in error.message
        assert turned_deg < 8.0


@pytest.mark.parametrize("name", ["ackermann", "semitrailer"])
@pytest.mark.parametrize(("kind", "says"), [("encoder_stuck", "stands"), ("encoder_reversed", "against its command")])
async def test_a_steered_axle_with_a_broken_encoder_stops_the_vehicle(name: str, kind: str, says: str) -> None:
    async with running_robot(load(name).profile, expect_errors=True) as robot:
        await robot.call("simulation.fault", kind=kind, part="steering_angle")
        await asyncio.sleep(0.1)
        robot.begin("drive.set", speed_m_s=0.2, steering_deg=20.0, valid_for_ms=9000)
        await _time_to_fault(robot)
        turned_deg = math.degrees(robot.network.world.heading_rad("steering_angle"))
        assert "steering_angle" in robot.app.supervisor.message
        assert says in robot.app.supervisor.message
        assert abs(turned_deg) < 20.0


async def test_a_person_who_turns_a_single_motor_is_not_stopped() -> None:
    async with running_robot(load("ackermann").profile) as robot:
        await robot.call("simulation.fault", kind="encoder_reversed", part="steering_angle")
        await robot.call("motor.velocity", node=3, velocity_rpm=500.0, duration_s=1.0)
        assert abs(robot.network.world.heading_rad("steering_angle")) > math.radians(10.0)


async def test_after_the_reset_the_robot_drives_again_with_the_encoder_mended() -> None:
    async with running_robot(expect_errors=True) as robot:
        await _steering_fault(robot, "encoder_stuck", 0.0, 30.0)
        assert "that is gone" not in robot.app.supervisor.message
        await robot.call("simulation.clear_faults")
        await robot.call("reset")
        await robot.call("steer", pair="front", angle_deg=10.0)
        assert math.degrees(robot.network.world.heading_rad("front")) == pytest.approx(10.0, abs=0.2)


# No false alarm


def halved(name: str) -> Profile:
    """A robot with limits of half the size, so that what drives it in peace has a margin of two."""
    profile = load(name).profile
    encoders = tuple(profile.encoders)[: len(encoder_rates_rad_s(profile))]
    off_deg, jump_deg = (
        0.5 * math.degrees(min(limits(profile, encoders), default=math.radians(1.0)))
        for limits in (turning_limits_rad, jump_margins_rad)
    )
    wheel_m = 0.5 * wheel_limit_m(profile)
    config = PlausibilityConfig(
        encoder_jump_deg=jump_deg, encoder_off_deg=off_deg, wheel_off_m=wheel_m, current_s=0.5 * TIME_S
    )
    return msgspec.structs.replace(profile, plausibility=config)


def test_max2d_drives_its_figures_in_peace_with_half_the_limits() -> None:
    assert len(run_virtual(Demo(halved("max2d"), 5, None, lambda _: None).run(FIGURES))) == len(FIGURES)


def test_max2d_follows_its_path_in_peace_with_half_the_limits() -> None:
    assert run_virtual(demo_max2d_path.drive(halved("max2d"), 5, None, lambda _: None)).numbers


@pytest.mark.parametrize("step", demo_ackermann.FIGURES, ids=lambda step: str(step.identity))
def test_the_car_drives_its_steps_in_peace_with_half_the_limits(step: demo_ackermann.CarStep) -> None:
    result = run_virtual(demo_ackermann.run(halved("ackermann"), step, 5, None, lambda _: None))
    assert result.numbers["achieved"]["settling_s"] is not None


@pytest.mark.parametrize("figure", demo_semitrailer.figures(), ids=lambda figure: str(figure.identity))
def test_the_semitrailer_follows_its_paths_in_peace_with_half_the_limits(figure: demo_semitrailer.Manoeuvre) -> None:
    result = run_virtual(demo_semitrailer.drive(halved("semitrailer"), figure, 5, None, lambda _: None))
    assert result.numbers["achieved"]


@pytest.mark.parametrize("figure", demo_turtle.FIGURES, ids=lambda figure: str(figure.identity))
def test_the_turtle_drives_its_figures_in_peace_with_half_the_limits(figure: demo_turtle.TurtleFigure) -> None:
    result = run_virtual(demo_turtle.drive(halved("turtle"), figure, 5, None, lambda _: None))
    assert result.numbers["achieved"]


# A battery near its end


async def test_under_voltage_of_any_drive_stops_the_robot_by_name() -> None:
    async with running_robot(expect_errors=True) as robot:
        driving = robot.begin("drive.parallel", angle_deg=0.0, speed_m_s=0.4, duration_s=10.0)
        await robot.until(lambda: robot.speed_m_s > 0.3)
        await robot.call("simulation.fault", kind="emcy", part="rear_left", code=0x3220)
        assert await _time_to_fault(robot) <= CYCLES_TO_NOTICE * PERIOD_S + 1e-6
        error = await driving
        assert isinstance(error, DeviceFault)
        assert "node 2 (rear_left) reports under-voltage" in error.message
        assert error.value == 0x3220
