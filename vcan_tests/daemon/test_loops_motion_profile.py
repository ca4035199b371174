"""Ramps and braking curves."""

from __future__ import annotations

import math
from itertools import pairwise

from hypothesis import given
from hypothesis import strategies as st

from daemon.loops.motion_profile import approach_speed, ramp, speed_to_end

DT = 0.01
ways = st.floats(-5, 5)
limits = st.floats(0.05, 2)
accelerations = st.floats(0.1, 3)
starts = st.floats(-1, 1)


def speeds_to_rest(way: float, limit: float, acceleration: float, start: float = 0.0) -> list[float]:
    speeds = [start]
    while not (abs(way) < 1e-9 and speeds[-1] == 0):
        speeds.append(speed_to_end(speeds[-1], limit, acceleration, way, DT))
        way -= speeds[-1] * DT
        assert len(speeds) < 50_000, "does not come to rest"
    return speeds


@given(ways, limits, accelerations, starts)
def test_the_way_is_covered_exactly(way: float, limit: float, acceleration: float, start: float) -> None:
    speeds = speeds_to_rest(way, limit, acceleration, start)
    assert math.isclose(sum(speeds[1:]) * DT, way, abs_tol=1e-8)


@given(ways, limits, accelerations, starts)
def test_the_speed_changes_within_the_acceleration(way: float, limit: float, acceleration: float, start: float) -> None:
    speeds = speeds_to_rest(way, limit, acceleration, start)
    assert all(abs(b - a) <= acceleration * DT * (1 + 1e-9) for a, b in pairwise(speeds))


@given(ways, limits, accelerations)
def test_from_rest_the_speed_stays_within_the_limit(way: float, limit: float, acceleration: float) -> None:
    assert max(map(abs, speeds_to_rest(way, limit, acceleration))) <= limit * (1 + 1e-12)


@given(ways, limits, accelerations)
def test_from_rest_the_way_is_never_overrun(way: float, limit: float, acceleration: float) -> None:
    speeds = speeds_to_rest(way, limit, acceleration)
    assert all(speed * math.copysign(1, way) > -1e-9 for speed in speeds)


def test_a_long_way_takes_the_time_of_a_trapezoid() -> None:
    speeds = speeds_to_rest(2.0, 0.5, 0.8)
    assert math.isclose(len(speeds) * DT, 2.0 / 0.5 + 0.5 / 0.8, abs_tol=0.05)


def test_a_ramp_ends_at_the_wanted_speed() -> None:
    assert ramp(0.499, 0.5, 0.8, DT) == 0.5


@given(st.floats(0, 1), st.floats(1e-6, 0.1))
def test_the_approach_grows_with_the_error(error: float, more: float) -> None:
    assert approach_speed(error + more, 6, 0.4) > approach_speed(error, 6, 0.4)


def test_the_approach_has_no_step_at_its_knee() -> None:
    knee = 0.4 / 36
    assert math.isclose(approach_speed(knee, 6, 0.4), approach_speed(knee * (1 + 1e-9), 6, 0.4), rel_tol=1e-8)
