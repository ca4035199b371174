"""Where a robot on omni-wheels shall be next: guides that lead a reference, which the robot is kept on.

A guide gets the reference's state, and the robot's acceleration as measured and as commanded; it answers with the
reference of the next cycle and all that it decided. Frames and signs are those of ``daemon.loops.planner``.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Protocol

from daemon.loops.accelerometer import Vector, rotated
from daemon.loops.planner import Plan, PlanarLimits, PlanarState, Result, follow, plan_motion
from daemon.loops.published_planner import Branch, PlanningProblem
from daemon.loops.published_traction import PublishedTraction
from daemon.loops.traction import Traction

Twist = tuple[float, float, float]
"""Speed forward and to the left [m/s], yaw rate counter-clockwise [rad/s], in the robot's frame."""
Signals = Callable[[float], tuple[Vector, Vector]]
"""Measured and commanded acceleration at a time since the begin of the motion, instead of the robot's own."""

WORTH_A_PLAN = 0.02
"""Change of the safety factor from which on a motion is planned anew."""
STANDING_M_S = 1e-6
WORTH_PASSING_M = 0.02
"""A goal nearer than this is not called overshot."""
ROUNDING = 0.02


@dataclass(frozen=True, slots=True)
class Felt:
    """What a guide is told of the robot in one cycle.

    Attributes:
        acceleration_m_s2: measured, of the centre in the fixed frame; None where nothing tells it.
        slipping: wheels slip.
        pushing: an obstacle holds the robot.
    """

    acceleration_m_s2: Vector | None = None
    slipping: bool = False
    pushing: bool = False


@dataclass(frozen=True, slots=True)
class Guidance:
    """What a guide decided in one cycle.

    Attributes:
        next: reference at the end of the cycle.
        acceleration_m_s2: of the reference over the cycle, in the fixed frame.
        result: what becomes of the motion.
        case: in force, by the planner's words.
        limits: in force.
        eta_s: time left to the goal; infinite where there is none.
        safety_factor: of the traction loop.
        slip: in x and in y, as detected.
        correction: what the traction loop did.
    """

    next: PlanarState
    acceleration_m_s2: Vector
    result: Result
    case: str
    limits: PlanarLimits
    eta_s: float
    safety_factor: float = 1.0
    slip: tuple[bool, bool] = (False, False)
    correction: str = "none"


class Guide(Protocol):
    """Leads a reference."""

    def step(self, reference: PlanarState, felt: Felt, commanded: Vector, dt: float) -> Guidance:
        """One cycle.

        Args:
            reference: where the last cycle led.
            felt: of the robot.
            commanded: acceleration of the reference in the last cycle [m/s2].
            dt: length of the cycle [s].
        """
        ...


class Grip:
    """The traction loop in front of a guide: what limits of acceleration the floor allows now.

    Args:
        limits: of the motion.
        traction: None: all of the limits, always.
    """

    def __init__(self, limits: PlanarLimits, traction: Traction | None) -> None:
        self._whole = limits
        self._traction = traction
        self.limits = limits
        self.factor = 1.0
        self.slip = (False, False)
        self.correction = "none"

    def step(
        self, felt: Felt, commanded: Vector, dt: float, *, at_top_speed: bool = False, overshoot: bool = False
    ) -> None:
        """Take one cycle; the attributes tell what is in force now."""
        measured = felt.acceleration_m_s2
        if self._traction is None or measured is None:
            return
        record = self._traction.step(
            measured, commanded, dt, at_top_speed, overshoot, pushing=felt.pushing, slipping=felt.slipping
        )
        self.factor, self.correction = record.safety_factor, record.correction.value
        self.slip = record.signal.axes if record.signal.slip else (felt.slipping, felt.slipping)
        self.limits = replace(
            self._whole,
            acceleration=self.factor * self._whole.acceleration,
            angular_acceleration=self.factor * self._whole.angular_acceleration,
        )


class GoalGuide:
    """To a place, heading and velocity by the time-optimal planner; planned anew when the floor's grip changes.

    Args:
        goal: in the fixed frame.
        limits: of the motion.
        traction: None: without a traction loop.
    """

    def __init__(self, goal: PlanarState, limits: PlanarLimits, traction: Traction | None = None) -> None:
        self._goal = goal
        self._grip = Grip(limits, traction)
        self._plan: Plan | None = None
        self._planned_with = 1.0
        self._case = ""
        self._now = 0.0

    def step(self, reference: PlanarState, felt: Felt, commanded: Vector, dt: float) -> Guidance:
        """One cycle."""
        grip = self._grip
        overshoot = _passes(reference, self._goal, grip.limits.acceleration)
        grip.step(felt, commanded, dt, at_top_speed=self._case == "cruise", overshoot=overshoot)
        plan = self._plan
        if plan is None or abs(grip.factor - self._planned_with) > WORTH_A_PLAN:
            plan = plan_motion(reference, self._goal, grip.limits, self._now)
            self._planned_with = grip.factor
        step = follow(plan, self._now, reference, dt)
        self._plan, self._case = step.plan, step.case
        self._now += dt
        return Guidance(
            step.next, step.acceleration_m_s2, step.result, step.case, step.plan.limits, step.eta_s,
            grip.factor, grip.slip, grip.correction,
        )  # fmt: skip


class TwistGuide:
    """A twist in the robot's frame, reached by ramps; (0, 0, 0) comes to rest and is then arrived.

    Attributes:
        twist: to reach and hold; may be changed at any time.
    """

    def __init__(self, twist: Twist, limits: PlanarLimits, traction: Traction | None = None) -> None:
        self.twist = twist
        self._grip = Grip(limits, traction)

    def step(self, reference: PlanarState, felt: Felt, commanded: Vector, dt: float) -> Guidance:
        """One cycle."""
        grip, (forward, left, rate) = self._grip, self.twist
        grip.step(felt, commanded, dt)
        rate = _towards(reference.rate, rate, grip.limits.angular_acceleration * dt)
        heading = reference.heading + (reference.rate + rate) / 2 * dt
        wanted = rotated((forward, left), reference.heading + rate * dt)
        vx, vy = _vector_towards((reference.vx, reference.vy), wanted, grip.limits.acceleration * dt)
        following = _moved(reference, (vx, vy), rate, heading, dt)
        standing = self.twist == (0.0, 0.0, 0.0) and math.hypot(vx, vy) < STANDING_M_S and rate == 0.0
        result = Result.ARRIVED if standing else Result.MOVING
        reached = math.dist((vx, vy), wanted) < STANDING_M_S and rate == self.twist[2]
        acceleration = ((vx - reference.vx) / dt, (vy - reference.vy) / dt)
        return Guidance(
            following, acceleration, result, "holding" if reached else "ramp", grip.limits, math.inf,
            grip.factor, grip.slip, grip.correction,
        )  # fmt: skip


class PublishedGuide:
    """To a place and velocity by the planner and the traction controller as published; the heading stays.

    Args:
        goal: in the fixed frame.
        limits: of the motion.
        dt: length of a cycle, the controller's sample time [s].
        signals: accelerations to detect slip by, as the report's simulations impose them; None: those of the robot.
        threshold_m_s2: of slip.
    """

    def __init__(
        self, goal: PlanarState, limits: PlanarLimits, dt: float, signals: Signals | None, threshold_m_s2: float
    ) -> None:
        self._goal = goal
        self._limits = limits
        self._traction = PublishedTraction(threshold_m_s2, dt)
        self._signals = signals
        self._now = 0.0

    def step(self, reference: PlanarState, felt: Felt, commanded: Vector, dt: float) -> Guidance:
        """One cycle."""
        goal, limits, measured = self._goal, self._limits, felt.acceleration_m_s2
        if self._signals is not None:
            measured, commanded = self._signals(self._now)
        self._now += dt
        problem = PlanningProblem(
            (goal.x - reference.x, goal.y - reference.y), (reference.vx, reference.vy), (goal.vx, goal.vy),
            limits.speed, limits.acceleration,
        )  # fmt: skip
        step = self._traction.step(problem, commanded if measured is None else measured, commanded)
        planned = step.planned
        ax, ay = planned.acceleration_m_s2
        velocity = reference.vx + ax * dt, reference.vy + ay * dt
        following = _moved(reference, velocity, 0.0, reference.heading, dt)
        arrived = planned.branch is Branch.BOTH_CONVERGED and math.hypot(ax, ay) * dt < STANDING_M_S
        result = Result.ARRIVED if arrived else Result.MOVING
        if planned.branch is Branch.INFEASIBLE:
            result = Result.GOAL_TOO_FAST
        case = "/".join("none" if case is None else case.name.lower() for case in planned.cases)
        in_force = replace(limits, acceleration=step.safety_factor * limits.acceleration)
        return Guidance(
            following, (ax, ay), result, case, in_force, planned.eta_s, step.safety_factor, step.slip,
        )  # fmt: skip


def _passes(state: PlanarState, goal: PlanarState, acceleration: float) -> bool:
    """Whether the goal is nearer than the way in which the speed can become the goal's."""
    left, square = math.hypot(goal.x - state.x, goal.y - state.y), state.vx**2 + state.vy**2
    return left > WORTH_PASSING_M and square - goal.vx**2 - goal.vy**2 > 2 * acceleration * left * (1 + ROUNDING)


def _towards(speed: float, wanted: float, change: float) -> float:
    return speed + max(-change, min(change, wanted - speed))


def _vector_towards(velocity: Vector, wanted: Vector, change: float) -> Vector:
    (vx, vy), (wx, wy) = velocity, wanted
    distance = math.hypot(wx - vx, wy - vy)
    if distance <= change:
        return wanted
    share = change / distance
    return vx + share * (wx - vx), vy + share * (wy - vy)


def _moved(state: PlanarState, velocity: Vector, rate: float, heading: float, dt: float) -> PlanarState:
    """The state after a cycle in which the velocity changed evenly."""
    vx, vy = velocity
    return PlanarState(
        state.x + (state.vx + vx) / 2 * dt, state.y + (state.vy + vy) / 2 * dt, heading, vx, vy, rate
    )  # fmt: skip
