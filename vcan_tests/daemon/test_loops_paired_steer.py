"""The sequence come to rest, steer, drive, on a robot without slip."""

from __future__ import annotations

import math
from itertools import pairwise

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from daemon.loops.geometry import solve_turning
from daemon.loops.limits import Gate
from daemon.loops.measurement import Command
from daemon.loops.paired_steer import PairedSteerLaw, Phase
from daemon.loops.paired_steer_target import (
    PairedSteerTarget,
    direction_target,
    parallel_target,
    steer_target,
    turn_target,
)
from vcan_tests.daemon.paired_robot import DT, GEOMETRY, LIMITS, PairedRobot, Step, drive

STANDING = (0.0, 0.0, 0.0, 0.0)


@pytest.fixture
def law() -> PairedSteerLaw:
    return PairedSteerLaw(GEOMETRY, LIMITS)


@pytest.fixture
def robot() -> PairedRobot:
    return PairedRobot()


def phases(steps: list[Step]) -> list[tuple[Phase, str | None]]:
    """Phases with the pair concerned, each once in a row."""
    all_phases = [(step.record.phase, step.record.pair) for step in steps]
    return all_phases[:1] + [b for a, b in pairwise(all_phases) if a != b]


def headings_deg(robot: PairedRobot) -> list[float]:
    return [math.degrees(heading) for heading in robot.heading]


def test_a_new_direction_is_steered_front_first_and_then_driven(law: PairedSteerLaw, robot: PairedRobot) -> None:
    steps = drive(law, robot, parallel_target(math.radians(30), 0.5, 1.0))
    assert phases(steps) == [
        (Phase.STOPPING, None),
        (Phase.RELEASING_BRAKE, "front"),
        (Phase.TURNING_PAIR, "front"),
        (Phase.ENGAGING_BRAKE, "front"),
        (Phase.STOPPING, None),
        (Phase.RELEASING_BRAKE, "rear"),
        (Phase.TURNING_PAIR, "rear"),
        (Phase.ENGAGING_BRAKE, "rear"),
        (Phase.STOPPING, None),
        (Phase.DRIVING, None),
        (Phase.STOPPING, None),
        (Phase.RESTING, None),
    ]


@settings(deadline=None, max_examples=25)
@given(st.floats(-1.4, 1.4), st.floats(0.1, 0.6), st.booleans(), st.floats(0.5, 3), st.integers(0, 3))
def test_a_parallel_movement_covers_its_way_exactly(
    heading: float, speed: float, backward: bool, duration: float, delay: int
) -> None:
    robot = PairedRobot(delay=delay)
    steps = drive(
        PairedSteerLaw(GEOMETRY, LIMITS), robot, parallel_target(heading, -speed if backward else speed, duration)
    )
    start = next(step.measurement for step in steps if step.record.phase is Phase.DRIVING)
    rolled = [now - then for now, then in zip(robot.travel, start.wheel_travel_m, strict=True)]
    way = (-speed if backward else speed) * duration
    assert steps[-1].record.done
    assert rolled == pytest.approx([way] * 4, abs=1e-6)
    assert headings_deg(robot) == pytest.approx([math.degrees(heading)] * 2, abs=0.2)


def test_a_turn_rolls_each_wheel_its_own_arc(law: PairedSteerLaw, robot: PairedRobot) -> None:
    steps = drive(law, robot, turn_target(0.15, -0.3, 0.5, 4.0))
    start = next(step.measurement for step in steps if step.record.phase is Phase.DRIVING)
    rolled = [now - then for now, then in zip(robot.travel, start.wheel_travel_m, strict=True)]
    factors = solve_turning(GEOMETRY, 0.15, -0.3, 1.0).roll_speed_m_s
    assert rolled == pytest.approx([2.0 * factor for factor in factors], rel=1e-6)


def test_a_turn_is_recorded_with_its_centre_and_mismatch(law: PairedSteerLaw, robot: PairedRobot) -> None:
    record = next(s.record for s in drive(law, robot, turn_target(-0.35, 0.35, 0.5, 2)) if s.record.speed_m_s == 0.5)
    assert record.centre_radius_m == pytest.approx(0.6310, abs=1e-4)
    assert record.yaw_rate_rad_s == pytest.approx(0.7924, abs=1e-4)
    assert max(math.degrees(angle) for angle in record.mismatch_rad) == pytest.approx(7.035, abs=1e-3)


def test_wheels_accelerate_within_the_limit_also_outside_of_the_curve(law: PairedSteerLaw, robot: PairedRobot) -> None:
    commands = [step.command.wheel_speed_m_s for step in drive(law, robot, turn_target(-0.35, 0.35, 0.5, 2))]
    largest = max(abs(new - old) for a, b in pairwise(commands) for old, new in zip(a, b, strict=True))
    assert largest <= LIMITS.acceleration_m_s2 * DT * (1 + 1e-9)


@settings(deadline=None, max_examples=15)
@given(st.floats(-0.6, 0.6), st.floats(-0.6, 0.6), st.floats(-0.5, 0.5))
def test_the_gate_has_nothing_to_correct(rear: float, front: float, speed: float) -> None:
    gate, previous = Gate(LIMITS, GEOMETRY), Command(STANDING, (False, False))
    for step in drive(PairedSteerLaw(GEOMETRY, LIMITS), PairedRobot(), turn_target(rear, front, speed, 1.0)):
        passed, active = gate.apply(step.command, step.measurement, previous, DT)
        assert active == ()
        assert passed == step.command
        previous = passed


def test_pairs_within_the_tolerance_are_not_turned(law: PairedSteerLaw) -> None:
    steps = drive(law, PairedRobot(rear_deg=30.05, front_deg=29.95), parallel_target(math.radians(30), 0.5, 1.0))
    assert [phase for phase, _ in phases(steps)] == [Phase.STOPPING, Phase.DRIVING, Phase.STOPPING, Phase.RESTING]


def test_steering_one_pair_keeps_the_other_and_drives_nowhere(law: PairedSteerLaw) -> None:
    robot = PairedRobot(rear_deg=12)
    steps = drive(law, robot, steer_target(1, math.radians(40)))
    assert steps[-1].record.done
    assert headings_deg(robot) == pytest.approx([12, 40], abs=0.2)
    assert not any(step.record.phase is Phase.DRIVING for step in steps)


def test_a_repeated_target_object_is_done_once(law: PairedSteerLaw, robot: PairedRobot) -> None:
    target = parallel_target(0, 0.5, 1.0)
    drive(law, robot, target)
    assert drive(law, robot, target)[-1].command.wheel_speed_m_s == STANDING
    assert robot.travel == pytest.approx([0.5] * 4)


def test_an_equal_but_new_target_is_a_new_motion(law: PairedSteerLaw, robot: PairedRobot) -> None:
    drive(law, robot, parallel_target(0, 0.5, 1.0))
    drive(law, robot, parallel_target(0, 0.5, 1.0))
    assert robot.travel == pytest.approx([1.0] * 4)


def test_without_a_target_the_robot_ramps_to_rest(law: PairedSteerLaw, robot: PairedRobot) -> None:
    drive(law, robot, direction_target(0, 0.5), at_most_s=2)
    steps = drive(law, robot, None)
    speeds = [step.record.speed_m_s for step in steps]
    assert steps[-1].record.done
    assert max(a - b for a, b in pairwise(speeds)) <= LIMITS.acceleration_m_s2 * DT * (1 + 1e-9)
    assert robot.speed == [0.0] * 4


def test_without_a_target_a_turning_pair_stops_and_is_locked(law: PairedSteerLaw, robot: PairedRobot) -> None:
    drive(law, robot, steer_target(1, math.radians(80)), at_most_s=0.5)
    steps = drive(law, robot, None)
    assert steps[-1].record.done
    assert robot.brake == [0, 0]
    assert 2 < headings_deg(robot)[1] < 70


def test_without_a_target_a_brake_that_is_being_released_engages_at_once(
    law: PairedSteerLaw, robot: PairedRobot
) -> None:
    target = steer_target(1, math.radians(80))
    while not 0 < robot.brake[1] < 1:
        drive(law, robot, target, at_most_s=DT)
    steps = drive(law, robot, None)
    assert phases(steps) == [(Phase.ENGAGING_BRAKE, "front"), (Phase.STOPPING, None), (Phase.RESTING, None)]
    assert not any(any(step.command.release_brake) for step in steps)
    assert headings_deg(robot) == [0.0, 0.0]


def test_a_new_speed_is_taken_up_at_once(law: PairedSteerLaw, robot: PairedRobot) -> None:
    drive(law, robot, direction_target(0, 0.3), at_most_s=2)
    steps = drive(law, robot, direction_target(0, 0.6), at_most_s=1)
    assert steps[0].record.speed_m_s > 0.3
    assert steps[-1].record.speed_m_s == 0.6
    assert {step.record.phase for step in steps} == {Phase.DRIVING}


def test_reversing_passes_through_rest_within_the_acceleration(law: PairedSteerLaw, robot: PairedRobot) -> None:
    drive(law, robot, direction_target(0, 0.3), at_most_s=2)
    speeds = [step.record.speed_m_s for step in drive(law, robot, direction_target(math.pi, 0.3), at_most_s=2)]
    assert speeds[-1] == pytest.approx(-0.3)
    assert max(a - b for a, b in pairwise(speeds)) <= LIMITS.acceleration_m_s2 * DT * (1 + 1e-9)


def test_a_new_direction_while_driving_means_rest_steer_and_go_on(law: PairedSteerLaw, robot: PairedRobot) -> None:
    drive(law, robot, direction_target(0, 0.4), at_most_s=2)
    steps = drive(law, robot, direction_target(math.radians(45), 0.4), at_most_s=8)
    assert [phase for phase, _ in phases(steps)][:2] == [Phase.STOPPING, Phase.RELEASING_BRAKE]
    assert steps[-1].record.phase is Phase.DRIVING
    assert headings_deg(robot) == pytest.approx([45, 45], abs=0.2)


def test_a_slightly_new_direction_while_driving_is_not_steered_for(law: PairedSteerLaw, robot: PairedRobot) -> None:
    drive(law, robot, direction_target(0, 0.4), at_most_s=2)
    steps = drive(law, robot, direction_target(math.radians(0.7), 0.4), at_most_s=1)
    assert {step.record.phase for step in steps} == {Phase.DRIVING}


def test_a_stream_of_targets_steers_and_drives_like_one(law: PairedSteerLaw, robot: PairedRobot) -> None:
    for cycle in range(600):
        measurement = robot.measure()
        jitter = math.radians(0.3) * math.sin(cycle)
        command, record = law.step(measurement, direction_target(math.radians(20) + jitter, 0.4), DT)
        robot.act(command)
    assert record.phase is Phase.DRIVING
    assert robot.speed == pytest.approx([0.4] * 4, rel=0.005)


def test_a_stream_that_stands_still_does_not_steer(law: PairedSteerLaw, robot: PairedRobot) -> None:
    steps = drive(law, robot, direction_target(math.radians(50), 0.0), at_most_s=1)
    assert steps[-1].record.phase is Phase.RESTING
    assert headings_deg(robot) == [0, 0]


def test_a_stream_may_stop_and_go_without_steering(law: PairedSteerLaw, robot: PairedRobot) -> None:
    drive(law, robot, direction_target(0, 0.4), at_most_s=2)
    drive(law, robot, direction_target(0, 0.0), at_most_s=0.2)
    assert drive(law, robot, direction_target(0, 0.4), at_most_s=0.02)[0].record.phase is Phase.DRIVING


@settings(deadline=None, max_examples=25)
@given(
    st.lists(
        st.tuples(
            st.floats(-1.4, 1.4),
            st.floats(-1.4, 1.4),
            st.floats(-0.3, 0.3),
            st.none() | st.floats(0, 1),
            st.floats(0, 3),
        ),
        min_size=1,
        max_size=4,
    )
)
def test_whatever_is_asked_brakes_and_wheels_keep_their_rules(
    motions: list[tuple[float, float, float, float | None, float]],
) -> None:
    law, robot = PairedSteerLaw(GEOMETRY, LIMITS), PairedRobot()
    for rear, front, speed, distance, seconds in motions:
        for step in drive(law, robot, PairedSteerTarget(rear, front, speed, distance), at_most_s=seconds):
            wheels, measured = step.command.wheel_speed_m_s, step.measurement
            assert sum(step.command.release_brake) <= 1
            if not measured.brake_engaged[0]:
                assert wheels[2:] == (0, 0)
                assert wheels[0] == -wheels[1]
                assert wheels[0] == 0 or measured.brake_released[0]
            if not measured.brake_engaged[1]:
                assert wheels[:2] == (0, 0)
                assert wheels[2] == -wheels[3]
                assert wheels[2] == 0 or measured.brake_released[1]


def test_a_brake_that_does_not_release_is_named(law: PairedSteerLaw, robot: PairedRobot) -> None:
    robot.brake_time_s = math.inf
    steps = drive(law, robot, steer_target(1, 0.5))
    assert "front steering brake is not certainly released" in steps[-1].record.failure
    assert steps[-1].command == Command(STANDING, (False, False))


def test_a_brake_that_does_not_engage_is_named(law: PairedSteerLaw, robot: PairedRobot) -> None:
    robot.brake[0], robot.brake_time_s = 0.5, math.inf
    failure = drive(law, robot, parallel_target(0, 0.5, 1))[-1].record.failure
    assert "rear steering brake is not certainly engaged" in failure


def test_a_jammed_pair_fails_with_its_name(law: PairedSteerLaw, robot: PairedRobot) -> None:
    robot.jammed = True
    failure = drive(law, robot, steer_target(0, 0.5))[-1].record.failure
    assert failure.startswith("rear: the pair does not turn")


def test_an_encoder_that_counts_backward_is_found_out(law: PairedSteerLaw, robot: PairedRobot) -> None:
    robot.encoder_sign = -1.0
    assert "turns away" in drive(law, robot, steer_target(0, 0.5))[-1].record.failure


def test_wheels_that_never_rest_are_reported(law: PairedSteerLaw, robot: PairedRobot) -> None:
    still = msgspec.structs.replace(robot.measure(), wheel_speed_m_s=(0.1, 0.1, 0.1, 0.1))
    target = steer_target(1, 0.5)
    failures = [law.step(still, target, DT)[1].failure for _ in range(400)]
    assert "do not come to rest" in failures[-1]


def test_a_brake_lost_while_driving_stops_the_robot(law: PairedSteerLaw, robot: PairedRobot) -> None:
    target = direction_target(0, 0.4)
    drive(law, robot, target, at_most_s=2)
    robot.brake[1] = 0.5
    assert "front steering brake is not certainly engaged while driving" in drive(law, robot, target)[-1].record.failure


def test_a_pair_that_slips_through_its_brake_stops_the_robot(law: PairedSteerLaw, robot: PairedRobot) -> None:
    target = direction_target(0, 0.4)
    drive(law, robot, target, at_most_s=2)
    robot.heading[0] = math.radians(6)
    assert "rear pair turned although its brake is engaged" in drive(law, robot, target)[-1].record.failure


def test_after_a_failure_the_robot_ramps_to_rest_and_takes_a_new_target(
    law: PairedSteerLaw, robot: PairedRobot
) -> None:
    target = direction_target(0, 0.4)
    drive(law, robot, target, at_most_s=2)
    robot.brake[1] = 0.5
    for _ in range(100):
        robot.act(law.step(robot.measure(), target, DT)[0])
    assert robot.speed == [0.0] * 4
    assert drive(law, robot, parallel_target(0, 0.5, 1))[-1].record.done


def test_a_target_beyond_the_limits_moves_nothing(law: PairedSteerLaw, robot: PairedRobot) -> None:
    steps = drive(law, robot, parallel_target(math.radians(95), 0.5, 1))
    assert "beyond the limit to each side" in steps[-1].record.failure
    assert steps[-1].command == Command(STANDING, (False, False))


def test_a_target_beyond_the_limits_stops_a_rolling_robot_by_its_ramp(law: PairedSteerLaw, robot: PairedRobot) -> None:
    drive(law, robot, direction_target(0, 0.4), at_most_s=2)
    command, _ = law.step(robot.measure(), direction_target(0, 9.0), DT)
    assert command.wheel_speed_m_s[0] == pytest.approx(0.4 - LIMITS.acceleration_m_s2 * DT)
