"""Poses against closed forms."""

from __future__ import annotations

import cmath
import math

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from daemon.loops.geometry import solve_turning
from daemon.loops.measurement import Measurement
from daemon.loops.odometry import Odometry, Pose, moved_along_arc
from vcan_tests.daemon.paired_robot import GEOMETRY

Wheels = tuple[float, float, float, float]


def reading(travel: Wheels, rear: float, front: float) -> Measurement:
    return Measurement(time_s=0, wheel_speed_m_s=(0.0,) * 4, wheel_travel_m=travel, heading_rad=(rear, front))


def drive(odometry: Odometry, rear: float, front: float, speed: float, seconds: float, steps: int) -> Pose:
    """Roll each wheel at its computed speed in ``steps`` readings."""
    rolling = solve_turning(GEOMETRY, rear, front, speed).roll_speed_m_s
    for step in range(steps + 1):
        part = seconds * step / steps
        first, second, third, fourth = (part * roll for roll in rolling)
        odometry.update(reading((first, second, third, fourth), rear, front))
    return odometry.pose


def near(x: float, y: float, yaw: float, tolerance: float = 1e-9) -> object:
    return pytest.approx((x, y, yaw), abs=tolerance)


def as_tuple(pose: Pose) -> tuple[float, float, float]:
    return (pose.x_m, pose.y_m, pose.yaw_rad)


@pytest.mark.parametrize(
    ("angle_deg", "speed", "x", "y"), [(60, 0.5, 1.0, math.sqrt(3)), (0, -1.0, -4.0, 0.0), (-30, 0.5, math.sqrt(3), -1)]
)
def test_parallel_movement_ends_where_the_line_ends(angle_deg: float, speed: float, x: float, y: float) -> None:
    heading = math.radians(angle_deg)
    assert as_tuple(drive(Odometry(GEOMETRY), heading, heading, speed, 4.0, 20)) == near(x, y, 0)


@settings(deadline=None)
@given(st.floats(-1.2, 1.2), st.floats(-1.2, 1.2), st.floats(-1, 1), st.integers(10, 40))
def test_a_curve_is_followed_about_its_centre_of_rotation(rear: float, front: float, speed: float, steps: int) -> None:
    motion = solve_turning(GEOMETRY, rear, front, speed)
    assume(motion.icr_m is not None and 0.2 < motion.centre_radius_m < 1e4)
    assert motion.icr_m is not None
    pose = drive(Odometry(GEOMETRY), rear, front, speed, 1.0, steps)
    centre = complex(*motion.icr_m)
    end = centre - centre * cmath.exp(1j * motion.yaw_rate_rad_s)
    assert as_tuple(pose) == near(end.real, end.imag, motion.yaw_rate_rad_s, 1e-6)


def test_the_arc_does_not_depend_on_the_number_of_readings() -> None:
    few = drive(Odometry(GEOMETRY), 0.15, -0.3, 0.5, 2.0, 6)
    many = drive(Odometry(GEOMETRY), 0.15, -0.3, 0.5, 2.0, 600)
    assert as_tuple(few) == near(*as_tuple(many), 1e-9)


@given(st.floats(-1, 1), st.floats(-1, 1), st.floats(-3, 3))
def test_an_arc_and_its_reverse_end_where_they_began(forward: float, left: float, turn: float) -> None:
    away = moved_along_arc(Pose(1.0, 2.0, 0.5), forward, left, turn)
    assert as_tuple(moved_along_arc(away, -forward, -left, -turn)) == near(1.0, 2.0, 0.5)


def test_arcs_and_lines_meet_without_a_step() -> None:
    below, above = (moved_along_arc(Pose(), 1.0, 0.5, turn) for turn in (0.99e-6, 1.01e-6))
    assert as_tuple(below) == near(*as_tuple(above), 1e-7)


def test_turning_a_pair_does_not_move_the_robot() -> None:
    odometry = Odometry(GEOMETRY)
    for degree in range(61):
        angle = math.radians(degree)
        rim = GEOMETRY.contact_offset_m * angle
        odometry.update(reading((0.0, 0.0, -rim, rim), 0.0, angle))
    assert as_tuple(odometry.pose) == near(0, 0, 0)


def test_the_first_reading_only_sets_the_start() -> None:
    assert Odometry(GEOMETRY).update(reading((5.0, 5.0, 5.0, 5.0), 0.3, 0.3)) == Pose()


def test_a_reset_begins_at_the_given_pose() -> None:
    odometry = Odometry(GEOMETRY)
    drive(odometry, 0, 0, 1.0, 1.0, 10)
    odometry.reset(Pose(2.0, 1.0, math.pi / 2))
    odometry.update(reading((1.1, 1.1, 1.1, 1.1), 0, 0))
    assert as_tuple(odometry.pose) == near(2.0, 1.1, math.pi / 2)


@pytest.mark.parametrize("impossible", [40.0, math.nan])
def test_an_impossible_reading_is_skipped_and_counted(impossible: float) -> None:
    odometry = Odometry(GEOMETRY)
    odometry.update(reading((0, 0, 0, 0), 0, 0))
    odometry.update(reading((impossible, 0, 0, 0), 0, 0))
    assert odometry.pose == Pose()
    assert odometry.skipped == 1


def test_after_an_impossible_reading_the_odometry_goes_on() -> None:
    odometry = Odometry(GEOMETRY)
    for travel in (0.0, math.nan, 0.2, 0.3):
        odometry.update(reading((travel,) * 4, 0, 0))
    assert as_tuple(odometry.pose) == near(0.1, 0, 0)
