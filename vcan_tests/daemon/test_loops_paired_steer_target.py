"""What a paired-steer robot is refused, and how requests become targets."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from canhelm.errors import LimitExceeded, UsageError
from daemon.loops.geometry import solve_turning
from daemon.loops.paired_steer_target import (
    PairedSteerTarget,
    check_target,
    direction_target,
    parallel_target,
    steer_target,
    turn_target,
    turning_warnings,
    why_not_rotate,
)
from vcan_tests.daemon.paired_robot import GEOMETRY, LIMITS


def refusal(target: PairedSteerTarget) -> LimitExceeded:
    with pytest.raises(LimitExceeded) as caught:
        check_target(GEOMETRY, LIMITS, target)
    return caught.value


@pytest.mark.parametrize(
    "target",
    [
        parallel_target(math.radians(60), 0.5, 4),
        parallel_target(0, -1, 4),
        turn_target(-0.35, 0.35, 0.5, 4),
        turn_target(0.15, -0.3, 1.0, 4),
        steer_target(1, math.radians(85)),
        direction_target(math.radians(-100), 1.2),
    ],
)
def test_the_published_manoeuvres_are_permitted(target: PairedSteerTarget) -> None:
    check_target(GEOMETRY, LIMITS, target)


def test_a_heading_beyond_the_limit_is_refused_with_limit_and_stops() -> None:
    error = refusal(steer_target(1, math.radians(95)))
    assert "95 deg for the front pair" in error.message
    assert error.limit == "heading_deg 85"
    assert "88 deg" in error.message


def test_a_speed_beyond_the_limit_is_refused_with_the_limit() -> None:
    error = refusal(parallel_target(0, 1.5, 1))
    assert error.limit == "speed_m_s 1.2"


def test_a_wheel_beyond_its_limit_is_refused_with_the_possible_speed() -> None:
    error = refusal(turn_target(-0.6, 0.6, 1.2, 1))
    assert "fastest wheel" in error.message
    possible = float(str(error.remedy).split("at most ")[1].split()[0])
    check_target(GEOMETRY, LIMITS, turn_target(-0.6, 0.6, possible, 1))


def test_a_request_exactly_at_the_limits_is_permitted() -> None:
    check_target(GEOMETRY, LIMITS, parallel_target(math.radians(85), 1.2, 1))


@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_numbers_that_are_not_finite_are_refused(bad: float) -> None:
    for target in (steer_target(0, bad), parallel_target(0, bad, 1), parallel_target(0, 0.5, bad)):
        with pytest.raises(UsageError):
            check_target(GEOMETRY, LIMITS, target)


def test_a_negative_distance_is_refused() -> None:
    with pytest.raises(UsageError, match="negative"):
        check_target(GEOMETRY, LIMITS, parallel_target(0, 0.5, -1))


def test_driving_with_one_heading_only_is_refused() -> None:
    with pytest.raises(UsageError, match="both pairs"):
        check_target(GEOMETRY, LIMITS, PairedSteerTarget(0.1, None, 0.5, 1.0))


@given(st.floats(-7, 7), st.floats(0.1, 1))
def test_a_direction_is_driven_where_it_points(direction: float, speed: float) -> None:
    target = direction_target(direction, speed)
    assert target.rear_heading_rad is not None
    assert target.front_heading_rad == target.rear_heading_rad
    assert abs(target.rear_heading_rad) <= math.pi / 2 + 1e-12
    assert target.speed_m_s * math.cos(target.rear_heading_rad) == pytest.approx(speed * math.cos(direction), abs=1e-9)
    assert target.speed_m_s * math.sin(target.rear_heading_rad) == pytest.approx(speed * math.sin(direction), abs=1e-9)


def test_sideways_is_refused_because_of_the_stops() -> None:
    assert "beyond the limit" in refusal(direction_target(math.radians(90), 0.5)).message


def test_a_backward_turn_has_a_positive_distance() -> None:
    assert turn_target(0.1, -0.1, -0.5, 2).distance_m == 1.0


def test_gentle_curves_have_no_warning() -> None:
    assert turning_warnings(GEOMETRY, solve_turning(GEOMETRY, -0.35, 0.35, 1)) == ()


def test_sharp_curves_are_warned_of() -> None:
    (warning,) = turning_warnings(GEOMETRY, solve_turning(GEOMETRY, -0.5, 0.5, 1))
    assert "beyond 26 deg" in warning


def test_a_centre_inside_the_track_is_warned_of() -> None:
    assert any("inside the track" in text for text in turning_warnings(GEOMETRY, solve_turning(GEOMETRY, -1, 1, 1)))


def test_oblique_driving_with_large_headings_is_not_a_sharp_curve() -> None:
    assert turning_warnings(GEOMETRY, solve_turning(GEOMETRY, 0.75, 0.8, 1)) == ()


def test_rotation_is_refused_with_the_reason() -> None:
    assert "coupled" in why_not_rotate()
