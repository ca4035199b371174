"""The position loop of a steered axle and its gate."""

from __future__ import annotations

import itertools
import math
import random
from collections.abc import Iterator

import pytest
from hypothesis import given
from hypothesis import strategies as st

from daemon.loops.steered_axle import STEERING_LIMIT, STEERING_RATE, SteeredAxleLaw
from daemon.loops.steering_gate import SteeringGate
from profiles.steered import SteeredAxle

DT = 0.01
ARM_M = 0.1
ASKED_M_S = 0.104
AXLE = SteeredAxle(
    drive="steering", encoder="steering", limit_deg=32, stop_deg=35, rate_deg_s=60, acceleration_deg_s2=600
)
angles = st.floats(-math.radians(32), math.radians(32))


class Axle:
    """Follows the commanded rate after a few cycles."""

    def __init__(self, angle_rad: float = 0.0, delay: int = 3, follows: float = 1.0) -> None:
        self.angle_rad = angle_rad
        self._coming = [0.0] * delay
        self._follows = follows

    def turn(self, rate_rad_s: float) -> None:
        self._coming.append(rate_rad_s)
        self.angle_rad += self._follows * self._coming.pop(0) * DT


def turned(law: SteeredAxleLaw, axle: Axle, target: float | None, steps: int = 300) -> list[float]:
    """The angles on the way."""
    way = []
    for _ in range(steps):
        axle.turn(law.step(target, axle.angle_rad, DT).rate_rad_s)
        way.append(axle.angle_rad)
    return way


@given(angles, angles)
def test_the_axle_reaches_its_target_without_overshoot(start: float, target: float) -> None:
    way = turned(SteeredAxleLaw(AXLE), Axle(start), target)
    assert way[-1] == pytest.approx(target, abs=math.radians(0.02))
    low, high = sorted((start, target))
    assert min(way) > low - math.radians(0.2)
    assert max(way) < high + math.radians(0.2)


def test_the_axle_turns_no_faster_than_its_rate() -> None:
    way = turned(SteeredAxleLaw(AXLE), Axle(math.radians(-32)), math.radians(32))
    fastest = max(abs(after - before) / DT for before, after in itertools.pairwise(way))
    assert math.degrees(fastest) == pytest.approx(60, abs=1e-6)


def test_a_target_beyond_the_limit_is_cut_and_told() -> None:
    law, axle = SteeredAxleLaw(AXLE), Axle()
    assert law.step(math.radians(50), 0.0, DT).limits_active == (STEERING_LIMIT, STEERING_RATE)
    assert math.degrees(turned(law, axle, math.radians(50))[-1]) == pytest.approx(32, abs=0.05)


def test_without_a_target_the_axle_comes_to_rest() -> None:
    law, axle = SteeredAxleLaw(AXLE), Axle()
    turned(law, axle, math.radians(30), 30)
    assert turned(law, axle, None, 100)[-20:] == pytest.approx([axle.angle_rad] * 20)


@pytest.mark.parametrize("follows", [0.0, -1.0])
def test_an_axle_that_does_not_follow_its_drive_is_told(follows: float) -> None:
    law, axle = SteeredAxleLaw(AXLE), Axle(follows=follows)
    turned(law, axle, math.radians(20), 60)
    assert "does not follow" in law.step(math.radians(20), axle.angle_rad, DT).failure


def test_an_encoder_without_a_reading_is_told() -> None:
    assert "no angle" in SteeredAxleLaw(AXLE).step(0.1, math.nan, DT).failure


@given(st.floats(allow_nan=True, allow_infinity=True), angles, st.floats(-0.104, 0.104))
def test_the_gate_keeps_rate_and_ramp(wanted: float, angle: float, previous: float) -> None:
    speed, _ = SteeringGate(AXLE, ARM_M).apply(wanted, angle, previous, DT)
    assert abs(speed) <= ARM_M * math.radians(60) * (1 + 1e-9)
    assert abs(speed - previous) <= ARM_M * math.radians(600) * DT * (1 + 1e-9)


def test_the_gate_changes_no_command_within_the_limits() -> None:
    assert SteeringGate(AXLE, ARM_M).apply(0.05, 0.1, 0.049, DT) == (0.05, ())


@pytest.mark.parametrize("side", [1, -1])
def test_at_a_stop_the_gate_lets_the_axle_turn_back_only(side: int) -> None:
    gate, stop = SteeringGate(AXLE, ARM_M), side * math.radians(35)
    assert gate.apply(side * 0.01, stop, side * 0.01, DT)[0] == 0.0
    assert gate.apply(-side * 0.01, stop, -side * 0.01, DT)[0] == -side * 0.01


def pushed(gate: SteeringGate, axle: Axle, noise_rad: Iterator[float], steps: int = 500) -> list[float]:
    """Speeds that a gate sends while a person asks for as much as there is."""
    sent = [0.0]
    for _ in range(steps):
        sent.append(gate.apply(ASKED_M_S, axle.angle_rad + next(noise_rad), sent[-1], DT)[0])
        axle.turn(sent[-1] / ARM_M)
    return sent


def noise(seed: int) -> Iterator[float]:
    """Of an encoder, a tenth of a degree."""
    dice = random.Random(seed)
    while True:
        yield dice.gauss(0.0, math.radians(0.1))


@pytest.mark.parametrize("seed", range(5))
def test_who_pushes_towards_a_stop_comes_to_rest_before_it_and_stays_there(seed: int) -> None:
    gate, axle = SteeringGate(AXLE, ARM_M), Axle(math.radians(-20))
    sent = pushed(gate, axle, noise(seed))
    at_rest = sent.index(0.0, 1)
    assert max(sent) == ASKED_M_S
    assert set(sent[at_rest:]) == {0.0}
    assert math.radians(32) < axle.angle_rad < math.radians(35)


def test_an_axle_that_is_held_goes_on_when_it_is_back_within_the_limit() -> None:
    gate, axle = SteeringGate(AXLE, ARM_M), Axle()
    pushed(gate, axle, itertools.repeat(0.0))
    assert gate.apply(0.05, math.radians(32.5), 0.0, DT)[0] == 0.0
    assert gate.apply(0.05, math.radians(31.5), 0.0, DT)[0] > 0.0
