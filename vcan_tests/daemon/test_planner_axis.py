from __future__ import annotations

import math

import pytest
import ruckig
from hypothesis import assume, given
from hypothesis import strategies as st

from daemon.loops.planner_axis import AxisPlan, fastest, in_time, with_a_rest

TRAVEL = st.floats(-3, 3)
PART = st.floats(-1, 1, allow_subnormal=False).map(lambda part: part if abs(part) > 1e-9 else 0.0)
LIMIT = st.floats(0.2, 3)


def _peak(plan: AxisPlan) -> float:
    times = [0.0]
    for duration, _ in plan.pieces:
        times.append(times[-1] + duration)
    return max(abs(plan.at(time)[1]) for time in times)


@given(TRAVEL, PART, PART, LIMIT, LIMIT)
def test_the_fastest_way_takes_as_long_as_ruckigs(
    travel: float, start: float, end: float, limit: float, acceleration: float
) -> None:
    direct = (start + end) / 2 * abs(end - start) * limit * limit / acceleration
    assume(abs(travel - direct) > 1e-6)
    problem = ruckig.InputParameter(1)
    problem.current_velocity, problem.target_velocity = [start * limit], [end * limit]
    problem.target_position = [travel]
    problem.max_velocity, problem.max_acceleration, problem.max_jerk = [limit], [acceleration], [math.inf]
    trajectory = ruckig.Trajectory(1)
    ruckig.Ruckig(1).calculate(problem, trajectory)
    plan = fastest(travel, start * limit, end * limit, limit, acceleration)
    assert plan.duration == pytest.approx(trajectory.duration, abs=1e-6)


@given(TRAVEL, st.floats(-3, 3), PART, LIMIT, LIMIT)
def test_the_fastest_way_ends_where_and_as_fast_as_it_shall(
    travel: float, start: float, end: float, limit: float, acceleration: float
) -> None:
    plan = fastest(travel, start, end * limit, limit, acceleration)
    assert plan.at(plan.duration) == pytest.approx((travel, end * limit), abs=1e-9)
    assert _peak(plan) <= max(limit, abs(start)) + 1e-9


@given(TRAVEL, PART, PART, LIMIT, LIMIT, st.floats(1.0, 10.0))
def test_a_way_in_a_given_time_takes_this_time_and_keeps_the_limits(
    travel: float, start: float, end: float, limit: float, acceleration: float, longer: float
) -> None:
    duration = fastest(travel, start * limit, end * limit, limit, acceleration).duration * longer
    plan = in_time(travel, start * limit, end * limit, limit, acceleration, duration)
    if plan is not None:
        assert plan.duration == pytest.approx(duration, abs=1e-9)
        assert plan.at(duration) == pytest.approx((travel, end * limit), abs=1e-9)
        assert _peak(plan) <= limit + 1e-9
        assert all(abs(rate) <= acceleration * (1 + 1e-9) for _, rate in plan.pieces)


def test_from_rest_to_rest_any_longer_time_is_possible() -> None:
    assert all(in_time(1.0, 0.0, 0.0, 1.0, 1.0, 2.0 + k / 4) is not None for k in range(40))


def test_a_moving_axis_cannot_wait_without_a_rest() -> None:
    assert in_time(0.1, 1.0, 1.0, 1.0, 1.0, 0.5) is None
    plan = with_a_rest(0.1, 1.0, 1.0, 1.0, 1.0, 9.0)
    assert plan.duration == pytest.approx(9.0)
    assert plan.at(9.0) == pytest.approx((0.1, 1.0))
