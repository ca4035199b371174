"""Traction control as it should be: slip signals, the safety factor, and both around a robot on a floor with ice."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from daemon.loops.planner import PlanarState
from daemon.loops.traction import (
    LEAST_FACTOR,
    Correction,
    SafetyFactor,
    SlipDetector,
    SlipSignal,
    Traction,
    TractionTuning,
)
from vcan_tests.daemon.gripping_robot import Way, drive
from vcan_tests.daemon.omni_floor import OmniFloor, dry, ice_between

DT = 0.01
TUNING = TractionTuning()
vectors = st.tuples(st.floats(), st.floats())


def signals(measured: tuple[float, float], commanded: tuple[float, float], seconds: float = 0.3) -> SlipSignal:
    detector = SlipDetector(TUNING)
    for _ in range(round(seconds / DT)):
        signal = detector.step(measured, commanded, False, DT)
    return signal


def test_acceleration_as_commanded_is_no_slip() -> None:
    assert not signals((0.9, 0.0), (1.0, 0.0)).slip


@pytest.mark.parametrize(("measured", "axes"), [((0.5, 0.0), (True, False)), ((1.0, -0.5), (False, True))])
def test_slip_is_found_in_each_direction(measured: tuple[float, float], axes: tuple[bool, bool]) -> None:
    signal = signals(measured, (1.0, 0.0))
    assert (signal.slip, signal.axes) == (True, axes)


def test_a_command_that_is_still_under_way_is_no_slip() -> None:
    detector = SlipDetector(TUNING)
    slips = [detector.step((0.0, 0.0), (1.0, 0.0), False, DT).slip for _ in range(TUNING.delay_cycles)]
    assert slips == [False] * TUNING.delay_cycles


def test_slip_ends_at_a_lower_level_than_it_begins() -> None:
    detector = SlipDetector(TUNING)
    between = 1.0 - (TUNING.slip_m_s2 + TUNING.grip_m_s2) / 2
    before = [detector.step((between, 0.0), (1.0, 0.0), False, DT).slip for _ in range(50)][-1]
    for _ in range(50):
        detector.step((0.0, 0.0), (1.0, 0.0), False, DT)
    after = [detector.step((between, 0.0), (1.0, 0.0), False, DT).slip for _ in range(50)][-1]
    assert (before, after) == (False, True)


def test_one_reading_that_is_wrong_is_no_slip() -> None:
    detector = SlipDetector(TUNING)
    for _ in range(50):
        detector.step((1.0, 0.0), (1.0, 0.0), False, DT)
    readings = [(0.0, 0.0)] + [(1.0, 0.0)] * 30
    assert not any(detector.step(reading, (1.0, 0.0), False, DT).slip for reading in readings)


def test_slip_is_ignored_at_top_speed_and_for_some_time_after() -> None:
    detector = SlipDetector(TUNING)
    for _ in range(50):
        at_top = detector.step((0.0, 0.0), (1.0, 0.0), True, DT)
    after = [detector.step((0.0, 0.0), (1.0, 0.0), False, DT) for _ in range(12)]
    assert (at_top.slip, at_top.ignored) == (False, True)
    assert [signal.ignored for signal in after[:6]] == [True] * 4 + [False] * 2
    assert after[-1].slip


def answer(factor: SafetyFactor, slip: bool, gripping: float = 0.4, seconds: float = DT) -> list[Correction]:
    return [factor.step(slip, gripping, False, False, DT) for _ in range(round(seconds / DT))]


def test_slip_lowers_the_factor_in_one_step_to_what_the_floor_gives() -> None:
    factor = SafetyFactor(TUNING)
    assert answer(factor, True) == [Correction.LOWERED]
    assert factor.factor == pytest.approx(0.4 * TUNING.margin)


def test_the_next_lower_factor_waits_until_the_first_one_can_be_seen() -> None:
    factor = SafetyFactor(TUNING)
    corrections = answer(factor, True, seconds=TUNING.visible_s + 2 * DT)
    assert corrections.count(Correction.LOWERED) == 2
    assert corrections[1:9] == [Correction.WAITING] * 8


def test_a_positive_correction_waits() -> None:
    factor = SafetyFactor(TUNING)
    answer(factor, True)
    corrections = answer(factor, False, seconds=TUNING.hold_s)
    assert corrections == [Correction.WAITING] * (len(corrections) - 1) + [Correction.RAISED]


def test_positive_corrections_that_succeed_grow() -> None:
    factor = SafetyFactor(TUNING)
    answer(factor, True, gripping=0.0)
    factors = []
    for _ in range(5):
        answer(factor, False, seconds=TUNING.hold_s)
        factors.append(factor.factor)
    assert factors == pytest.approx([0.2, 0.4, 0.8, 1.0, 1.0])


def test_positive_corrections_stay_small_while_the_goal_would_be_overshot() -> None:
    factor = SafetyFactor(TUNING)
    answer(factor, True, gripping=0.0)
    for _ in range(3 * round(TUNING.hold_s / DT)):
        factor.step(False, 0.0, False, True, DT)
    assert factor.factor == pytest.approx(LEAST_FACTOR + 3 * TUNING.raise_by)


def test_a_positive_correction_that_brings_slip_back_is_taken_back_and_the_next_waits_twice_as_long() -> None:
    factor = SafetyFactor(TUNING)
    answer(factor, True)
    held = factor.factor
    answer(factor, False, seconds=TUNING.hold_s)
    assert answer(factor, True) == [Correction.RETURNED]
    assert (factor.factor, factor.hold_s) == (held, 2 * TUNING.hold_s)


def test_on_floor_that_stays_slippery_the_factor_comes_to_rest() -> None:
    """Slip whenever the factor is above 0.45: published, that is a change in each step, and never an end."""
    factor, changes = SafetyFactor(TUNING), []
    for step in range(2000):
        before = factor.factor
        factor.step(factor.factor > 0.45, 0.4, False, False, DT)
        if factor.factor != before:
            changes.append(step * DT)
    assert len(changes) <= 8 + 2 * 20 / TUNING.longest_hold_s
    assert changes[-1] - changes[-3] > TUNING.longest_hold_s


def test_a_body_that_catches_up_with_its_wheels_is_no_reason_to_go_lower() -> None:
    factor = SafetyFactor(TUNING)
    answer(factor, True)
    lowered = factor.factor
    assert {factor.step(True, 0.6, True, False, DT) for _ in range(50)} == {Correction.WAITING}
    assert factor.factor == lowered


def test_back_at_one_the_floor_is_forgotten() -> None:
    factor = SafetyFactor(TUNING)
    answer(factor, True)
    answer(factor, False, seconds=TUNING.hold_s)
    answer(factor, True)
    answer(factor, False, seconds=5.0)
    assert (factor.factor, factor.hold_s) == (1.0, TUNING.hold_s)


@pytest.mark.parametrize("direction", [(1.0, 0.0), (0.0, 1.0), (0.0, -1.0), (-0.6, 0.8)])
def test_slip_is_answered_alike_in_all_directions(direction: tuple[float, float]) -> None:
    traction = Traction(1.0)
    x, y = direction
    records = [traction.step((0.4 * x, 0.4 * y), direction, DT) for _ in range(300)]
    assert min(record.safety_factor for record in records) == LEAST_FACTOR
    assert records[-1].acceleration_limit_m_s2 == records[-1].safety_factor


def test_pushing_an_obstacle_leaves_the_factor_alone() -> None:
    traction = Traction(1.0)
    records = [traction.step((0.0, 0.0), (1.0, 0.0), DT, pushing=True) for _ in range(100)]
    assert records[-1].signal.slip
    assert {record.safety_factor for record in records} == {1.0}


def test_slow_slip_that_only_the_wheels_tell_is_answered() -> None:
    traction = Traction(1.0)
    assert traction.step((0.0, 0.0), (0.0, 0.0), DT, slipping=True).correction is Correction.LOWERED


@given(st.lists(st.tuples(vectors, vectors, st.booleans(), st.booleans(), st.booleans()), max_size=60))
def test_the_limit_stays_in_its_range_on_wild_numbers(
    steps: list[tuple[tuple[float, float], tuple[float, float], bool, bool, bool]],
) -> None:
    traction = Traction(2.0)
    for measured, commanded, top, overshoot, slipping in steps:
        record = traction.step(measured, commanded, DT, top, overshoot, slipping=slipping)
        assert LEAST_FACTOR * 2.0 <= record.acceleration_limit_m_s2 <= 2.0


STRAIGHT = PlanarState(3.0, 0.0)
ALONG = 1 + 0j
ON_THE_WAY = ice_between(0.3, 1.0)


@pytest.mark.parametrize("by_currents", [False, True])
def test_on_dry_floor_nothing_changes(by_currents: bool) -> None:
    driven = drive(OmniFloor(dry), STRAIGHT, Way.IMPROVED, by_currents=by_currents)
    assert driven.factor_changes() == 0
    assert driven.events() == (0, 0, 0)
    assert driven.arrived_s < 3.05


@pytest.mark.parametrize("by_currents", [False, True])
def test_on_ice_the_robot_stays_on_its_way(by_currents: bool) -> None:
    without = drive(OmniFloor(ON_THE_WAY), STRAIGHT, Way.OFF)
    driven = drive(OmniFloor(ON_THE_WAY), STRAIGHT, Way.IMPROVED, by_currents=by_currents)
    assert driven.aside(ALONG) < without.aside(ALONG) / 2
    assert driven.arrived_s < without.arrived_s + 2.5
    _, missed, false = driven.events()
    assert missed == 0
    assert false <= 1


def test_the_factor_of_the_improved_controller_hardly_moves_where_the_published_one_chatters() -> None:
    published = drive(OmniFloor(ON_THE_WAY), STRAIGHT, Way.PUBLISHED)
    improved = drive(OmniFloor(ON_THE_WAY), STRAIGHT, Way.IMPROVED)
    assert improved.factor_changes() < 20
    assert published.factor_changes() > 20 * improved.factor_changes()
