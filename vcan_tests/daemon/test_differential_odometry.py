"""Where a robot on two wheels is, by readings that come one after the other."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from daemon.loops.differential import DifferentialDrive
from daemon.loops.differential_odometry import MAX_TURN_RAD, DifferentialOdometry

DRIVE = DifferentialDrive(0.028, 0.0585)
PERIOD_S, LAG_S = 0.13, 0.06


def driven(right_rad_s: float, left_rad_s: float, rounds: int, left_first: bool = False) -> DifferentialOdometry:
    """Odometry of a robot at constant speeds whose second wheel is read a little later than its first."""
    odometry = DifferentialOdometry(DRIVE, (0.0, 0.0), left_first)
    for number in range(rounds + 1):
        first_s = number * PERIOD_S
        times = (first_s + LAG_S, first_s) if left_first else (first_s, first_s + LAG_S)
        odometry.update((right_rad_s * times[0], times[0]), (left_rad_s * times[1], times[1]))
    return odometry


@pytest.mark.parametrize("left_first", [False, True])
def test_wheels_that_are_read_at_different_times_make_no_turn(left_first: bool) -> None:
    """The first pair has no reading before it to interpolate from; so it counts the lag once."""
    odometry = driven(6.0, 6.0, 50, left_first)
    lag_rad = 6.0 * LAG_S * DRIVE.wheel_radius_m / (2 * DRIVE.half_track_m)
    assert abs(odometry.pose.yaw_rad) == pytest.approx(lag_rad)


@given(st.floats(-8, 8), st.floats(-8, 8))
def test_simultaneous_readings_give_the_arc(right: float, left: float) -> None:
    odometry = DifferentialOdometry(DRIVE, (0.0, 0.0))
    for number in range(11):
        time_s = 0.1 * number
        odometry.update((right * time_s, time_s), (left * time_s, time_s))
    forward, turn = DRIVE.body_motion(right, left)
    radius = forward / turn if abs(turn) > 1e-6 else math.inf
    x = radius * math.sin(turn) if math.isfinite(radius) else forward
    assert odometry.pose.x_m == pytest.approx(x, abs=1e-6)
    assert odometry.pose.yaw_rad == pytest.approx(turn, abs=1e-9)


def test_a_pair_counts_only_when_both_wheels_are_new_and_in_order() -> None:
    odometry = DifferentialOdometry(DRIVE, (0.0, 0.0))
    rounds = []
    for right, left in (((0, 0.0), (0, 0.1)), ((1, 0.2), (0, 0.1)), ((1, 0.2), (1, 0.3)), ((1, 0.4), (1, 0.35))):
        odometry.update(right, left)
        rounds.append(odometry.rounds)
    assert rounds == [1, 1, 2, 2]


def test_play_is_taken_up_before_the_robot_moves() -> None:
    odometry = DifferentialOdometry(DRIVE, (math.radians(4), math.radians(4)))
    for number in range(3):
        odometry.update((math.radians(number), number), (math.radians(number), number))
    assert odometry.pose.x_m == 0.0


def test_a_turn_that_cannot_be_is_skipped_and_counted() -> None:
    odometry = DifferentialOdometry(DRIVE, (0.0, 0.0))
    odometry.update((0.0, 0.0), (0.0, 0.0))
    odometry.update((2 * MAX_TURN_RAD, 1.0), (0.0, 1.0))
    assert (odometry.pose.yaw_rad, odometry.skipped) == (0.0, 1)
