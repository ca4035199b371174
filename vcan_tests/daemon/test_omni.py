"""Omni-wheel kinematics: the Turtle robot's three wheels, and more of them."""

from __future__ import annotations

import math
from collections.abc import Sequence

import pytest
from hypothesis import given
from hypothesis import strategies as st

from daemon.loops.omni import Motion, OmniKinematics, OmniWheel, turtle_wheels

LEVER = st.floats(0.05, 0.5)
SPEED = st.floats(-3, 3)
MOTION = st.tuples(SPEED, SPEED, SPEED)


def residuals(kinematics: OmniKinematics, speeds: Sequence[float]) -> tuple[float, ...]:
    """What of each rim speed no motion of the body explains."""
    explained = kinematics.wheel_speeds(kinematics.body_motion(speeds))
    return tuple(speed - fitted for speed, fitted in zip(speeds, explained, strict=True))


def four_wheels() -> OmniKinematics:
    return OmniKinematics([OmniWheel(math.radians(45 + 90 * n), 0.2) for n in range(4)])


def corrected_inverse(r1: float, r2: float, r3: float) -> list[list[float]]:
    """Appendix A of the report with R1 + R3 for its R3 + R2, multiplied out by hand."""
    root, total = math.sqrt(3), r1 + r2 + r3
    rows: list[list[float]] = [
        [-r2, r1 + r3, -r2],
        [-(2 * r3 + r2) / root, (r1 - r3) / root, (2 * r1 + r2) / root],
        [1, 1, 1],
    ]
    return [[value / total for value in row] for row in rows]


@given(LEVER, LEVER, LEVER)
def test_the_inverse_is_the_corrected_one_of_the_report(r1: float, r2: float, r3: float) -> None:
    inverse = OmniKinematics(turtle_wheels(r1, r2, r3)).inverse
    for row, wanted in zip(inverse, corrected_inverse(r1, r2, r3), strict=True):
        assert list(row) == pytest.approx(wanted, abs=1e-9)


@given(LEVER, LEVER, LEVER)
def test_inverse_times_forward_is_the_identity(r1: float, r2: float, r3: float) -> None:
    kinematics = OmniKinematics(turtle_wheels(r1, r2, r3))
    for axis in range(3):
        column = [row[axis] for row in kinematics.forward]
        unit = [1.0 if axis == other else 0.0 for other in range(3)]
        assert list(kinematics.body_motion(column)) == pytest.approx(unit, abs=1e-9)


@pytest.mark.parametrize(
    ("levers", "error"), [((0.2, 0.2, 0.2), 0), ((0.2, 0.25, 0.3), 1 / 15), ((0.1, 0.3, 0.2), 1 / 3)]
)
def test_the_printed_inverse_is_wrong_unless_wheels_1_and_2_are_equally_far_out(
    levers: tuple[float, float, float], error: float
) -> None:
    r1, r2, r3 = levers
    kinematics = OmniKinematics(turtle_wheels(r1, r2, r3))
    printed_forward_row = [-r2 / (r1 + r2 + r3), (r3 + r2) / (r1 + r2 + r3), -r2 / (r1 + r2 + r3)]
    ahead = kinematics.wheel_speeds((1.0, 0.0, 0.0))
    printed = sum(a * b for a, b in zip(printed_forward_row, ahead, strict=True))
    assert abs(printed - 1.0) == pytest.approx(error, abs=1e-12)


def test_forward_motion_rolls_wheel_2_and_turns_the_others_back_at_half_speed() -> None:
    speeds = OmniKinematics(turtle_wheels(0.2, 0.2, 0.2)).wheel_speeds((1.0, 0.0, 0.0))
    assert speeds == pytest.approx((-0.5, 1.0, -0.5))


def test_turning_counter_clockwise_rolls_each_wheel_by_its_lever() -> None:
    assert OmniKinematics(turtle_wheels(0.1, 0.2, 0.3)).wheel_speeds((0.0, 0.0, 2.0)) == pytest.approx((0.2, 0.4, 0.6))


def test_three_wheels_explain_any_speeds() -> None:
    left = residuals(OmniKinematics(turtle_wheels(0.134, 0.217, 0.255)), (1.0, -2.0, 0.7))
    assert left == pytest.approx((0, 0, 0), abs=1e-12)


@given(MOTION)
def test_four_wheels_give_back_the_motion_without_residual(motion: Motion) -> None:
    speeds = four_wheels().wheel_speeds(motion)
    assert four_wheels().body_motion(speeds) == pytest.approx(motion, abs=1e-12)
    assert residuals(four_wheels(), speeds) == pytest.approx((0, 0, 0, 0), abs=1e-12)


@given(MOTION, st.floats(0.1, 2))
def test_a_wheel_that_spins_is_seen_in_the_residuals_of_four(motion: Motion, spin: float) -> None:
    speeds = list(four_wheels().wheel_speeds(motion))
    speeds[1] += spin
    assert residuals(four_wheels(), speeds) == pytest.approx((-spin / 4, spin / 4, -spin / 4, spin / 4), abs=1e-9)


@given(st.tuples(MOTION, SPEED), MOTION)
def test_no_other_motion_fits_four_wheels_better(speeds: tuple[Motion, float], other: Motion) -> None:
    measured = (*speeds[0], speeds[1])
    best = math.hypot(*residuals(four_wheels(), measured))
    others = four_wheels().wheel_speeds(other)
    assert best <= math.dist(measured, others) + 1e-12


@pytest.mark.parametrize(
    "wheels",
    [
        [],
        turtle_wheels(0.2, 0.2, 0.2)[:2],
        turtle_wheels(0.2, -0.1, -0.1),
        turtle_wheels(0.0, 0.0, 0.0),
        [OmniWheel(0.5, lever) for lever in (0.1, 0.2, 0.3)],
        turtle_wheels(math.nan, 0.2, 0.2),
        turtle_wheels(math.inf, 0.2, 0.2),
    ],
    ids=["none", "two", "levers cancel out", "no lever", "parallel", "nan", "infinite"],
)
def test_wheels_that_leave_a_motion_undetermined_are_refused(wheels: list[OmniWheel]) -> None:
    with pytest.raises(ValueError, match="undetermined"):
        OmniKinematics(wheels)
