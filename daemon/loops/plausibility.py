"""Whether the readings of a vehicle that moves can all be true; each check finds what contradicts the others.

The checks know nothing of devices and of what is done about a contradiction. Where limits come from is
``daemon.loops.plausibility_limits``; docs/plausibility.md has the table.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

TURNING_ALLOWANCE: Final = 2.0
"""An encoder may turn so many times as fast as its axis is ever commanded: ramps overshoot."""


@dataclass(frozen=True, slots=True)
class Contradiction:
    """What cannot be true.

    Attributes:
        index: of the encoder or the wheel, in the order of the loops.
        value: how far it is off [rad or m].
        limit: how far it may be.
    """

    index: int
    value: float
    limit: float


class EncoderJumps:
    """Steering encoders that tell an angle which their axis cannot have reached since the last reading.

    A reading that came late may have been taken long before, so the longer one of the last two gaps counts.

    Args:
        rates_rad_s: fastest turning of each axis that is ever commanded; infinite where nobody knows.
        margins_rad: what two readings may differ by besides.
        period_s: of the control cycle; no gap counts as shorter.
    """

    def __init__(self, rates_rad_s: Sequence[float], margins_rad: Sequence[float], period_s: float) -> None:
        self._rates_rad_s = tuple(rates_rad_s)
        self._margins_rad = tuple(margins_rad)
        self._period_s = period_s
        self._last: list[tuple[float, float, float]] = []

    def begin_anew(self) -> None:
        """Forget what was read."""
        self._last = []

    def look(self, heading_rad: Sequence[float], reading_s: Sequence[float]) -> Contradiction | None:
        """The first encoder that jumped, or None.

        Args:
            heading_rad: newest readings.
            reading_s: when each of them came.
        """
        if not self._last:
            self._last = [(angle, time_s, 0.0) for angle, time_s in zip(heading_rad, reading_s, strict=True)]
            return None
        for index, (angle, time_s) in enumerate(zip(heading_rad, reading_s, strict=True)):
            before, before_s, gap_before_s = self._last[index]
            if time_s == before_s:
                continue
            gap_s = time_s - before_s
            self._last[index] = (angle, time_s, gap_s)
            possible_s = max(gap_s, gap_before_s, self._period_s)
            limit = self._margins_rad[index] + TURNING_ALLOWANCE * self._rates_rad_s[index] * possible_s
            if not abs(angle - before) <= limit:
                return Contradiction(index, math.fabs(angle - before), limit)
        return None
