"""Slip detection and safety factor as printed; the vectors test them step by step, here is what they promise."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from daemon.loops.published_planner import Branch
from daemon.loops.published_planner_axis import AxisCase
from daemon.loops.published_traction import Correction, PublishedTraction, SafetyFactor
from daemon.loops.slip import AxisSlipDetector
from vcan_tests.daemon.vectors_turtle import Case, Robot, drive_with_slip

GOAL: Case = {"v_max": 1.0, "a_max": 1.0, "epsilon_slip": 0.1}


def test_a_difference_below_the_threshold_is_no_slip() -> None:
    assert not AxisSlipDetector(0.1).step(0.95, 1.0, AxisCase.TO_TOP_SPEED)


@pytest.mark.parametrize("measured", [0.5, 1.5])
def test_too_little_and_too_much_acceleration_are_slip(measured: float) -> None:
    assert AxisSlipDetector(0.1).step(measured, 1.0, AxisCase.TO_TOP_SPEED)


@pytest.mark.parametrize("case", [AxisCase.TOP_SPEED, AxisCase.TOO_FAST])
def test_slip_is_ignored_at_top_speed(case: AxisCase) -> None:
    assert not AxisSlipDetector(0.1).step(0.0, 1.0, case)


def test_slip_is_ignored_for_four_steps_of_acceleration_after_top_speed() -> None:
    detector = AxisSlipDetector(0.1)
    detector.step(0.0, 1.0, AxisCase.TOP_SPEED)
    assert [detector.step(0.0, 1.0, AxisCase.TO_TOP_SPEED) for _ in range(6)] == [False] * 4 + [True] * 2


def test_slip_while_braking_right_after_top_speed_counts() -> None:
    detector = AxisSlipDetector(0.1)
    detector.step(0.0, -1.0, AxisCase.TOP_SPEED)
    assert detector.step(0.0, -1.0, AxisCase.BRAKE)


def test_lasting_slip_brings_the_factor_to_its_least_in_four_steps() -> None:
    safety = SafetyFactor()
    factors = []
    for _ in range(5):
        safety.step(True)
        factors.append(safety.factor)
    assert factors == pytest.approx([0.9, 0.7, 0.3, 0.1, 0.1])


def test_without_slip_the_least_factor_recovers_in_two_steps() -> None:
    safety = SafetyFactor(0.1, 0.0)
    corrections, factors = [], []
    for _ in range(3):
        corrections.append(safety.step(False))
        factors.append(safety.factor)
    assert corrections == [Correction.INCREASE, Correction.INCREASE, Correction.NONE]
    assert factors == pytest.approx([0.55, 1.0, 1.0])


def test_slip_right_after_a_recovery_takes_half_of_it_back() -> None:
    safety = SafetyFactor(1.0, 0.4)
    assert safety.step(True) is Correction.FIRST
    assert safety.factor == pytest.approx(0.8)


@given(st.lists(st.booleans(), max_size=60), st.floats(0.1, 1), st.floats(-0.9, 0.9))
def test_the_factor_stays_in_its_range(slips: list[bool], factor: float, change: float) -> None:
    safety = SafetyFactor(factor, change)
    for slip in slips:
        safety.step(slip)
        assert 0.1 <= safety.factor <= 1.0


@given(st.lists(st.booleans(), max_size=30))
def test_the_factor_is_back_at_one_ten_steps_after_the_last_slip(slips: list[bool]) -> None:
    safety = SafetyFactor()
    for slip in [*slips, *[False] * 10]:
        safety.step(slip)
    assert safety.factor == 1.0


def test_slip_in_y_lowers_the_limit_when_x_has_none() -> None:
    limit = SafetyFactor().limit(2.0, (False, True))
    assert limit == pytest.approx((2.0, 1.8, False))


def test_slip_in_both_directions_is_answered_once() -> None:
    limit = SafetyFactor().limit(2.0, (True, True))
    assert limit == pytest.approx((1.8, 1.8, True))


def test_slip_in_y_alone_is_not_answered_while_the_factor_recovers() -> None:
    """A property of the listing: x without slip raises the factor, and that counts as the answer."""
    safety = SafetyFactor()
    factors = [safety.limit(1.0, (False, True)).y for _ in range(4)]
    assert factors == pytest.approx([0.9, 0.95, 0.975, 0.9875])


def test_without_an_error_the_controller_changes_nothing() -> None:
    driven, records = drive_with_slip({**GOAL, "goal": (2.0, 0.0), "T": 3.2, "error_window": None})
    assert {record.safety_factor for record in records} == {1.0}
    assert driven.rest() == pytest.approx(2998, abs=2)


def test_moving_in_both_directions_the_vector_falls_to_a_tenth_while_it_slips() -> None:
    window = {"t1": 0.3, "t2": 0.8, "factor": 1.5}
    driven, _ = drive_with_slip({**GOAL, "goal": (2.0, 1.0), "T": 1.0, "error_window": window})
    sizes = [math.hypot(*step.acceleration_m_s2) for step in driven.steps]
    assert sizes[299] == pytest.approx(1.0, abs=1e-3)
    assert sizes[303:800] == [pytest.approx(0.1, abs=1e-3)] * 497


def test_slip_at_top_speed_is_answered_only_when_braking_begins() -> None:
    window = {"t1": 1.4, "t2": 2.2, "factor": 1.5}
    given = {**GOAL, "v_max": 0.5, "goal": (1.0, 0.0), "T": 2.3, "error_window": window}
    driven, records = drive_with_slip(given)
    first = next(n for n, record in enumerate(records) if record.safety_factor < 1)
    assert driven.steps[first - 2].cases[0] is AxisCase.TOP_SPEED
    assert driven.steps[first - 1].cases[0] is AxisCase.BRAKE
    assert first == 2001


@pytest.mark.parametrize(
    ("goal", "keeper", "branch"),
    [
        ((0.0, 0.0), False, Branch.BOTH_CONVERGED),
        ((0.0, 1.0), False, Branch.X_CONVERGED),
        ((1.0, 0.0), False, Branch.Y_CONVERGED),
        ((1.0, 1.0), False, Branch.SYNCHRONISED),
        ((1.0, 1.0), True, Branch.UNSYNCHRONISED),
    ],
)
def test_slip_lowers_the_acceleration_in_every_branch(goal: tuple[float, float], keeper: bool, branch: Branch) -> None:
    robot = Robot(vx=0.2, vy=0.2)
    problem = robot.problem({"goal": goal, "v_max": 1.0, "a_max": 1.0, "robotID": 1 if keeper else 2})
    gripping = PublishedTraction().step(problem, (1.0, 1.0), (1.0, 1.0))
    slipping = PublishedTraction().step(problem, (0.0, 0.0), (1.0, 1.0))
    free, limited = gripping.planned, slipping.planned
    assert (free.branch, slipping.slip) == (branch, (True, True))
    assert slipping.safety_factor == pytest.approx(0.9)
    assert limited.acceleration_m_s2 == pytest.approx([0.9 * part for part in free.acceleration_m_s2], rel=1e-6)
