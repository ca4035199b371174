from __future__ import annotations

import cmath
import math
import random
from dataclasses import astuple, replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from daemon.loops.planner import NEAR_M, PlanarLimits, PlanarState, Result, Tolerance, follow, plan_motion
from daemon.loops.planner_arcs import Arc, Bend, Ramp, Slide, chain
from daemon.loops.planner_bend import bend_between, keeps_limit
from daemon.loops.planner_paths import fastest_way, misses, stop_and_go
from vcan_tests.daemon.planner_problems import Problem, drive, miss_m, miss_m_s, moved, random_problems

LIMITS = PlanarLimits(speed=1.0, acceleration=1.0, rate=2.0, angular_acceleration=3.0)
REST = PlanarState()
SEED = 20
CYCLE_S = 0.01
ROUNDING = 1e-9


@pytest.mark.parametrize("problem", random_problems(60, SEED), ids=lambda problem: f"seed {SEED}")
def test_a_motion_ends_at_its_goal_and_keeps_every_limit(problem: Problem) -> None:
    plan = plan_motion(problem.start, problem.goal, problem.limits)
    end = drive(plan, CYCLE_S)
    assert end.result is Result.ARRIVED
    assert end.plans == 1
    assert miss_m(end.state, problem.goal) < 2e-4
    assert miss_m_s(end.state, problem.goal) < ROUNDING
    assert max(end.over_speed, end.over_acceleration, end.over_rate, end.over_angular) < ROUNDING


@pytest.mark.parametrize(("way", "seconds"), [(2.0, 3.0), (1.0, 2.0), (0.25, 1.0)])
def test_from_rest_to_rest_takes_the_least_time(way: float, seconds: float) -> None:
    goal = PlanarState(way * math.cos(2.0), way * math.sin(2.0))
    assert plan_motion(REST, goal, LIMITS).ends == pytest.approx(seconds, rel=1e-12)


# Travel, start and end velocity in units of the limits; the shape; the least time by a second-order cone program of 400
# intervals, which is above the true one by some 1e-5.
OPTIMA: list[tuple[tuple[float, float], tuple[float, float], tuple[float, float], str, float]] = [
    ((2.0, 1.0), (0.0, 0.9), (0.0, 0.0), "turns", 3.05447),
    ((3.0, 0.5), (-0.6, 0.7), (0.3, -0.5), "turns", 4.56389),
    ((4.0, -3.0), (-0.8, -0.6), (0.0, 0.8), "turns", 6.99530),
    ((0.3, -0.2), (0.4, 0.5), (0.0, 0.0), "bend", 1.67259),
    ((-0.5, 0.2), (0.1, -0.3), (0.2, 0.4), "bend", 1.80898),
    ((0.0, 0.0), (0.5, 0.5), (-0.3, 0.1), "bend", 1.62624),
    ((1.0, 0.8), (0.8, -0.4), (-0.2, 0.6), "bend", 1.97590),
    ((1.3, 0.4), (0.1, 0.9), (0.3, -0.6), "bend", 2.13525),
    ((1.2, 0.0), (0.3, 0.8), (0.3, 0.7), "bend", 3.02796),
]


@pytest.mark.parametrize(("travel", "start", "end", "shape", "least"), OPTIMA)
def test_the_time_is_that_of_the_optimum(
    travel: tuple[float, float], start: tuple[float, float], end: tuple[float, float], shape: str, least: float
) -> None:
    found, way = fastest_way(complex(*travel), complex(*start), complex(*end))
    assert found == shape
    assert way.duration == pytest.approx(least, rel=5e-5)


@pytest.mark.parametrize("speed", [0.001, 0.05, 0.2999, 0.3, 0.4243])
@pytest.mark.parametrize("end", [0.0, 0.8, 1.0])
def test_a_robot_with_a_low_speed_limit_arrives(speed: float, end: float) -> None:
    limits = replace(LIMITS, speed=speed)
    goal = PlanarState(0.1, 0.1, vx=0.0, vy=speed * end)
    final = drive(plan_motion(REST, goal, limits), CYCLE_S)
    assert final.result is Result.ARRIVED
    assert max(final.over_speed, final.over_acceleration) < ROUNDING


def test_a_goal_may_change_during_any_arc() -> None:
    first = plan_motion(PlanarState(vx=0.0, vy=0.7), PlanarState(3.0, 0.0, vx=0.0, vy=-0.5), LIMITS)
    for tenth in range(11):
        now = tenth * first.ends / 10
        goal = PlanarState(-1.0, 2.0, 1.0, 0.2, 0.1)
        end = drive(plan_motion(first.at(now), goal, LIMITS, now), CYCLE_S)
        assert end.result is Result.ARRIVED
        assert miss_m(end.state, goal) < 2e-4
        assert max(end.over_speed, end.over_acceleration) < ROUNDING


def test_planning_anew_on_the_way_does_not_put_off_the_arrival() -> None:
    for problem in random_problems(40, SEED):
        plan = plan_motion(problem.start, problem.goal, problem.limits)
        for part in (0.2, 0.5, 0.8, 0.95):
            now = plan.ends * part
            assert plan_motion(plan.at(now), problem.goal, problem.limits, now).ends <= plan.ends * 1.03


def test_planning_anew_in_every_cycle_arrives_at_rest_in_time() -> None:
    for problem in random_problems(20, SEED)[::2]:
        state, now = problem.start, 0.0
        plan = plan_motion(state, problem.goal, problem.limits)
        latest = plan.ends * 1.02 + CYCLE_S
        while plan.ends > now + CYCLE_S and now < latest:
            step = follow(plan, now, state, CYCLE_S)
            state = moved(state, step.acceleration_m_s2, step.angular_acceleration_rad_s2, CYCLE_S)
            now += CYCLE_S
            plan = plan_motion(state, problem.goal, problem.limits, now)
        assert plan.ends < latest
        assert miss_m(plan.at(plan.ends), problem.goal) < 2 * NEAR_M


def test_a_body_pushed_off_its_plan_gets_a_new_one() -> None:
    goal = PlanarState(2.0, 1.0)
    plan = plan_motion(REST, goal, LIMITS)
    pushed = replace(plan.at(0.5), y=0.5, vx=-0.2)
    step = follow(plan, 0.5, pushed, CYCLE_S)
    assert step.plan is not plan
    assert step.plan.goal == goal
    assert step.result is Result.MOVING
    assert drive(step.plan, CYCLE_S).result is Result.ARRIVED


def test_a_body_within_the_tolerance_keeps_its_plan() -> None:
    plan = plan_motion(REST, PlanarState(2.0, 1.0), LIMITS)
    near = replace(plan.at(0.5), y=plan.at(0.5).y + 0.009)
    assert follow(plan, 0.5, near, CYCLE_S).plan is plan
    assert follow(plan, 0.5, near, CYCLE_S, Tolerance(distance_m=0.008)).plan is not plan


@pytest.mark.parametrize("velocity", [(0.0, 0.0), (0.3, -0.6)])
@pytest.mark.parametrize("heading", [3.0, 0.1])
def test_place_and_heading_are_reached_together(velocity: tuple[float, float], heading: float) -> None:
    limits = replace(LIMITS, rate=0.5, angular_acceleration=0.5)
    goal = PlanarState(1.0, 0.5, heading, 0.1, 0.2)
    plan = plan_motion(PlanarState(vx=velocity[0], vy=velocity[1], rate=0.1), goal, limits)
    assert plan.turn.duration == pytest.approx(plan.way.duration, rel=1e-8)
    end = drive(plan, CYCLE_S)
    assert miss_m(end.state, goal) < 2e-4
    assert end.state.heading == pytest.approx(heading, abs=1e-4)
    assert max(end.over_speed, end.over_acceleration, end.over_rate, end.over_angular) < ROUNDING


def test_a_turn_on_the_spot_lasts_as_long_as_the_turn() -> None:
    plan = plan_motion(REST, PlanarState(heading=1.0), replace(LIMITS, rate=1.0, angular_acceleration=1.0))
    assert plan.ends == pytest.approx(2.0)
    assert drive(plan, CYCLE_S).result is Result.ARRIVED


def test_the_heading_turns_the_shorter_way_round() -> None:
    plan = plan_motion(PlanarState(heading=3.0), PlanarState(heading=-3.0), LIMITS)
    assert plan.at(plan.ends).heading == pytest.approx(math.tau - 3.0)


def test_a_turn_that_cannot_last_as_long_as_the_way_rests_in_between() -> None:
    goal = PlanarState(2.0, 0.0, 0.3, rate=1.0)
    end = drive(plan_motion(PlanarState(rate=1.0), goal, LIMITS), CYCLE_S)
    assert end.state.heading == pytest.approx(0.3, abs=1e-4)
    assert end.state.rate == pytest.approx(1.0)
    assert max(end.over_rate, end.over_angular) < ROUNDING


def test_a_body_above_the_speed_limit_is_slowed_first() -> None:
    start, goal = PlanarState(vx=2.0, vy=1.0), PlanarState(3.0, -2.0)
    plan = plan_motion(start, goal, LIMITS)
    first = follow(plan, 0.0, start, CYCLE_S)
    assert first.result is Result.SLOWING
    assert math.hypot(*first.acceleration_m_s2) == pytest.approx(1.0)
    end = drive(plan, CYCLE_S)
    assert end.result is Result.ARRIVED
    assert end.over_acceleration < ROUNDING


def test_a_goal_above_the_speed_limit_is_refused_by_braking() -> None:
    plan = plan_motion(PlanarState(vx=0.5), PlanarState(1.0, 0.0, vx=1.1), LIMITS)
    assert follow(plan, 0.0, plan.start, CYCLE_S).result is Result.GOAL_TOO_FAST
    assert plan.at(0.5) == PlanarState(0.125)


def test_each_step_tells_case_time_left_and_limits() -> None:
    plan = plan_motion(PlanarState(vy=0.9), PlanarState(4.0, 0.0), LIMITS)
    steps = [follow(plan, now, plan.at(now), CYCLE_S) for now in (k * plan.ends / 50 for k in range(50))]
    assert list(dict.fromkeys(step.case for step in steps)) == ["bend", "slide", "cruise", "ramp"]
    assert [step.eta_s for step in steps] == sorted((step.eta_s for step in steps), reverse=True)
    assert {step.plan.limits for step in steps} == {plan.limits}
    assert follow(plan, plan.ends, plan.at(plan.ends), CYCLE_S).case == "end"


WILD = st.floats(width=64) | st.floats(-10, 10) | st.sampled_from([0.0, 1.0, 1e-300, 1e300, -1e-9, math.nan, math.inf])


@settings(max_examples=300, deadline=None)
@given(st.tuples(*[WILD] * 6), st.tuples(*[WILD] * 6), st.tuples(*[WILD] * 4), WILD, WILD)
def test_wild_numbers_give_a_result_code_and_plain_numbers(
    start: tuple[float, ...], goal: tuple[float, ...], limits: tuple[float, ...], now: float, dt: float
) -> None:
    plan = plan_motion(PlanarState(*start), PlanarState(*goal), PlanarLimits(*limits), now)
    step = follow(plan, now, PlanarState(*start), dt)
    commanded = (*step.acceleration_m_s2, step.angular_acceleration_rad_s2, *astuple(step.next), step.eta_s)
    assert all(map(math.isfinite, commanded))


PLAIN = st.floats(-5, 5)


@settings(max_examples=300, deadline=None)
@given(
    st.tuples(*[PLAIN] * 6),
    st.tuples(*[PLAIN] * 3, *[st.floats(-0.5, 0.5)] * 3),
    st.tuples(*[st.floats(0.8, 3.0)] * 4),
)
def test_any_state_has_a_way_to_any_goal(
    start: tuple[float, ...], goal: tuple[float, ...], limits: tuple[float, ...]
) -> None:
    plan = plan_motion(PlanarState(*start), PlanarState(*goal), PlanarLimits(*limits))
    reached = plan.at(plan.ends)
    assert plan.result is Result.MOVING
    assert miss_m(reached, plan.goal) < NEAR_M + 1e-8
    assert miss_m_s(reached, plan.goal) < 1e-8
    assert math.remainder(reached.heading - plan.goal.heading, math.tau) == pytest.approx(0.0, abs=1e-8)
    assert reached.rate == pytest.approx(plan.goal.rate, abs=1e-8)


@pytest.mark.parametrize(
    ("start", "goal"),
    [
        ((0.0, 0.0, 0.0, 0.0, 0.5, 0.0), (1.0, 0.0, 0.0, 2.2e-313, 0.5, 0.0)),
        ((0.0, 1e-10, 0.0, 0.0, 0.5, 0.0), (1e-11, 0.5, -1.0, -1e-13, 0.5, 0.0)),
        ((-0.5, 0.0, 0.0, -1e-11, 0.5, 0.0), (-0.5, 0.0, 3.0, 0.0, 0.5, 0.0)),
    ],
    ids=["next to no change", "next to no change, and a turn that takes longer", "back at once, and a longer turn"],
)
def test_a_velocity_that_hardly_changes_leads_to_the_goal(start: tuple[float, ...], goal: tuple[float, ...]) -> None:
    plan = plan_motion(PlanarState(*start), PlanarState(*goal), PlanarLimits(1.0, 0.5, 1.0, 1.0))
    reached = plan.at(plan.ends)
    assert miss_m(reached, plan.goal) < NEAR_M
    assert miss_m_s(reached, plan.goal) < 1e-8


@pytest.mark.parametrize(
    "arc",
    [
        Ramp(1.0, 0.2 + 0.3j, 0.6 - 0.8j),
        Slide(1.0, cmath.rect(1.0, 0.7), -1.0),
        Bend(1.0, 0.5 - 0.1j, cmath.rect(1.0, 0.4), -1.0, 0.2, -2.0),
    ],
    ids=lambda arc: arc.case,
)
def test_an_arc_moves_as_it_says_and_accelerates_by_one(arc: Arc) -> None:
    h = 1e-5
    for time in (0.1, 0.5, 0.9):
        before, here, after = arc.at(time - h), arc.at(time), arc.at(time + h)
        velocity, acceleration = ((late - early) / (2 * h) for late, early in zip(after, before, strict=True))
        assert velocity == pytest.approx(here[1], abs=1e-8)
        assert abs(acceleration) == pytest.approx(1.0, abs=1e-8)


def test_a_bend_is_within_the_speed_limit_if_all_of_its_velocities_are() -> None:
    draw, seen = random.Random(SEED), set()
    for _ in range(400):
        start, end = (cmath.rect(draw.uniform(0.0, 1.0), draw.uniform(-math.pi, math.pi)) for _ in range(2))
        middle, half = draw.uniform(-2.0, 2.0), draw.uniform(0.1, 4.0)
        arc = bend_between(start, end, draw.choice((-1.0, 1.0)), middle - half, middle + half)
        highest = max(abs(arc.at(arc.duration * part / 500)[1]) for part in range(501))
        if abs(highest - 1.0) > 1e-4:
            seen.add(highest < 1.0)
            assert keeps_limit(arc, end) == (highest < 1.0)
    assert seen == {True, False}


@pytest.mark.parametrize(
    ("travel", "start", "end"),
    [
        (-4.9e-10 + 1.3683j, 1j, 1e-17 + 0.5j),
        (3.3e-11 + 2.5155j, 1j, 0.67602j),
        (3e-6 + 3.3033j, 1j, 0.56766j),
        (-3.3e-12 + 0j, 0.69413 - 0.71984j, 0.69413 - 0.71984j),
        (1e-9 + 0.0776j, 0j, 0.3372j),
        (6.78 + 0.0265j, 1j, 0.9999999996 + 0j),
    ],
)
def test_what_is_nearly_on_a_line_has_a_way(travel: complex, start: complex, end: complex) -> None:
    _, way = fastest_way(travel, start, end)
    assert misses(way, travel, end) < ROUNDING


def test_stop_and_go_leads_to_every_goal() -> None:
    for problem in random_problems(50, SEED):
        travel, start, end = complex(0.3 * problem.goal.x, problem.goal.y), 0.5 - 0.3j, -0.2 + 0.6j
        assert misses(chain(start, stop_and_go(travel, start, end)), travel, end) < 1e-12
