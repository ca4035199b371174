"""Simulated time that passes faster or slower than a clock."""

from __future__ import annotations

import math
from typing import Final

LONGEST_DEBT_S: Final = 0.1
"""Loop time that is caught up with at most; what a slow machine lacks beyond that is given up."""


class TimeLapse:
    """Loop time that passes ``factor`` times as fast as a clock, as far as the processor can follow.

    While the process computes, loop time passes no faster than the clock: a robot that is simulated four times as fast
    does not miss its deadlines because its machine is no faster. While the process sleeps, loop time catches up with
    where it should be, but never beyond the next timer. So no timer is later than at the machine's own speed.

    Args:
        factor: above 0.
        clock_s: now.
        loop_s: now.

    Attributes:
        factor: as given.
    """

    def __init__(self, factor: float, clock_s: float, loop_s: float) -> None:
        self.factor = factor
        self._from_s, self._to_s = clock_s, loop_s
        self._clock_s, self._loop_s = clock_s, loop_s

    def computed(self, clock_s: float) -> float:
        """Loop time now, after something was computed since it was asked last."""
        self._loop_s += (clock_s - self._clock_s) * min(1.0, self.factor)
        self._clock_s = clock_s
        return self._loop_s

    def sleep_s(self, timeout_s: float) -> float:
        """How long to sleep by the clock for a timer that is so far away by the loop."""
        return max(0.0, self._loop_s + timeout_s - self._wanted(self._clock_s)) / self.factor

    def slept(self, clock_s: float, timeout_s: float | None) -> None:
        """A sleep has ended, be it before its timer; None: there was no timer."""
        wanted, latest = self._wanted(clock_s), math.inf if timeout_s is None else self._loop_s + max(timeout_s, 0.0)
        self._loop_s = max(self._loop_s, min(wanted, latest))
        self._clock_s = clock_s
        if wanted - self._loop_s > LONGEST_DEBT_S:
            self._from_s, self._to_s = clock_s, self._loop_s + LONGEST_DEBT_S

    def _wanted(self, clock_s: float) -> float:
        return self._to_s + (clock_s - self._from_s) * self.factor
