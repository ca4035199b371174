"""The guides and the law of a robot on omni-wheels, without a robot."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from daemon.loops.accelerometer import Mounting
from daemon.loops.measurement import Measurement
from daemon.loops.odometry import Pose
from daemon.loops.omni import OmniKinematics, turtle_wheels
from daemon.loops.omni_drive import OmniLaw
from daemon.loops.omni_guide import Felt, GoalGuide, Guidance, Guide, TwistGuide
from daemon.loops.omni_senses import OmniOdometry, OmniSenses
from daemon.loops.planner import PlanarLimits, PlanarState, Result
from daemon.loops.traction import Traction

LIMITS = PlanarLimits(1.2, 1.2, 1.5, 2.0)
KINEMATICS = OmniKinematics(turtle_wheels(0.2, 0.22, 0.18))
DT = 0.01


def blind() -> OmniSenses:
    """A robot that knows its wheels alone."""
    return OmniSenses(KINEMATICS, Mounting(), None)


def lead(guide: Guide, start: PlanarState, steps: int = 2000) -> list[Guidance]:
    """The reference of a robot that follows exactly."""
    told: list[Guidance] = []
    state, acceleration = start, (0.0, 0.0)
    while len(told) < steps and (not told or told[-1].result is Result.MOVING):
        told.append(guide.step(state, Felt(), acceleration, DT))
        state, acceleration = told[-1].next, told[-1].acceleration_m_s2
    return told


def test_a_goal_is_reached_with_all_that_every_step_tells() -> None:
    told = lead(GoalGuide(PlanarState(1.0, 0.5, 1.0), LIMITS, Traction(1.2)), PlanarState())
    end = told[-1]
    assert (end.next.x, end.next.y, end.next.heading) == pytest.approx((1.0, 0.5, 1.0), abs=1e-6)
    assert end.result is Result.ARRIVED
    assert all(step.case and step.eta_s >= 0 and step.limits.acceleration <= 1.2 for step in told)
    assert {step.safety_factor for step in told} == {1.0}


def test_a_floor_that_grips_less_lowers_the_acceleration_at_once() -> None:
    guide = GoalGuide(PlanarState(3.0), LIMITS, Traction(1.2))
    state, commanded, last = PlanarState(), (0.0, 0.0), None
    for _ in range(60):
        last = guide.step(state, Felt((0.25 * commanded[0], 0.0)), commanded, DT)
        state, commanded = last.next, last.acceleration_m_s2
    assert last is not None
    assert last.safety_factor < 0.5
    assert abs(last.acceleration_m_s2[0]) <= last.safety_factor * 1.2 + 1e-9


@given(st.floats(-1.2, 1.2), st.floats(-1.2, 1.2), st.floats(-1.5, 1.5), st.floats(-0.8, 0.8), st.floats(-1.5, 1.5))
def test_a_twist_is_reached_within_the_limits(
    forward: float, left: float, rate: float, start_vx: float, start_rate: float
) -> None:
    guide = TwistGuide((forward, left, rate), LIMITS)
    state = PlanarState(vx=start_vx, rate=start_rate)
    for _ in range(400):
        told = guide.step(state, Felt(), (0.0, 0.0), DT)
        assert math.hypot(*told.acceleration_m_s2) <= 1.2 * (1 + 1e-9)
        assert abs(told.next.rate - state.rate) <= 2.0 * DT * (1 + 1e-9)
        state = told.next
    assert state.rate == pytest.approx(rate)


def test_a_stopped_law_comes_to_rest_and_is_done() -> None:
    senses = blind()
    law = OmniLaw(KINEMATICS, TwistGuide((0.5, 0.0, 0.0), LIMITS), LIMITS, senses)
    travel, done = [0.0, 0.0, 0.0], False
    for cycle in range(300):
        if cycle == 100:
            law.stop()
        command, record = law.step(senses, DT)
        travel = [way + speed * DT for way, speed in zip(travel, command.wheel_speed_m_s, strict=True)]
        senses.update(Measurement(cycle * DT, command.wheel_speed_m_s, tuple(travel)), DT, powered=True, standing=False)
        done = done or record.done
        assert record.stopping is (cycle >= 100)
    assert done
    assert command.wheel_speed_m_s == pytest.approx((0.0, 0.0, 0.0), abs=1e-3)


def test_the_law_never_corrects_by_more_than_it_may() -> None:
    law = OmniLaw(KINEMATICS, TwistGuide((0.0, 0.0, 0.0), LIMITS), LIMITS, blind())
    displaced = blind()
    rolled = KINEMATICS.wheel_speeds((0.1, -0.14, 0.2))
    for step in range(4):
        travel = tuple(step * way for way in rolled)
        displaced.update(Measurement(step * DT, (0.0, 0.0, 0.0), travel), DT, powered=True, standing=False)
    command, record = law.step(displaced, DT)
    vx, vy, rate = KINEMATICS.body_motion(command.wheel_speed_m_s)
    assert math.hypot(vx, vy) == pytest.approx(0.3)
    assert abs(rate) == pytest.approx(0.3)
    assert record.error[:2] == (-displaced.pose.x_m, -displaced.pose.y_m)


def test_odometry_adds_up_an_arc_exactly() -> None:
    odometry = OmniOdometry(KINEMATICS)
    speeds = KINEMATICS.wheel_speeds((0.5, 0.0, 0.5))
    for cycle in range(201):
        travel = tuple(speed * cycle * DT for speed in speeds)
        odometry.update(Measurement(cycle * DT, speeds, travel))
    assert odometry.pose.yaw_rad == pytest.approx(1.0)
    assert (odometry.pose.x_m, odometry.pose.y_m) == pytest.approx((math.sin(1.0), 1 - math.cos(1.0)))
    assert odometry.motion == pytest.approx((0.5, 0.0, 0.5))


def test_odometry_leaves_a_counter_that_begins_anew_out() -> None:
    odometry = OmniOdometry(KINEMATICS)
    odometry.update(Measurement(0.0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)))
    odometry.update(Measurement(0.01, (0.0, 0.0, 0.0), (80.0, 0.0, 0.0)))
    assert odometry.pose == Pose()
    assert odometry.skipped == 1
