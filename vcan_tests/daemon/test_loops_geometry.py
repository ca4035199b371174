"""The kinematics of paired steering against a second derivation and the published numbers."""

from __future__ import annotations

import cmath
import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from daemon.loops.geometry import WHEELS_OF_PAIR, centre_of_rotation, contact_points, solve_turning
from vcan_tests.daemon.paired_robot import GEOMETRY

headings = st.floats(-1.48, 1.48)
speeds = st.floats(0.05, 1.5) | st.floats(-1.5, -0.05)


def axle_intersection(first: int, second: int, rear: float, front: float) -> tuple[float, float]:
    """Where the axle lines of two wheels meet, by linear algebra: heading . (point - contact) = 0 for both."""
    wheel_heading = (rear, rear, front, front)
    contact = np.array(contact_points(GEOMETRY, rear, front))
    normals = np.array([[math.cos(wheel_heading[w]), math.sin(wheel_heading[w])] for w in (first, second)])
    offsets = np.array([normals[row] @ contact[wheel] for row, wheel in enumerate((first, second))])
    x, y = np.linalg.solve(normals, offsets)
    return float(x), float(y)


@given(headings, headings)
def test_the_sides_turn_about_the_intersections_of_their_axles(rear: float, front: float) -> None:
    assume(abs(math.sin(rear - front)) > 1e-3)
    motion = solve_turning(GEOMETRY, rear, front, 1.0)
    assert motion.icr_right_m == pytest.approx(axle_intersection(0, 3, rear, front), rel=1e-7, abs=1e-9)
    assert motion.icr_left_m == pytest.approx(axle_intersection(1, 2, rear, front), rel=1e-7, abs=1e-9)


@given(headings, headings, speeds)
def test_wheel_velocities_are_those_of_a_rigid_body(rear: float, front: float, speed: float) -> None:
    """Turn the contact points about the ICR by a small angle, as complex numbers, and see how far they came."""
    motion = solve_turning(GEOMETRY, rear, front, speed)
    assume(motion.icr_m is not None and 0.05 < motion.centre_radius_m < 1e3)
    assert motion.icr_m is not None
    centre, dt = complex(*motion.icr_m), 1e-6
    for wheel in range(4):
        start = complex(*motion.contact_m[wheel])
        end = centre + (start - centre) * cmath.exp(1j * motion.yaw_rate_rad_s * dt)
        velocity = (end - start) / dt * cmath.exp(-1j * motion.heading_rad[wheel])
        assert motion.roll_speed_m_s[wheel] == pytest.approx(velocity.real, rel=1e-4, abs=1e-4)
        assert motion.lateral_speed_m_s[wheel] == pytest.approx(velocity.imag, rel=1e-4, abs=1e-4)


@given(headings, headings, speeds)
def test_the_centre_moves_at_the_asked_speed_along_the_mean_heading(rear: float, front: float, speed: float) -> None:
    motion = solve_turning(GEOMETRY, rear, front, speed)
    assume(motion.icr_m is not None and motion.centre_radius_m > 1e-3)
    assert motion.icr_m is not None
    x, y = motion.icr_m
    vx, vy = motion.yaw_rate_rad_s * y, -motion.yaw_rate_rad_s * x
    mean = (rear + front) / 2
    assert math.hypot(vx, vy) == pytest.approx(abs(speed), rel=1e-9)
    assert (vx * math.cos(mean) + vy * math.sin(mean)) * speed >= -1e-12


@given(headings, headings)
def test_sideways_slip_of_a_pairs_wheels_is_opposite(rear: float, front: float) -> None:
    motion = solve_turning(GEOMETRY, rear, front, 1.0)
    assume(motion.centre_radius_m > 1e-3)
    for first, second in WHEELS_OF_PAIR:
        total = motion.lateral_speed_m_s[first] + motion.lateral_speed_m_s[second]
        assert abs(total) < 1e-6 * max(1.0, abs(motion.yaw_rate_rad_s))


@given(headings, headings)
def test_a_mirrored_curve_has_mirrored_speeds(rear: float, front: float) -> None:
    assume(abs(math.sin(rear - front)) > 1e-6)
    left, right = solve_turning(GEOMETRY, rear, front, 1.0), solve_turning(GEOMETRY, -rear, -front, 1.0)
    assert right.yaw_rate_rad_s == pytest.approx(-left.yaw_rate_rad_s)
    one, two, three, four = left.roll_speed_m_s
    assert right.roll_speed_m_s == pytest.approx((two, one, four, three), abs=1e-9)


@given(st.floats(-1.48, 1.48), speeds)
def test_parallel_headings_roll_all_wheels_alike(heading: float, speed: float) -> None:
    motion = solve_turning(GEOMETRY, heading, heading, speed)
    assert motion.parallel
    assert motion.roll_speed_m_s == (speed,) * 4
    assert motion.yaw_rate_rad_s == 0


def test_a_nearly_parallel_curve_is_nearly_a_line() -> None:
    motion = solve_turning(GEOMETRY, -1e-8, 1e-8, 0.5)
    assert not motion.parallel
    assert motion.roll_speed_m_s == pytest.approx((0.5,) * 4, rel=1e-6)


@pytest.mark.parametrize(("alpha_12", "alpha_34", "radius"), [(-0.35, -0.35, 0.6699), (0.15, 0.3, 1.0275)])
def test_the_published_radii_are_reproduced(alpha_12: float, alpha_34: float, radius: float) -> None:
    """MAX2D thesis, figures 4.15 and 4.16."""
    assert solve_turning(GEOMETRY, alpha_12, -alpha_34, 0.5).published_radius_m == pytest.approx(radius, abs=5e-5)


def test_the_published_centre_of_rotation_is_reproduced() -> None:
    """MAX2D thesis, figure 4.13: alpha_12 = alpha_34 = -0.45 rad."""
    motion = solve_turning(GEOMETRY, -0.45, 0.45, 0.5)
    assert motion.icr_right_m == pytest.approx((0, 0.3173), abs=5e-5)
    assert motion.icr_left_m == pytest.approx((0, 0.6373), abs=5e-5)


def test_no_centre_of_rotation_can_stand_at_the_robots_centre() -> None:
    limit = math.radians(85)
    grid = np.linspace(-limit, limit, 69)
    centres = [centre_of_rotation(GEOMETRY, rear, front) for rear in grid for front in grid]
    assert min(math.hypot(*centre) for centre in centres if centre is not None) > 0.01


@pytest.mark.parametrize("heading", [math.pi / 2, -2.0, math.nan])
def test_headings_beyond_a_quarter_turn_are_an_error(heading: float) -> None:
    with pytest.raises(ValueError, match="quarter turn"):
        solve_turning(GEOMETRY, heading, 0.0, 0.5)
