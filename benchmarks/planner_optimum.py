"""The least time of a motion in the plane, by second-order cone programs."""

from __future__ import annotations

from typing import Any

import cvxpy as cp
import numpy as np

from vcan_tests.daemon.planner_problems import Problem

INTERVALS = 100
MISS = 1e-6
"""What may be missed, relative to 1 + the travel, in units of the limits."""
PRECISION = 2e-5


class Optimum:
    """Velocities at the ends of equal intervals, linear between them, that miss the goal by the least distance.

    For a given duration that is convex. The least duration with nothing missed is looked for upwards from a lower
    bound, as the durations that can be reached may have gaps, and then by bisection. Units: both limits are 1.
    """

    def __init__(self) -> None:
        velocity = cp.Variable((INTERVALS + 1, 2))
        self._start, self._end, self._travel = cp.Parameter(2), cp.Parameter(2), cp.Parameter(2)
        self._interval = cp.Parameter(nonneg=True)
        miss = cp.norm(self._travel - cp.sum((velocity[1:] + velocity[:-1]) / 2, axis=0))
        limits: list[Any] = [
            velocity[0] == self._start,
            velocity[INTERVALS] == self._end,
            cp.norm(velocity, axis=1) <= 1,
            cp.norm(velocity[1:] - velocity[:-1], axis=1) <= self._interval,
        ]
        self._program = cp.Problem(cp.Minimize(miss), limits)

    def time(self, problem: Problem) -> float:
        """The least time [s]."""
        start, goal, limits = problem.start, problem.goal, problem.limits
        travel = np.array([goal.x - start.x, goal.y - start.y]) * limits.acceleration / limits.speed**2
        self._start.value = np.array([start.vx, start.vy]) / limits.speed
        self._end.value = np.array([goal.vx, goal.vy]) / limits.speed
        change = float(np.linalg.norm(self._end.value - self._start.value))
        low = high = max(float(np.linalg.norm(travel)), change, 1e-3)
        step = 0.08 * (low + 0.5)
        while not self._reaches(travel, high):
            low, high, step = high, high + step, step * 1.05
        while high - low > PRECISION * high:
            middle = (low + high) / 2
            low, high = (low, middle) if self._reaches(travel, middle) else (middle, high)
        return high * limits.speed / limits.acceleration

    def _reaches(self, travel: Any, duration: float) -> bool:
        self._interval.value = duration / INTERVALS
        self._travel.value = travel * INTERVALS / duration
        self._program.solve(solver=cp.CLARABEL)
        solved = self._program.status in ("optimal", "optimal_inaccurate")
        missed = float(self._program.value) * duration / INTERVALS if solved else np.inf
        return bool(missed <= MISS * max(1.0, float(np.linalg.norm(travel))))
