"""The Turtle robot's traction controller as its report prints it (chapter 7), in its place before the planner.

Slip lowers a safety factor between 0.1 and 1 that multiplies a_max: by a fixed step at first, by twice the last change
while it goes on slipping, back by half of it when it does not.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import Final

from daemon.loops.published_planner import (
    Cases,
    ControlledLimit,
    PlannedStep,
    PlanningProblem,
    PublishedPlanner,
    Vector,
)
from daemon.loops.published_planner_axis import SAMPLE_TIME_S
from daemon.loops.slip import THRESHOLD_M_S2, AxisSlipDetector

LEAST_FACTOR: Final = 0.1
NEAR_ONE: Final = 0.005
"""A factor nearer than this to 1 counts as 1 (EPSILON_SF_LAST)."""
NEAR_ZERO: Final = 0.05
"""A change smaller than this counts as none (EPSILON_dSF_LAST)."""
STANDARD_STEP: Final = 0.1
"""First answer to slip (EPSILON_STAND_VAL)."""


class Correction(IntEnum):
    """What one call did to the safety factor, by the numbers of the report."""

    NONE = 0
    FIRST = 1
    INCREASE = 2
    DECREASE = 3


class SafetyFactor:
    """The subroutine traction_control (listing 7.8).

    Attributes:
        factor: multiplies a_max.
        change: of the last call.
    """

    def __init__(self, factor: float = 1.0, change: float = 0.0) -> None:
        self.factor = factor
        self.change = change

    def step(self, slip: bool) -> Correction:
        """Answer to slip, or to its absence, in one direction."""
        if self.factor > 1 - NEAR_ONE:
            correction = Correction.FIRST if slip else Correction.NONE
            wanted = 1 - self._first_decrease() if slip else 1.0
        elif slip:
            correction, wanted = Correction.DECREASE, self.factor - self._decrease()
        else:
            correction, wanted = Correction.INCREASE, self.factor + self._increase()
        last, self.factor = self.factor, min(max(wanted, LEAST_FACTOR), 1.0)
        self.change = self.factor - last
        return correction

    def _first_decrease(self) -> float:
        return self.change / 2 if self.change >= NEAR_ZERO else STANDARD_STEP

    def _decrease(self) -> float:
        if self.change >= NEAR_ZERO:
            return self.change / 2
        return 2 * abs(self.change) if self.change <= -NEAR_ZERO else STANDARD_STEP

    def _increase(self) -> float:
        if self.change >= NEAR_ZERO:
            return 2 * self.change
        return abs(self.change / 2) if self.change <= -NEAR_ZERO else (1 - self.factor) / 2

    def limit(self, a_max: float, slip: tuple[bool, bool]) -> ControlledLimit:
        """``a_max`` for both axes (listings 7.4 to 7.7): y is only asked when there was nothing to do for x."""
        answered_x = self.step(slip[0]) is not Correction.NONE
        limit_x = self.factor * a_max
        if answered_x:
            return ControlledLimit(limit_x, limit_x, True)
        self.step(slip[1])
        return ControlledLimit(limit_x, self.factor * limit_x, False)


@dataclass(frozen=True, slots=True)
class TractionStep:
    """The terms of one call.

    Attributes:
        planned: what the planner returned for the controlled a_max.
        slip: in x and y.
        safety_factor: that was in force.
        change: of the safety factor, against the call before.
        countdown: steps near the speed limit that are left in x and y (roundmax).
    """

    planned: PlannedStep
    slip: tuple[bool, bool]
    safety_factor: float
    change: float
    countdown: tuple[int, int]


class PublishedTraction:
    """Slip detection, safety factor and planner in the report's order."""

    def __init__(self, threshold_m_s2: float = THRESHOLD_M_S2, sample_time_s: float = SAMPLE_TIME_S) -> None:
        self._planner = PublishedPlanner(sample_time_s)
        self._factor = SafetyFactor()
        self._detectors = (AxisSlipDetector(threshold_m_s2), AxisSlipDetector(threshold_m_s2))
        self._cases: Cases = (None, None)

    def step(self, problem: PlanningProblem, measured: Vector, commanded: Vector) -> TractionStep:
        """One call.

        Args:
            problem: of this cycle, with all of a_max.
            measured: acceleration of the robot's centre [m/s2].
            commanded: acceleration that it should have by the commands so far [m/s2].
        """
        x, y = self._detectors
        slip = (
            x.step(measured[0], commanded[0], self._cases[0]),
            y.step(measured[1], commanded[1], self._cases[1]),
        )
        limit = self._factor.limit(problem.a_max, slip)
        planned = self._planner.step(problem, limit)
        self._cases = planned.cases
        factor, change = self._factor.factor, self._factor.change
        return TractionStep(planned, slip, factor, change, (x.countdown, y.countdown))
