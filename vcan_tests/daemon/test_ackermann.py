"""The Ackermann car and its regulators."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from daemon.loops.ackermann import (
    AckermannGeometry,
    AckermannState,
    drive,
    mass_radius,
    turning_radius,
    wheel_angles,
    wheel_speeds,
)
from daemon.loops.pid import Pid, PidGains
from vcan_tests.daemon.vectors_ackermann import regulated, settle

CAR = AckermannGeometry(0.45, 0.35, 0.2, 0.1, 20.0, 50.0)
WIDE = AckermannGeometry(0.45, 1.0, 0.2, 0.1, 20.0, 50.0)
gammas = st.floats(0.01, math.pi / 4) | st.floats(-math.pi / 4, -0.01)
WOUND_UP = {
    "L": 0.45,
    "W": 0.35,
    "a": 0.2,
    "rw": 0.1,
    "alpha_max": 20.0,
    "omega_max": 100.0,
    "gains": {"Kp_theta": 1.5, "Ki_theta": 0.02, "Kd_theta": 0.05, "Kp_s": 2.0, "Ki_s": 0.1, "Kd_s": 0.0},
    "target_heading": -1.0,
    "target_speed": 2.0,
    "heading0": 1.0,
    "omega0": 0.0,
    "dt": 0.05,
    "T": 20.0,
}


@given(gammas)
def test_all_axles_point_to_one_centre(gamma: float) -> None:
    """The lines through the wheels' axles meet the rear axle at the centre of the turn."""
    centre = math.copysign(turning_radius(CAR, gamma), gamma)
    for angle, y in zip(wheel_angles(CAR, gamma), (CAR.track_m / 2, -CAR.track_m / 2), strict=True):
        assert y + CAR.wheelbase_m / math.tan(angle) == pytest.approx(centre)


@given(gammas)
def test_the_steering_angles_cotangent_is_the_mean_of_the_wheels(gamma: float) -> None:
    left, right = wheel_angles(CAR, gamma)
    assert (1 / math.tan(left) + 1 / math.tan(right)) / 2 == pytest.approx(1 / math.tan(gamma))


def test_straight_ahead_is_an_ordinary_case() -> None:
    assert wheel_angles(CAR, 0.0) == (0.0, 0.0)
    assert turning_radius(CAR, 0.0) == mass_radius(CAR, 0.0) == math.inf
    assert wheel_speeds(CAR, 0.0, 1.0) == (10.0, 10.0)


def test_an_inner_wheel_beyond_the_centre_of_the_turn_points_beyond_a_quarter_turn() -> None:
    left, right = wheel_angles(WIDE, math.radians(45))
    assert math.degrees(left) == pytest.approx(96.3, abs=0.05)
    assert wheel_angles(WIDE, -math.radians(45)) == (-right, -left)


def test_the_inner_wheel_does_not_turn_backwards() -> None:
    step = drive(WIDE, AckermannState(0.0, 5.0, 5.0), 0.0, math.radians(45), 0.05)
    assert (step.state.left_rad_s, step.state.right_rad_s) == (0.0, 5.0)


@given(gammas, st.floats(1.0, 40.0))
def test_the_wheels_speeds_are_those_of_the_rear_axle(gamma: float, outer: float) -> None:
    step = drive(CAR, AckermannState(0.0, outer, outer), 0.0, gamma, 0.05)
    speeds = wheel_speeds(CAR, gamma, step.axle_speed_m_s)
    assert (step.state.left_rad_s, step.state.right_rad_s) == pytest.approx(speeds)
    assert step.mass_speed_m_s / step.axle_speed_m_s == pytest.approx(
        mass_radius(CAR, gamma) / turning_radius(CAR, gamma)
    )


@given(gammas, st.floats(1.0, 40.0))
def test_the_heading_changes_by_the_difference_of_the_wheels(gamma: float, outer: float) -> None:
    state = drive(CAR, AckermannState(0.0, outer, outer), 0.0, gamma, 0.05).state
    turned = (state.right_rad_s - state.left_rad_s) * CAR.wheel_radius_m * 0.05 / CAR.track_m
    assert state.heading_rad == pytest.approx(turned)


def test_leaving_a_turn_raises_the_speed() -> None:
    """An erratum of the report: 4.13 takes over the outer wheel's speed, the car jumps by 1 + W / (2 R1)."""
    turning = drive(CAR, AckermannState(0.0, 10.0, 10.0), 0.0, 0.6, 0.05)
    straight = drive(CAR, turning.state, 0.0, 0.0, 0.05)
    assert straight.axle_speed_m_s / turning.axle_speed_m_s == pytest.approx(1.266, abs=0.001)


def test_turning_over_from_left_to_right_lowers_the_speed() -> None:
    left = drive(CAR, AckermannState(0.0, 10.0, 10.0), 0.0, 0.6, 0.05)
    right = drive(CAR, left.state, 0.0, -0.6, 0.05)
    assert right.axle_speed_m_s / left.axle_speed_m_s == pytest.approx(0.580, abs=0.001)


def test_throttle_and_steering_are_limited() -> None:
    step = drive(CAR, AckermannState(), 5.0, 2.0, 0.05)
    assert step.throttle_rad_s == 1.0
    assert step.state.right_rad_s == 1.0
    assert turning_radius(CAR, math.pi / 4) == pytest.approx(0.45)
    assert step.axle_speed_m_s == pytest.approx(0.1 * 0.45 / (0.45 + 0.175))


@given(st.floats(-100, 100), st.floats(0, 60), st.floats(-1, 1))
def test_no_wheel_leaves_its_range(throttle: float, speed: float, gamma: float) -> None:
    state = drive(CAR, AckermannState(0.0, speed, speed), throttle, gamma, 0.05).state
    assert 0 <= min(state.left_rad_s, state.right_rad_s) <= max(state.left_rad_s, state.right_rad_s) <= 50


def test_without_anti_windup_the_integral_keeps_the_car_from_settling() -> None:
    published = settle(WOUND_UP, regulated(WOUND_UP))
    ours = settle(WOUND_UP, regulated(WOUND_UP, anti_windup=True))
    assert published == pytest.approx(11.3)
    assert ours < published / 2


def test_the_terms_of_a_regulator_add_up() -> None:
    pid = Pid(PidGains(2.0, 0.5, 0.1), limit=100.0)
    assert pid.step(1.0, 0.1) == pytest.approx(2.0 + 0.5 * 0.1)
    assert pid.step(3.0, 0.1) == pytest.approx(6.0 + 0.5 * 0.4 + 0.1 * 20.0)


@pytest.mark.parametrize(("anti_windup", "integral"), [(True, 0.0), (False, 1.0)])
def test_an_integral_stands_still_while_it_would_only_press_on_the_limit(anti_windup: bool, integral: float) -> None:
    pid = Pid(PidGains(2.0, 0.5), 1.0, anti_windup)
    for _ in range(10):
        assert pid.step(1.0, 0.1) == 1.0
    assert pid.integral == pytest.approx(integral)


def test_an_integral_may_leave_the_limit() -> None:
    pid = Pid(PidGains(0.0, 1.0), limit=1.0)
    pid.integral = 5.0
    pid.step(-1.0, 0.1)
    assert pid.integral == pytest.approx(4.9)
