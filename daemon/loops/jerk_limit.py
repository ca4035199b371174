"""To a goal with a limited jerk: the time-optimal motion, averaged over a window of cycles.

An average is nowhere faster and accelerates nowhere more than what it is made of. Its acceleration changes by the
difference of the newest and the oldest acceleration in the window, over the window's length: by no more than the jerk
where that is 2 a / j, whatever the motion does, planned anew or not. An average lags by half the window; so the motion
starts half a window ahead of the body, and ends half a window before the goal, at the velocities that they have.
A lower acceleration has a shorter window: where the way is short it is faster.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import replace
from typing import Final

from daemon.loops.accelerometer import Vector
from daemon.loops.omni_guide import Felt, GoalGuide, Guidance
from daemon.loops.planner import PlanarLimits, PlanarState, Result
from daemon.loops.traction import Traction

LEAST_PART: Final = 0.05
"""Of the acceleration, however short the way is."""


class JerkLimitedGuide:
    """A guide to a goal.

    Args:
        goal: in the fixed frame.
        limits: of the motion.
        jerk_m_s3: of the place; the turn is averaged alike.
        dt: length of a cycle [s].
        traction: None: without a traction loop.
    """

    def __init__(
        self, goal: PlanarState, limits: PlanarLimits, jerk_m_s3: float, dt: float, traction: Traction | None = None
    ) -> None:
        self._goal = goal
        self._limits = limits
        self._jerk = jerk_m_s3
        self._dt = dt
        self._traction = traction
        self._guide: GoalGuide | None = None
        self._window: deque[PlanarState] = deque()
        self._over = 0

    def step(self, reference: PlanarState, felt: Felt, commanded: Vector, dt: float) -> Guidance:
        """One cycle."""
        guide = self._guide or self._begin(reference)
        told = guide.step(self._window[-1], felt, commanded, dt)
        oldest, cycles = self._window.popleft(), len(self._window) + 1
        self._window.append(told.next)
        following = _moved(reference, oldest, told.next, 1 / cycles)
        acceleration = (following.vx - reference.vx) / dt, (following.vy - reference.vy) / dt
        result, left = told.result, told.eta_s + (cycles - 1 - self._over) * dt
        if result is Result.ARRIVED:
            self._over += 1
            result = Result.ARRIVED if self._over >= cycles else Result.MOVING
        return replace(told, next=following, acceleration_m_s2=acceleration, result=result, eta_s=max(0.0, left))

    def _begin(self, start: PlanarState) -> GoalGuide:
        """Choose the acceleration, and fill the window with how the body came here."""
        way = math.hypot(self._goal.x - start.x, self._goal.y - start.y)
        acceleration = quickest_acceleration(way, self._limits, self._jerk)
        cycles = max(1, math.ceil(2 * acceleration / (self._jerk * self._dt)))
        ahead = (cycles - 1) * self._dt / 2
        self._window.extend(_later(start, ahead - age * self._dt) for age in reversed(range(cycles)))
        limits = replace(self._limits, acceleration=acceleration)
        self._guide = GoalGuide(_later(self._goal, -ahead), limits, self._traction)
        return self._guide


def quickest_acceleration(way: float, limits: PlanarLimits, jerk: float) -> float:
    """The acceleration with which a way from rest to rest [m] takes the least time, its window included.

    That is 2 sqrt(way / a) + 2 a / jerk, or way / v + v / a + 2 a / jerk where the speed limit v is reached.
    """
    speed, most = limits.speed, limits.acceleration
    quickest = math.cbrt(jerk * jerk * way / 4)
    if quickest * way > speed * speed:
        quickest = max(math.sqrt(speed * jerk / 2), speed * speed / way)
    return min(most, max(quickest, LEAST_PART * most))


def _later(state: PlanarState, time: float) -> PlanarState:
    """Where a body is that goes on as it does."""
    x, y = state.x + state.vx * time, state.y + state.vy * time
    return replace(state, x=x, y=y, heading=state.heading + state.rate * time)


def _moved(mean: PlanarState, oldest: PlanarState, newest: PlanarState, part: float) -> PlanarState:
    """The mean of a window after its newest state took the place of its oldest."""
    return PlanarState(
        mean.x + part * (newest.x - oldest.x),
        mean.y + part * (newest.y - oldest.y),
        mean.heading + part * (newest.heading - oldest.heading),
        mean.vx + part * (newest.vx - oldest.vx),
        mean.vy + part * (newest.vy - oldest.vy),
        mean.rate + part * (newest.rate - oldest.rate),
    )
