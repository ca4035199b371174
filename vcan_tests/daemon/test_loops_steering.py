"""Turning one pair by opposite wheel speeds."""

from __future__ import annotations

import math
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from daemon.loops.steering import PairSteering, SteeringPhase, SteeringRecord
from vcan_tests.daemon.paired_robot import DT, LIMITS

OFFSET_M = 0.075
COUNT_RAD = math.tau / 4096


class Pair:
    """A pair that turns as its wheels roll, some cycles late, read by an encoder of 4096 counts."""

    def __init__(self, heading_deg: float = 0.0, *, delay: int = 2, direction: float = 1.0) -> None:
        self.heading = math.radians(heading_deg)
        self.direction = direction
        self.speed = 0.0
        self.pending = [0.0] * delay
        self.law = PairSteering(OFFSET_M, LIMITS)

    def step(self, target: float | None) -> SteeringRecord:
        reading = round(self.heading / COUNT_RAD) * COUNT_RAD
        record = self.law.step(reading, target, (self.speed, -self.speed), DT)
        self.pending.append(record.rim_speed_m_s)
        self.speed = self.pending.pop(0)
        self.heading += self.direction * self.speed / OFFSET_M * DT
        return record

    def turn_to(self, target_deg: float, at_most_s: float = 20.0) -> list[SteeringRecord]:
        records: list[SteeringRecord] = []
        for _ in range(round(at_most_s / DT)):
            records.append(self.step(math.radians(target_deg)))
            if records[-1].phase in (SteeringPhase.DONE, SteeringPhase.FAILED):
                break
        return records


headings = st.floats(-85, 85)


@settings(deadline=None, max_examples=60)
@given(headings, headings, st.integers(1, 4))
def test_every_heading_is_reached_within_a_fifth_of_a_degree(start: float, target: float, delay: int) -> None:
    pair = Pair(start, delay=delay)
    assert pair.turn_to(target)[-1].phase is SteeringPhase.DONE
    assert abs(math.degrees(pair.heading) - target) <= 0.2


@settings(deadline=None, max_examples=60)
@given(st.floats(2, 85), st.integers(0, 4))
def test_the_target_is_not_overrun(target: float, delay: int) -> None:
    pair = Pair(delay=delay)
    assert max(record.error_rad * -1 for record in pair.turn_to(target)) <= math.radians(0.2)


def test_rim_speed_and_acceleration_stay_within_their_limits() -> None:
    speeds = [0.0] + [record.rim_speed_m_s for record in Pair().turn_to(80)]
    assert max(speeds) == pytest.approx(LIMITS.steering_rim_speed_m_s)
    assert all(abs(b - a) <= LIMITS.acceleration_m_s2 * DT * (1 + 1e-9) for a, b in pairwise(speeds))


def test_sixty_degrees_take_hardly_longer_than_their_trapezoid() -> None:
    assert len(Pair().turn_to(60)) * DT < 0.075 * math.radians(60) / 0.15 + 1.5


def test_a_positive_rim_speed_turns_counter_clockwise() -> None:
    assert Pair().step(math.radians(10)).rim_speed_m_s > 0


def test_the_pair_rests_when_it_is_done() -> None:
    pair = Pair()
    pair.turn_to(30)
    assert pair.speed == 0


def test_a_pair_that_stands_right_is_done_without_turning() -> None:
    assert all(record.rim_speed_m_s == 0 for record in Pair(30.0).turn_to(30.0))


def test_a_pair_that_does_not_turn_is_told_from_a_slow_one() -> None:
    last = Pair(direction=0.0).turn_to(20)[-1]
    assert last.phase is SteeringPhase.FAILED
    assert "does not turn" in last.failure


def test_a_pair_that_turns_the_wrong_way_is_stopped_early() -> None:
    pair = Pair(direction=-1.0)
    assert "turns away" in pair.turn_to(20)[-1].failure
    assert abs(math.degrees(pair.heading)) < 10


def test_a_missing_heading_fails() -> None:
    record = PairSteering(OFFSET_M, LIMITS).step(math.nan, 0.3, (0.0, 0.0), DT)
    assert "no heading" in record.failure


def test_after_a_failure_the_wheels_ramp_to_rest() -> None:
    pair = Pair(direction=-1.0)
    pair.turn_to(20)
    assert [pair.step(math.radians(20)).rim_speed_m_s for _ in range(40)][-1] == 0


def test_the_target_may_move_while_the_pair_turns() -> None:
    pair = Pair()
    for _ in range(50):
        pair.step(math.radians(60))
    assert pair.turn_to(-20)[-1].phase is SteeringPhase.DONE
    assert math.degrees(pair.heading) == pytest.approx(-20, abs=0.2)


def test_without_a_target_the_pair_comes_to_rest_where_it_is() -> None:
    pair = Pair()
    for _ in range(50):
        pair.step(math.radians(60))
    records = [pair.step(None) for _ in range(60)]
    assert records[-1].phase is SteeringPhase.DONE
    assert 10 < math.degrees(pair.heading) < 60
