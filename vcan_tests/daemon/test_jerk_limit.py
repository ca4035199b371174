"""Motions with a limited jerk: never beyond it, all other limits kept, the goal reached exactly."""

from __future__ import annotations

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from daemon.loops.jerk_limit import JerkLimitedGuide, quickest_acceleration
from daemon.loops.omni_guide import Felt, Guidance
from daemon.loops.planner import PlanarLimits, PlanarState, Result
from daemon.loops.traction import Traction

DT = 0.01
LIMITS = PlanarLimits(1.2, 1.2, 1.5, 2.0)
ROUNDING = 1e-6
places = st.floats(-3, 3)
speeds = st.floats(-0.8, 0.8)
jerks = st.floats(0.5, 50)


def lead(guide: JerkLimitedGuide, start: PlanarState, steps: int = 6000) -> list[Guidance]:
    """The reference of a robot that follows exactly."""
    told: list[Guidance] = []
    state, acceleration = start, (0.0, 0.0)
    while len(told) < steps and (not told or told[-1].result is not Result.ARRIVED):
        told.append(guide.step(state, Felt(), acceleration, DT))
        state, acceleration = told[-1].next, told[-1].acceleration_m_s2
    return told


def largest_jerk(told: list[Guidance]) -> float:
    accelerations = [(0.0, 0.0), *(step.acceleration_m_s2 for step in told)]
    if told[-1].result is Result.ARRIVED:
        accelerations.append((0.0, 0.0))
    return max(math.dist(now, last) for now, last in zip(accelerations[1:], accelerations, strict=False)) / DT


@settings(max_examples=40)
@given(places, places, speeds, speeds, speeds, speeds, jerks)
def test_jerk_acceleration_and_speed_stay_within_their_limits(
    x: float, y: float, vx: float, vy: float, end_vx: float, end_vy: float, jerk: float
) -> None:
    told = lead(JerkLimitedGuide(PlanarState(x, y, vx=end_vx, vy=end_vy), LIMITS, jerk, DT), PlanarState(vx=vx, vy=vy))
    assert largest_jerk(told) <= jerk * (1 + ROUNDING)
    assert max(math.hypot(*step.acceleration_m_s2) for step in told) <= LIMITS.acceleration * (1 + ROUNDING)
    assert max(math.hypot(step.next.vx, step.next.vy) for step in told) <= LIMITS.speed * (1 + ROUNDING)


@settings(max_examples=40)
@given(places, places, st.floats(-3, 3), speeds, speeds, jerks)
def test_the_goal_is_reached_exactly(
    x: float, y: float, heading: float, end_vx: float, end_vy: float, jerk: float
) -> None:
    goal = PlanarState(x, y, heading, end_vx, end_vy)
    told = lead(JerkLimitedGuide(goal, LIMITS, jerk, DT), PlanarState())
    end, over_s = told[-1].next, 0.0
    assert told[-1].result is Result.ARRIVED
    if math.hypot(end_vx, end_vy) > 1e-3:
        over_s = ((end.x - x) * end_vx + (end.y - y) * end_vy) / (end_vx**2 + end_vy**2)
    assert -ROUNDING <= over_s <= 2.5 * DT
    assert (end.x - end_vx * over_s, end.y - end_vy * over_s) == pytest.approx((x, y), abs=2e-4)
    assert (end.heading, end.vx, end.vy) == pytest.approx((heading, end_vx, end_vy), abs=ROUNDING)


def test_planned_anew_in_mid_way_the_jerk_stays_within_its_limit() -> None:
    """A floor that grips for a quarter of what is commanded lowers the acceleration at once, and later again."""
    guide = JerkLimitedGuide(PlanarState(3.0, 1.0), LIMITS, 8.0, DT, Traction(LIMITS.acceleration))
    state, commanded, told = PlanarState(), (0.0, 0.0), []
    for _ in range(600):
        felt = Felt((0.25 * commanded[0], 0.25 * commanded[1]))
        told.append(guide.step(state, felt, commanded, DT))
        state, commanded = told[-1].next, told[-1].acceleration_m_s2
    assert len({step.safety_factor for step in told}) > 2
    assert largest_jerk(told) <= 8.0 * (1 + ROUNDING)


@pytest.mark.parametrize("jerk", [2.0, 8.0, 50.0])
def test_from_rest_to_rest_it_adds_no_more_than_its_window(jerk: float) -> None:
    way = 2.0
    told = lead(JerkLimitedGuide(PlanarState(way), LIMITS, jerk, DT), PlanarState())
    without = way / LIMITS.speed + LIMITS.speed / LIMITS.acceleration
    assert len(told) * DT <= without + 2 * LIMITS.acceleration / jerk + 3 * DT


def test_a_short_way_takes_less_than_with_all_of_the_acceleration() -> None:
    told = lead(JerkLimitedGuide(PlanarState(0.1), LIMITS, 2.0, DT), PlanarState())
    least = 4 * (0.1 / (2 * 2.0)) ** (1 / 3)
    assert least < len(told) * DT < 1.25 * least


@given(st.floats(0.01, 20), st.floats(0.2, 50))
def test_no_other_acceleration_takes_a_way_from_rest_to_rest_in_less_time(way: float, jerk: float) -> None:
    def time(acceleration: float) -> float:
        speed, window = LIMITS.speed, 2 * acceleration / jerk
        if acceleration * way <= speed * speed:
            return 2 * math.sqrt(way / acceleration) + window
        return way / speed + speed / acceleration + window

    best = time(quickest_acceleration(way, LIMITS, jerk))
    assert all(best <= time(part / 100 * LIMITS.acceleration) * (1 + 1e-9) for part in range(5, 101))


def test_the_time_left_runs_out_at_the_goal() -> None:
    told = lead(JerkLimitedGuide(PlanarState(1.0), LIMITS, 5.0, DT), PlanarState())
    assert told[0].eta_s == pytest.approx(len(told) * DT, abs=3 * DT)
    assert told[-1].eta_s < 3 * DT
