"""Odometry of a truck: arcs are exact, what cannot be true is left out."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from daemon.loops.truck_odometry import TruckOdometry

WHEELBASE_M = 0.215


@given(st.floats(-0.5, 0.5), st.integers(1, 200), st.sampled_from([1.0, -1.0]))
def test_with_a_fixed_steering_angle_it_goes_round_one_centre(steering: float, steps: int, sense: float) -> None:
    odometry = TruckOdometry(WHEELBASE_M)
    for step in range(steps + 1):
        odometry.update(sense * 0.01 * step, steering)
    way, curvature = sense * 0.01 * steps, math.tan(steering) / WHEELBASE_M
    turned = way * curvature
    x = math.sin(turned) / curvature if abs(curvature) > 1e-9 else way
    y = (1 - math.cos(turned)) / curvature if abs(curvature) > 1e-9 else 0.0
    assert (odometry.pose.x_m, odometry.pose.y_m) == pytest.approx((x, y), abs=1e-6)
    assert odometry.pose.yaw_rad == pytest.approx(turned, abs=1e-9)


def test_the_first_reading_only_sets_the_start() -> None:
    odometry = TruckOdometry(WHEELBASE_M)
    assert odometry.update(123.0, 0.1).x_m == 0.0


def test_a_jump_of_the_wheel_is_left_out_and_counted() -> None:
    odometry = TruckOdometry(WHEELBASE_M)
    for travel in (0.0, 0.1, 50.0, 50.1):
        odometry.update(travel, 0.0)
    assert odometry.pose.x_m == pytest.approx(0.2)
    assert odometry.skipped == 1
