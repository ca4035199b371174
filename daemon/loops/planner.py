"""Motion in the plane to a place, heading and velocity, as fast as the limits allow; both are reached together.

Speed and acceleration are limited as vectors (the acceleration by a friction circle). A plan is made once and followed;
made anew from any state, moving or not, it is the way from there. Nothing is kept outside the plan.

On the last run-up to a goal that is to be passed fast, a hair off the plan can mean that the goal is only met after
another loop. `follow` therefore keeps the plan within a tolerance; do not plan anew in every cycle there.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum
from typing import Final

from daemon.loops import planner_axis, planner_way
from daemon.loops.planner_axis import AxisPlan
from daemon.loops.planner_way import Way

FARTHEST: Final = 1e5
"""Largest place, heading and speed that is planned with, and root of the sum of their squares [SI]."""
LATEST_S: Final = 1e9
"""Latest time that is planned with."""
LIMIT_RANGE: Final = (1e-3, 1e3)
"""Smallest and largest limit that is planned with [SI]."""
NEAR_M: Final = 1e-3
"""A straight change of velocity that ends as near to the goal as this is the way to it: no loop for the last hair."""
NOTHING: Final = 1e-12
"""Smaller numbers are none [SI]."""
LONGEST_CYCLE_S: Final = 10.0
ROUNDED: Final = 1 + 1e-9
"""A velocity above its limit by this factor is at it."""
STILL: Final = AxisPlan(0.0, ())
"""The heading stays."""


class Result(StrEnum):
    """What becomes of a motion."""

    MOVING = "moving"
    ARRIVED = "arrived"
    SLOWING = "slowing"
    """Faster than the limit: braking to it first."""
    GOAL_TOO_FAST = "goal too fast"
    """A velocity at the goal is above its limit: braking to rest instead."""
    INVALID = "invalid"
    """A number is none or out of range: nothing is planned, and zero is commanded."""


@dataclass(frozen=True, slots=True)
class PlanarState:
    """Where a body is and how it moves, in a fixed frame.

    Attributes:
        x: [m].
        y: to the left of x [m].
        heading: counter-clockwise from x [rad].
        vx: velocity along x [m/s].
        vy: velocity along y [m/s].
        rate: of the heading [rad/s].
    """

    x: float = 0.0
    y: float = 0.0
    heading: float = 0.0
    vx: float = 0.0
    vy: float = 0.0
    rate: float = 0.0


@dataclass(frozen=True, slots=True)
class PlanarLimits:
    """The highest speed [m/s], acceleration [m/s2], rate of the heading [rad/s] and its acceleration [rad/s2]."""

    speed: float
    acceleration: float
    rate: float
    angular_acceleration: float


@dataclass(frozen=True, slots=True)
class Tolerance:
    """How far a body may be from its plan before a new one is made."""

    distance_m: float = 0.01
    speed_m_s: float = 0.05
    heading_rad: float = 0.02
    rate_rad_s: float = 0.1


@dataclass(slots=True)
class Plan:
    """A motion from a state to a goal.

    Attributes:
        result: MOVING, SLOWING, or why there is no way to the goal.
        began: time at its start [s].
        start: state at its start.
        goal: where it leads; the heading the shorter way round.
        allowed: limits given.
        limits: limits in force; accelerations are lower where place or heading waits for the other.
        way: of the place.
        turn: of the heading.
    """

    result: Result
    began: float
    start: PlanarState
    goal: PlanarState
    allowed: PlanarLimits
    way: Way
    turn: AxisPlan

    @property
    def limits(self) -> PlanarLimits:
        """In force; accelerations are lower where place or heading waits for the other."""
        allowed = self.allowed
        strongest = max((abs(acceleration) for duration, acceleration in self.turn.pieces if duration), default=0.0)
        return PlanarLimits(allowed.speed, self.way.acceleration, allowed.rate, strongest)

    @property
    def ends(self) -> float:
        """Time of arrival [s]."""
        return self.began + max(self.way.duration, self.turn.duration)

    def at(self, now: float) -> PlanarState:
        """The state planned for a time [s]; after the end the goal's velocity is held."""
        time = max(0.0, now - self.began)
        way, velocity = self.way.at(time)
        turned, rate = self.turn.at(time)
        start = self.start
        return PlanarState(
            start.x + way.real, start.y + way.imag, start.heading + turned, velocity.real, velocity.imag, rate
        )


@dataclass(slots=True)
class Step:
    """What to do for the next cycle, and why.

    Attributes:
        result: what becomes of the motion.
        case: arc in force, as "bend" or "cruise".
        acceleration_m_s2: to apply over the cycle, x and y of the fixed frame.
        angular_acceleration_rad_s2: to apply over the cycle.
        next: state planned for the end of the cycle.
        eta_s: time left.
        plan: that was followed, with the limits in force: the given one, or a new one if the body was off its plan.
    """

    result: Result
    case: str
    acceleration_m_s2: tuple[float, float]
    angular_acceleration_rad_s2: float
    next: PlanarState
    eta_s: float
    plan: Plan


def plan_motion(start: PlanarState, goal: PlanarState, limits: PlanarLimits, now: float = 0.0) -> Plan:
    """The fastest motion from a state to a goal, or a plan whose result says why there is none.

    Args:
        start: state now.
        goal: place, heading and velocity to reach.
        limits: to keep.
        now: time [s].
    """
    if not _plannable(start, goal, limits, now):
        return _nothing(goal, limits)
    fast = math.hypot(goal.vx, goal.vy) > limits.speed * ROUNDED or abs(goal.rate) > limits.rate * ROUNDED
    way, turn = _to_rest(start, limits) if fast else _together(start, goal, limits)
    return Plan(Result.GOAL_TOO_FAST if fast else Result.MOVING, now, start, goal, limits, way, turn)


def follow(
    plan: Plan,
    now: float,
    state: PlanarState,
    dt: float,
    tolerance: Tolerance = Tolerance(),
) -> Step:
    """What to do for the next cycle; a body that is off its plan gets a new one to the same goal.

    Args:
        plan: to follow.
        now: time [s].
        state: measured now.
        dt: length of the cycle [s].
        tolerance: how far from the plan a body is still on it.
    """
    if not (0.0 < dt <= LONGEST_CYCLE_S and abs(now) <= LATEST_S):
        return _idle(_nothing(plan.goal, plan.allowed))
    here = plan.at(now)
    if plan.result is Result.INVALID or not _near(here, state, tolerance):
        plan = plan_motion(state, plan.goal, plan.allowed, now)
        here = plan.at(now)
    if plan.result is Result.INVALID:
        return _idle(plan)
    there = plan.at(now + dt)
    ax, ay = (there.vx - here.vx) / dt, (there.vy - here.vy) / dt
    rounding = min(1.0, plan.allowed.acceleration / (math.hypot(ax, ay) or 1.0))
    angular = plan.allowed.angular_acceleration
    return Step(
        _result(plan, here, now),
        plan.way.case(now - plan.began),
        (ax * rounding, ay * rounding),
        max(-angular, min(angular, (there.rate - here.rate) / dt)),
        there,
        max(0.0, plan.ends - now),
        plan,
    )


def _plannable(start: PlanarState, goal: PlanarState, limits: PlanarLimits, now: float) -> bool:
    low, high = LIMIT_RANGE
    return (
        math.hypot(start.x, start.y, start.heading, start.vx, start.vy, start.rate) <= FARTHEST
        and math.hypot(goal.x, goal.y, goal.heading, goal.vx, goal.vy, goal.rate) <= FARTHEST
        and low <= limits.speed <= high
        and low <= limits.acceleration <= high
        and low <= limits.rate <= high
        and low <= limits.angular_acceleration <= high
        and abs(now) <= LATEST_S
    )


def _nothing(goal: PlanarState, limits: PlanarLimits) -> Plan:
    way = planner_way.braking(0j, 1.0, 1.0)
    return Plan(Result.INVALID, 0.0, PlanarState(), goal, limits, way, STILL)


def _idle(plan: Plan) -> Step:
    return Step(plan.result, "none", (0.0, 0.0), 0.0, plan.start, 0.0, plan)


def _to_rest(start: PlanarState, limits: PlanarLimits) -> tuple[Way, AxisPlan]:
    way = planner_way.braking(complex(start.vx, start.vy), limits.speed, limits.acceleration)
    return way, planner_axis.braking(start.rate, limits.angular_acceleration)


def _together(start: PlanarState, goal: PlanarState, limits: PlanarLimits) -> tuple[Way, AxisPlan]:
    """Way and turn of the same duration: the faster one is slowed down.

    Not every duration is possible for a turn that begins and ends moving; one with a rest in it can take any
    duration from its shortest on.
    """
    travel = _vector(goal.x - start.x, goal.y - start.y)
    begin, end = _vector(start.vx, start.vy), _vector(goal.vx, goal.vy)
    angle = math.remainder(goal.heading - start.heading, math.tau)
    fastest = planner_way.fastest(travel, begin, end, limits.speed, limits.acceleration, NEAR_M)
    if math.hypot(angle, start.rate, goal.rate) < NOTHING:
        return fastest, STILL
    turn = _plain(angle), _plain(start.rate), _plain(goal.rate)
    turn_limits = limits.rate, limits.angular_acceleration
    shortest = planner_axis.least_duration(*turn, *turn_limits)
    way = planner_way.lasting(fastest, travel, begin, end, shortest)
    matched = planner_axis.in_time(*turn, *turn_limits, way.duration)
    if matched is None:
        rested = planner_axis.with_a_rest(*turn, *turn_limits, way.duration)
        way = planner_way.lasting(fastest, travel, begin, end, rested.duration)
        matched = planner_axis.with_a_rest(*turn, *turn_limits, way.duration)
    return way, matched


def _vector(x: float, y: float) -> complex:
    vector = complex(x, y)
    return vector if abs(vector) >= NOTHING else 0j


def _plain(number: float) -> float:
    return 0.0 if abs(number) < NOTHING else number


def _near(planned: PlanarState, state: PlanarState, tolerance: Tolerance) -> bool:
    return (
        math.hypot(state.x - planned.x, state.y - planned.y) <= tolerance.distance_m
        and math.hypot(state.vx - planned.vx, state.vy - planned.vy) <= tolerance.speed_m_s
        and abs(state.heading - planned.heading) <= tolerance.heading_rad
        and abs(state.rate - planned.rate) <= tolerance.rate_rad_s
    )


def _result(plan: Plan, here: PlanarState, now: float) -> Result:
    if plan.result is not Result.MOVING:
        return plan.result
    allowed = plan.allowed
    if math.hypot(here.vx, here.vy) > allowed.speed * ROUNDED or abs(here.rate) > allowed.rate * ROUNDED:
        return Result.SLOWING
    return Result.ARRIVED if now >= plan.ends else Result.MOVING
