"""The Turtle robot's planner as printed; call by call it is tested by the vectors, here by what it promises."""

from __future__ import annotations

import math
import random
from collections.abc import Iterator
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from daemon.loops import published_planner_axis
from daemon.loops.published_planner import (
    Branch,
    ControlledLimit,
    PlanningProblem,
    PublishedPlanner,
    Vector,
    feasible_final_velocity,
)
from daemon.loops.published_planner_axis import AxisCase, plan_axis
from vcan_tests.daemon.shortest_time import shortest_time
from vcan_tests.daemon.vectors_turtle import drive

State = tuple[float, float, float, float, float]

ANY = st.floats(allow_nan=True, allow_infinity=True)
REST = (0.0, 0.0)


def random_states(count: int, seed: int) -> Iterator[State]:
    """Distance, speed, final speed and limits of one axis; near goals and starts above the limit included."""
    pick = random.Random(seed)
    for _ in range(count):
        v_max, a_max = pick.uniform(0.2, 3), pick.uniform(0.3, 3)
        distance = pick.uniform(-3, 3) * pick.choice((1, 0.1, 0.02))
        speed = pick.uniform(-1, 1) * v_max * pick.choice((1, 1, 1.3))
        yield distance, speed, pick.choice((0, 1)) * pick.uniform(-0.8, 0.8) * v_max, v_max, a_max


def problem(
    offset: Vector, velocity: Vector = REST, final: Vector = REST, v_max: float = 1.0, a_max: float = 1.0
) -> PlanningProblem:
    return PlanningProblem(offset, velocity, final, v_max, a_max)


def test_with_point_windows_and_the_least_run_up_the_estimate_is_the_shortest_time(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(published_planner_axis, "POSITION_WINDOW_M", 1e-9)
    monkeypatch.setattr(published_planner_axis, "RUN_UP_FACTOR", 1.0)
    compared = 0
    for state in random_states(4000, seed=1):
        plan = plan_axis(*state)
        if plan.converged and plan.case is not AxisCase.CONVERGED:
            assert plan.eta_s == pytest.approx(shortest_time(*state), rel=1e-4), state
            compared += 1
    assert compared > 3600


def test_the_printed_run_up_costs_a_tenth_in_the_middle_and_a_fifth_at_most() -> None:
    states = [(plan_axis(*state), shortest_time(*state)) for state in random_states(6000, seed=2)]
    ratios = sorted(plan.eta_s / least for plan, least in states if plan.case is AxisCase.RUN_UP)
    assert ratios[len(ratios) // 2] == pytest.approx(1.105, abs=0.01)
    assert ratios[-1] < 1.2


def test_the_printed_windows_only_ever_shorten_the_estimate() -> None:
    for state in random_states(4000, seed=3):
        plan = plan_axis(*state)
        if plan.case is not AxisCase.RUN_UP:
            assert plan.eta_s <= shortest_time(*state) * (1 + 1e-6), state


@given(st.floats(0.01, 3), st.floats(-3, 3), st.floats(-2, 2), st.floats(0.2, 3), st.floats(0.3, 3))
def test_an_axis_and_its_mirror_image_take_the_same_time(
    distance: float, speed: float, final_speed: float, v_max: float, a_max: float
) -> None:
    plan = plan_axis(distance, speed, final_speed, v_max, a_max)
    mirrored = plan_axis(-distance, -speed, -final_speed, v_max, a_max)
    assert (mirrored.eta_s, mirrored.case) == (plan.eta_s, plan.case)


@pytest.mark.parametrize(
    ("state", "case"),
    [
        ((2.0, 0.0, 0.0), AxisCase.TO_TOP_SPEED),
        ((0.5, 0.0, 0.0), AxisCase.TO_PEAK),
        ((2.0, 1.0, 0.0), AxisCase.TOP_SPEED),
        ((0.4, 0.9, 0.0), AxisCase.BRAKE),
        ((2.0, 1.1, 0.0), AxisCase.TOO_FAST),
        ((0.1, 0.0, 0.8), AxisCase.RUN_UP),
        ((0.004, 0.001, 0.0), AxisCase.CONVERGED),
    ],
)
def test_each_case_is_found(state: tuple[float, float, float], case: AxisCase) -> None:
    assert plan_axis(*state, 1.0, 1.0).case is case


@pytest.mark.parametrize(
    ("state", "flag"),
    [
        ((2.0, 0.0, 0.0), 0),
        ((0.5, 1.0, 0.0), 1),
        ((-0.5, -1.0, 0.0), 2),
        ((0.3, 1.0, 0.0), 3),
        ((-0.3, -1.0, 0.0), 3),
    ],
    ids=["accelerates", "brakes in time", "brakes in time, mirrored", "overshoots", "overshoots, mirrored"],
)
def test_braking_sets_the_overshoot_flag_and_only_3_overshoots(state: tuple[float, float, float], flag: int) -> None:
    assert plan_axis(*state, 1.0, 1.0).overshoot == flag


def test_both_axes_arrive_at_the_same_time() -> None:
    planner = PublishedPlanner()
    step = planner.step(problem((-1.0, 3.0), v_max=2.0, a_max=2.0))
    cos, sin = math.cos(step.alpha_rad), math.sin(step.alpha_rad)
    etas = [plan_axis(-1.0, 0, 0, 2 * cos, 2 * cos).eta_s, plan_axis(3.0, 0, 0, 2 * sin, 2 * sin).eta_s]
    assert step.branch is Branch.SYNCHRONISED
    assert abs(etas[0] - etas[1]) <= 1e-3
    assert step.eta_s == pytest.approx(sum(etas) / 2)


def test_no_other_angle_arrives_earlier() -> None:
    offset, velocity = (2.0, -1.0), (0.3, 0.5)
    eta = PublishedPlanner().step(problem(offset, velocity)).eta_s
    for number in range(1, 500):
        cos, sin = math.cos(number * math.pi / 1000), math.sin(number * math.pi / 1000)
        x, y = (plan_axis(offset[n], velocity[n], 0.0, share, share).eta_s for n, share in enumerate((cos, sin)))
        assert max(x, y) >= eta - 1e-3


def test_the_angle_is_kept_for_the_next_call() -> None:
    planner = PublishedPlanner()
    first = planner.step(problem((1.0, 2.0)))
    again = planner.step(problem((1.0, 2.0)))
    assert first.bisections > 0
    assert (again.bisections, again.alpha_rad) == (0, first.alpha_rad)


def test_two_planners_share_nothing() -> None:
    PublishedPlanner().step(problem((0.1, 3.0)))
    assert PublishedPlanner().step(problem((0.001, 0.001))).alpha_rad == math.pi / 4


def test_the_keeper_has_the_whole_limits_on_each_axis() -> None:
    step = PublishedPlanner().step(PlanningProblem((1.0, -2.0), REST, REST, 2.0, 3.0, keeper=True))
    assert step.branch is Branch.UNSYNCHRONISED
    assert step.acceleration_m_s2 == (3.0, -3.0)


def test_an_axis_without_a_common_arrival_time_waits() -> None:
    step = PublishedPlanner().step(problem((0.4, 3.0), final=(0.7, 0.35)))
    assert step.branch is Branch.ONLY_Y_MOVES
    assert step.acceleration_m_s2[0] == 0
    assert step.cases == (None, AxisCase.TO_TOP_SPEED)


@pytest.mark.parametrize(
    ("offset", "speed", "branch"),
    [
        ((0.005, 0.005), 0.29, Branch.BOTH_CONVERGED),
        ((0.005, 0.006), 0.29, Branch.X_CONVERGED),
        ((0.006, 0.005), 0.29, Branch.Y_CONVERGED),
        ((0.005, 0.005), 0.3, Branch.SYNCHRONISED),
    ],
)
def test_an_axis_is_there_within_5_mm_and_0_3_m_s(offset: Vector, speed: float, branch: Branch) -> None:
    assert PublishedPlanner().step(problem(offset, (speed, speed))).branch is branch


@pytest.mark.parametrize(
    ("final", "v_max", "used"),
    [
        ((0.1, -0.14), 1.0, (0.0, 0.0)),
        ((0.15, -0.2), 1.0, (0.3, -0.3)),
        ((0.9, -1.2), 1.0, (0.48, -0.64)),
        ((0.4, 0.0), 0.35, (0.3, 0.0)),
    ],
    ids=["rounded to zero", "rounded up", "scaled to 0.8 v_max", "the least speed wins over 0.8 v_max"],
)
def test_final_velocities_are_made_feasible(final: Vector, v_max: float, used: Vector) -> None:
    assert feasible_final_velocity(final, v_max) == pytest.approx(used)


@pytest.mark.parametrize("v_max", [0.2, 0.3, 0.0, -1.0, math.nan, math.inf])
def test_what_the_listing_turns_into_nan_is_infeasible_and_brakes(v_max: float) -> None:
    step = PublishedPlanner().step(problem((1.0, 1.0), (0.3, -0.4), (0.2, 0.0), v_max))
    assert step.branch is Branch.INFEASIBLE
    assert step.acceleration_m_s2 == pytest.approx((-0.6, 0.8))
    assert step.eta_s == math.inf


def test_infeasible_braking_ends_at_rest() -> None:
    step = PublishedPlanner().step(problem((1.0, 1.0), (0.0003, -0.0004), (0.2, 0.0), 0.2))
    assert step.acceleration_m_s2 == pytest.approx((-0.3, 0.4))


@given(st.tuples(ANY, ANY), st.tuples(ANY, ANY), st.tuples(ANY, ANY), ANY, ANY, st.booleans())
def test_no_number_makes_it_raise(
    offset: Vector, velocity: Vector, final: Vector, v_max: float, a_max: float, keeper: bool
) -> None:
    planner, wild = PublishedPlanner(), PlanningProblem(offset, velocity, final, v_max, a_max, keeper)
    planner.step(wild)
    after = planner.step(problem((1.0, 1.0)))
    assert all(map(math.isfinite, (*after.acceleration_m_s2, after.eta_s)))


def test_an_estimate_that_does_not_converge_counts_as_zero_and_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(published_planner_axis, "POSITION_WINDOW_M", 1e-9)
    monkeypatch.setattr(published_planner_axis, "RUN_UP_FACTOR", 1.0)
    state = (0.13869560078453427, 0.8231074116123552, 1.1083060645805476, 2.151717789915399, 0.47549993443345606)
    plan = plan_axis(*state)
    assert (plan.eta_s, plan.converged) == (0.0, False)


def test_a_limit_too_small_to_be_shared_does_not_divide_by_zero() -> None:
    step = PublishedPlanner().step(problem((3.0, 1.0), v_max=5e-324, a_max=5e-324))
    assert math.hypot(*step.acceleration_m_s2) == pytest.approx(0)


def test_the_overshoot_flag_of_x_is_withheld_while_its_slip_is_answered() -> None:
    rushing = problem((0.3, 0.0), (1.0, 0.0))
    assert PublishedPlanner().step(rushing).overshoot == (3, 0)
    assert PublishedPlanner().step(rushing, ControlledLimit(0.5, 0.5, True)).overshoot == (0, 0)


def test_a_controlled_limit_is_shared_like_a_max() -> None:
    step = PublishedPlanner().step(problem((1.0, 1.0)), ControlledLimit(0.1, 0.1, True))
    assert math.hypot(*step.acceleration_m_s2) == pytest.approx(0.1)


def test_two_metres_straight_on_take_three_seconds_and_jump_to_twice_a_max_at_top_speed() -> None:
    given = {"goal": (2.0, 0.0), "p0": REST, "v0": REST, "v_max": 1.0, "a_max": 1.0}
    driven = drive(given, 3.2)
    accelerations = [step.acceleration_m_s2[0] for step in driven.steps]
    peak = max(accelerations)
    assert driven.steps[0].eta_s == pytest.approx(3.0)
    assert peak == pytest.approx(2.0)
    assert driven.steps[accelerations.index(peak)].cases[0] is AxisCase.TOP_SPEED
    assert all(before <= after + 1e-9 for before, after in pairwise(state.x for state in driven.states))
    assert driven.states[-1].x == pytest.approx(2.0, abs=1e-5)


def test_a_slower_cycle_arrives_too() -> None:
    x = vx = 0.0
    planner = PublishedPlanner(sample_time_s=0.01)
    for _ in range(320):
        (ax, _), dt = planner.step(problem((2.0 - x, 0.0), (vx, 0.0))).acceleration_m_s2, 0.01
        x, vx = x + vx * dt + ax * dt * dt / 2, vx + ax * dt
    assert x == pytest.approx(2.0, abs=0.005)
    assert vx == pytest.approx(0.0, abs=1e-6)
