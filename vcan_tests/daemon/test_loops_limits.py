"""The gate: what leaves it is inside the limits, whatever goes in."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from daemon.loops import limits
from daemon.loops.limits import Gate
from daemon.loops.measurement import Command, Measurement
from vcan_tests.daemon.paired_robot import DT, GEOMETRY, LIMITS

Wheels = tuple[float, float, float, float]
STANDING: Wheels = (0.0, 0.0, 0.0, 0.0)
STEP = LIMITS.acceleration_m_s2 * DT


def measured(
    *brakes: str, speed: float = 0.0, engaged: tuple[bool, ...] | None = None, released: tuple[bool, ...] | None = None
) -> Measurement:
    return Measurement(
        time_s=0,
        wheel_speed_m_s=(speed,) * 4,
        wheel_travel_m=STANDING,
        heading_rad=(0.0, 0.0),
        brake_engaged=tuple(brake == "engaged" for brake in brakes) if engaged is None else engaged,
        brake_released=tuple(brake == "released" for brake in brakes) if released is None else released,
    )


LOCKED = measured("engaged", "engaged")
REAR_RELEASED = measured("released", "engaged")


def gated(
    wheels: Wheels,
    *,
    previous: Wheels = STANDING,
    measurement: Measurement = LOCKED,
    release: tuple[bool, bool] = (False, False),
    dt: float = DT,
) -> tuple[Command, tuple[str, ...]]:
    return Gate(LIMITS, GEOMETRY).apply(Command(wheels, release), measurement, Command(previous, (False, False)), dt)


anything = st.tuples(*[st.floats(allow_nan=True, allow_infinity=True)] * 4)
permitted = st.tuples(*[st.floats(-LIMITS.wheel_speed_m_s, LIMITS.wheel_speed_m_s)] * 4)
steps = st.floats(0, 0.1) | st.just(math.nan)
brakes = st.tuples(*[st.sampled_from(["engaged", "released", "moving"])] * 2)


@given(anything, permitted, steps)
def test_speed_and_acceleration_stay_inside_whatever_is_asked(wheels: Wheels, previous: Wheels, dt: float) -> None:
    sent, _ = gated(wheels, previous=previous, dt=dt)
    step = LIMITS.acceleration_m_s2 * dt if dt > 0 else 0.0
    for new, old in zip(sent.wheel_speed_m_s, previous, strict=True):
        assert abs(new) <= LIMITS.wheel_speed_m_s * (1 + 1e-8)
        assert abs(new - old) <= step * (1 + 1e-8) + 1e-12


@given(anything, permitted, brakes, st.tuples(st.booleans(), st.booleans()), st.floats(0, 2))
def test_the_interlock_holds_whatever_is_asked(
    wheels: Wheels, previous: Wheels, state: tuple[str, str], release: tuple[bool, bool], speed: float
) -> None:
    measurement = measured(*state, speed=speed)
    sent, _ = gated(wheels, previous=previous, measurement=measurement, release=release)
    assert sum(sent.release_brake) <= 1
    for pair, (own, other) in enumerate((((0, 1), (2, 3)), ((2, 3), (0, 1)))):
        if state[pair] == "engaged":
            continue
        right, left = (sent.wheel_speed_m_s[wheel] for wheel in own)
        assert [sent.wheel_speed_m_s[wheel] for wheel in other] == [0, 0]
        assert right == -left
        assert abs(right) <= LIMITS.steering_rim_speed_m_s
        assert right == 0 or state[pair] == "released"
        assert not sent.release_brake[1 - pair]


@given(permitted, permitted)
def test_the_gate_changes_nothing_without_naming_it(wheels: Wheels, previous: Wheels) -> None:
    sent, active = gated(wheels, previous=previous)
    assert (sent.wheel_speed_m_s == wheels) == (active == ())


def test_speeds_are_scaled_together() -> None:
    sent, active = gated((4.0, 2.0, 2.0, 4.0), previous=(2.0, 1.0, 1.0, 2.0))
    assert sent.wheel_speed_m_s == (2.0, 1.0, 1.0, 2.0)
    assert active == (limits.WHEEL_SPEED,)


def test_accelerations_are_scaled_together() -> None:
    sent, active = gated((1.0, 0.5, 0.5, 1.0))
    assert sent.wheel_speed_m_s == pytest.approx((STEP, STEP / 2, STEP / 2, STEP))
    assert active == (limits.WHEEL_ACCELERATION,)


def test_a_speed_that_is_no_number_becomes_zero_and_is_named() -> None:
    sent, active = gated((math.nan, 0.001, 0.001, 0.001))
    assert sent.wheel_speed_m_s[0] == 0
    assert active == (limits.NOT_FINITE,)


def test_a_released_pair_may_turn_by_opposite_speeds() -> None:
    wheels = (0.005, -0.005, 0.0, 0.0)
    assert gated(wheels, measurement=REAR_RELEASED) == (Command(wheels, (False, False)), ())


def test_a_released_pair_does_not_push() -> None:
    sent, active = gated((0.008, 0.002, 0.0, 0.0), measurement=REAR_RELEASED)
    assert sent.wheel_speed_m_s == pytest.approx((0.003, -0.003, 0, 0))
    assert active == (limits.BRAKE_INTERLOCK,)


def test_a_pair_turns_no_faster_than_the_steering_limit() -> None:
    turning = (0.3, -0.3, 0.0, 0.0)
    sent, active = gated(turning, previous=turning, measurement=REAR_RELEASED)
    assert sent.wheel_speed_m_s == (0.15, -0.15, 0, 0)
    assert limits.STEERING_SPEED in active


def test_the_interlock_stops_rolling_wheels_at_once() -> None:
    rolling = (0.5, 0.5, 0.5, 0.5)
    sent, active = gated(rolling, previous=rolling, measurement=measured("moving", "engaged"))
    assert sent.wheel_speed_m_s == STANDING
    assert active == (limits.BRAKE_INTERLOCK,)


def test_a_brake_is_not_released_while_wheels_roll() -> None:
    sent, active = gated(STANDING, measurement=measured("engaged", "engaged", speed=0.1), release=(True, False))
    assert sent.release_brake == (False, False)
    assert active == (limits.BRAKE_INTERLOCK,)


def test_a_brake_stays_released_while_its_pair_turns() -> None:
    turning = measured("released", "engaged", speed=0.1)
    assert gated(STANDING, measurement=turning, release=(True, False))[0].release_brake == (True, False)


def test_the_second_brake_is_not_released() -> None:
    assert gated(STANDING, measurement=REAR_RELEASED, release=(False, True))[0].release_brake == (False, False)


def test_both_brakes_are_never_released_together() -> None:
    assert gated(STANDING, release=(True, True))[0].release_brake == (False, False)


def test_a_robot_without_steering_brakes_has_no_interlock() -> None:
    wheels = (0.005, 0.005)
    measurement = Measurement(time_s=0, wheel_speed_m_s=(0, 0), wheel_travel_m=(0, 0))
    sent, active = Gate(LIMITS, None).apply(Command(wheels), measurement, Command((0.0, 0.0)), DT)
    assert (sent.wheel_speed_m_s, active) == (wheels, ())
