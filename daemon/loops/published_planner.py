"""The Turtle robot's trajectory planner as its report prints it (listing C.1, mdlOutputs), call by call.

The planner turns distance to go and velocity into an acceleration. An angle alpha shares speed and acceleration limit
between the axes, v_max (cos alpha, sin alpha), and is bisected until both axes arrive at the same time; it is kept for
the next call. This mode exists for comparison: it has the report's peaks above a_max and its other irregularities,
which docs/turtle.md lists.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Final, NamedTuple

from daemon.loops.published_planner_axis import (
    POSITION_WINDOW_M,
    SAMPLE_TIME_S,
    AxisCase,
    AxisPlan,
    plan_axis,
    settle,
)

Vector = tuple[float, float]
Cases = tuple[AxisCase | None, AxisCase | None]

ARRIVED_SPEED_M_S: Final = 0.3
"""An axis inside the position window arrives at speeds that differ less than this from the final one."""
SYNCHRONISED_S: Final = 1e-3
"""Difference of arrival times at which bisection ends."""
MAX_BISECTIONS: Final = 51
FINAL_SPEED_SHARE: Final = 0.8
"""Of v_max, that the final velocity may have."""
LEAST_FINAL_SPEED_M_S: Final = 0.3
"""Of one axis; half of it and more is rounded up, less is rounded to 0."""
_LEAST_LIMIT: Final = 1e-300
"""Keeps an axis' share of a limit from being rounded to 0."""


class Branch(StrEnum):
    """Which way a call took."""

    BOTH_CONVERGED = "both_converged"
    X_CONVERGED = "x_converged"
    Y_CONVERGED = "y_converged"
    UNSYNCHRONISED = "unsynchronised"
    """Each axis for itself with all of v_max and a_max: the keeper."""
    ONLY_X_MOVES = "only_x_moves"
    """No angle lets both axes arrive together: y waits without acceleration."""
    ONLY_Y_MOVES = "only_y_moves"
    SYNCHRONISED = "synchronised"
    INFEASIBLE = "infeasible"
    """v_max is not above the rounded final speed, or a number is unusable: brakes. The listing computes NaN here."""


@dataclass(frozen=True, slots=True)
class PlanningProblem:
    """Where to go from where, in the field's frame.

    Attributes:
        offset_m: goal minus position.
        velocity_m_s: measured.
        final_velocity_m_s: wanted at the goal.
        v_max: speed limit [m/s].
        a_max: acceleration limit [m/s2].
        keeper: each axis for itself (robotID 1).
    """

    offset_m: Vector
    velocity_m_s: Vector
    final_velocity_m_s: Vector
    v_max: float
    a_max: float
    keeper: bool = False

    @property
    def usable(self) -> bool:
        """Whether all numbers are finite and the limits positive."""
        numbers = (*self.offset_m, *self.velocity_m_s, *self.final_velocity_m_s, self.v_max, self.a_max)
        return all(map(math.isfinite, numbers)) and self.v_max > 0 and self.a_max > 0


class ControlledLimit(NamedTuple):
    """a_max as the traction controller leaves it.

    Attributes:
        x: acceleration limit at the x axis' command [m/s2].
        y: the same at the y axis' command, lower where only slip in y was answered; it is the one that is shared.
        answered_x: True when the controller answered slip or recovery in x: the overshoot flag of x is withheld.
    """

    x: float
    y: float
    answered_x: bool


@dataclass(frozen=True, slots=True)
class PlannedStep:
    """The terms of one call.

    Attributes:
        branch: the way the call took.
        acceleration_m_s2: the command.
        eta_s: estimated time of arrival.
        cases: of both axes; None for one that gets no acceleration in this branch.
        overshoot: flags of both axes as :class:`AxisPlan` tells them, from the last call that planned the axis.
        alpha_rad: angle that shares the limits; pi/2 gives all to y.
        bisections: halvings of alpha in this call.
        final_velocity_m_s: after the feasibility rules.
        not_converged: estimates of this call that did not converge, and count as 0 s.
    """

    branch: Branch
    acceleration_m_s2: Vector
    eta_s: float
    cases: Cases
    overshoot: tuple[int, int]
    alpha_rad: float
    bisections: int
    final_velocity_m_s: Vector
    not_converged: int


def feasible_final_velocity(final_velocity: Vector, v_max: float) -> Vector:
    """The final velocity scaled down to 0.8 v_max, then each axis rounded to 0 or up to 0.3 m/s."""
    x, y = final_velocity
    speed = math.sqrt(x * x + y * y)
    if speed > FINAL_SPEED_SHARE * v_max:
        x = x * (FINAL_SPEED_SHARE * v_max) / speed
        y = y * (FINAL_SPEED_SHARE * v_max) / speed
    return _rounded(x), _rounded(y)


def _rounded(speed: float) -> float:
    if abs(speed) < 0.5 * LEAST_FINAL_SPEED_M_S:
        return 0.0
    return math.copysign(max(abs(speed), LEAST_FINAL_SPEED_M_S), speed)


class _AngleRange(NamedTuple):
    """Angles that leave each axis its final speed, and arrival times at both ends; 0 s where no end is limited."""

    least: float
    most: float
    eta_x_least: float
    eta_x_most: float
    eta_y_least: float
    eta_y_most: float


class PublishedPlanner:
    """The planner with what it keeps between calls: the angle, and the overshoot flags of both axes."""

    def __init__(self, sample_time_s: float = SAMPLE_TIME_S) -> None:
        self._dt = sample_time_s
        self._alpha = 0.25 * math.pi
        self._overshoot = [0, 0]
        self._not_converged = 0
        self._bisections = 0

    def step(self, problem: PlanningProblem, controlled: ControlledLimit | None = None) -> PlannedStep:
        """One call.

        Args:
            problem: of this cycle.
            controlled: a_max after the traction controller; all of a_max without one.

        Returns:
            command and terms. Numbers that the listing turns into NaN give ``INFEASIBLE`` and a command that brakes.
        """
        self._not_converged = self._bisections = 0
        if not problem.usable:
            return self._infeasible(problem)
        final = feasible_final_velocity(problem.final_velocity_m_s, problem.v_max)
        problem = replace(problem, final_velocity_m_s=final)
        if not (abs(final[0]) < problem.v_max and abs(final[1]) < problem.v_max):
            return self._infeasible(problem)
        limit = controlled or ControlledLimit(problem.a_max, problem.a_max, False)
        angles = self._angle_range(problem)
        self._alpha = min(max(self._alpha, angles.least), angles.most)
        x_arrived = self._arrived(problem, 0)
        y_arrived = self._arrived(problem, 1)
        if x_arrived or y_arrived:
            return self._one_or_both_arrived(problem, limit, x_arrived, y_arrived)
        if problem.keeper:
            return self._unsynchronised(problem, limit)
        if angles.eta_y_least > angles.eta_x_most:
            return self._only_y(problem, limit, angles.most)
        if angles.eta_x_least > angles.eta_y_most:
            return self._only_x(problem, limit, angles.least)
        return self._synchronised(problem, limit, angles)

    def _angle_range(self, problem: PlanningProblem) -> _AngleRange:
        least, most = 0.0, 0.5 * math.pi
        eta_x_least = eta_x_most = eta_y_least = eta_y_most = 0.0
        v_max, a_max, final = problem.v_max, problem.a_max, problem.final_velocity_m_s
        if final[0]:
            most = math.acos(abs(final[0]) / v_max)
            eta_x_most = self._plan(problem, 0, abs(final[0]), math.cos(most) * a_max).eta_s
            eta_y_least = self._plan(problem, 1, math.sin(most) * v_max, math.sin(most) * a_max).eta_s
        if final[1]:
            least = math.asin(abs(final[1]) / v_max)
            eta_x_least = self._plan(problem, 0, math.cos(least) * v_max, math.cos(least) * a_max).eta_s
            eta_y_most = self._plan(problem, 1, abs(final[1]), math.sin(least) * a_max).eta_s
        return _AngleRange(least, most, eta_x_least, eta_x_most, eta_y_least, eta_y_most)

    def _plan(self, problem: PlanningProblem, axis: int, v_max: float, a_max: float) -> AxisPlan:
        v_max, a_max = max(v_max, _LEAST_LIMIT), max(a_max, _LEAST_LIMIT)
        final_speed = problem.final_velocity_m_s[axis]
        plan = plan_axis(problem.offset_m[axis], problem.velocity_m_s[axis], final_speed, v_max, a_max, self._dt)
        self._overshoot[axis] = plan.overshoot
        self._not_converged += not plan.converged
        return plan

    @staticmethod
    def _arrived(problem: PlanningProblem, axis: int) -> bool:
        near = abs(problem.offset_m[axis]) <= POSITION_WINDOW_M
        return near and abs(problem.final_velocity_m_s[axis] - problem.velocity_m_s[axis]) < ARRIVED_SPEED_M_S

    def _one_or_both_arrived(
        self, problem: PlanningProblem, limit: ControlledLimit, x_arrived: bool, y_arrived: bool
    ) -> PlannedStep:
        """An axis that arrived only corrects its speed; the other one has all of v_max and a_max."""
        x = self._settle(problem, 0, limit.x) if x_arrived else self._plan_whole(problem, 0, limit.x)
        y = self._settle(problem, 1, limit.y) if y_arrived else self._plan_whole(problem, 1, limit.y)
        if x_arrived and y_arrived:
            return self._record(Branch.BOTH_CONVERGED, x, y, max(x.eta_s, y.eta_s), problem)
        if x_arrived:
            return self._record(Branch.X_CONVERGED, x, y, y.eta_s, problem)
        self._withhold_overshoot(limit)
        return self._record(Branch.Y_CONVERGED, x, y, x.eta_s, problem)

    def _settle(self, problem: PlanningProblem, axis: int, a_max: float) -> AxisPlan:
        speed, final_speed = problem.velocity_m_s[axis], problem.final_velocity_m_s[axis]
        acceleration = settle(final_speed, speed, a_max, self._dt)
        eta_s = (final_speed - speed) / acceleration if acceleration else 0.0
        return AxisPlan(eta_s, acceleration, AxisCase.ARRIVED, 0, True)

    def _plan_whole(self, problem: PlanningProblem, axis: int, a_max: float) -> AxisPlan:
        return self._plan(problem, axis, problem.v_max, a_max)

    def _withhold_overshoot(self, limit: ControlledLimit) -> None:
        if limit.answered_x:
            self._overshoot[0] = 0

    def _unsynchronised(self, problem: PlanningProblem, limit: ControlledLimit) -> PlannedStep:
        x = self._plan_whole(problem, 0, limit.x)
        y = self._plan_whole(problem, 1, limit.y)
        self._withhold_overshoot(limit)
        return self._record(Branch.UNSYNCHRONISED, x, y, max(x.eta_s, y.eta_s), problem)

    def _only_x(self, problem: PlanningProblem, limit: ControlledLimit, alpha: float) -> PlannedStep:
        self._alpha = alpha
        x = self._plan(problem, 0, math.cos(alpha) * problem.v_max, math.cos(alpha) * limit.y)
        self._withhold_overshoot(limit)
        return self._record(Branch.ONLY_X_MOVES, x, None, x.eta_s, problem)

    def _only_y(self, problem: PlanningProblem, limit: ControlledLimit, alpha: float) -> PlannedStep:
        self._alpha = alpha
        y = self._plan(problem, 1, math.sin(alpha) * problem.v_max, math.sin(alpha) * limit.y)
        return self._record(Branch.ONLY_Y_MOVES, None, y, y.eta_s, problem)

    def _synchronised(self, problem: PlanningProblem, limit: ControlledLimit, angles: _AngleRange) -> PlannedStep:
        least, most = angles.least, angles.most
        x, y = self._plan_shared(problem, limit)
        self._withhold_overshoot(limit)
        while abs(x.eta_s - y.eta_s) > SYNCHRONISED_S and self._bisections < MAX_BISECTIONS:
            if x.eta_s < y.eta_s:
                least = self._alpha
                self._alpha = 0.5 * self._alpha + 0.5 * most
            else:
                most = self._alpha
                self._alpha = 0.5 * self._alpha + 0.5 * least
            x, y = self._plan_shared(problem, limit)
            self._bisections += 1
        return self._record(Branch.SYNCHRONISED, x, y, 0.5 * (x.eta_s + y.eta_s), problem)

    def _plan_shared(self, problem: PlanningProblem, limit: ControlledLimit) -> tuple[AxisPlan, AxisPlan]:
        cos, sin = math.cos(self._alpha), math.sin(self._alpha)
        x = self._plan(problem, 0, cos * problem.v_max, cos * limit.y)
        return x, self._plan(problem, 1, sin * problem.v_max, sin * limit.y)

    def _infeasible(self, problem: PlanningProblem) -> PlannedStep:
        """Brake along the velocity, to rest in one step where ``a_max`` allows."""
        (vx, vy), speed = problem.velocity_m_s, math.hypot(*problem.velocity_m_s)
        braking = (0.0, 0.0)
        if math.isfinite(speed) and speed > 0 and problem.a_max > 0:
            gain = min(1 / self._dt, problem.a_max / speed)
            braking = (-gain * vx, -gain * vy)
        return self._step(Branch.INFEASIBLE, braking, math.inf, (None, None), problem)

    def _record(
        self, branch: Branch, x: AxisPlan | None, y: AxisPlan | None, eta_s: float, problem: PlanningProblem
    ) -> PlannedStep:
        acceleration = (0.0 if x is None else x.acceleration, 0.0 if y is None else y.acceleration)
        cases = (None if x is None else x.case, None if y is None else y.case)
        return self._step(branch, acceleration, eta_s, cases, problem)

    def _step(
        self, branch: Branch, acceleration: Vector, eta_s: float, cases: Cases, problem: PlanningProblem
    ) -> PlannedStep:
        return PlannedStep(
            branch=branch,
            acceleration_m_s2=acceleration,
            eta_s=eta_s,
            cases=cases,
            overshoot=(self._overshoot[0], self._overshoot[1]),
            alpha_rad=self._alpha,
            bisections=self._bisections,
            final_velocity_m_s=problem.final_velocity_m_s,
            not_converged=self._not_converged,
        )
