"""Whether the readings of a vehicle that moves can all be true; each check finds what contradicts the others.

The checks know nothing of devices and of what is done about a contradiction. Where limits come from is
``daemon.loops.plausibility_limits``; docs/plausibility.md has the table.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Final

TURNING_ALLOWANCE: Final = 2.0
"""An encoder may turn so many times as fast as its axis is ever commanded: ramps overshoot."""

WHEELS_SHARE: Final = 0.3
"""Of what wheels turn an axis, what an encoder may miss: slip of the tyres, gain of a sensor without calibration."""
STANDING_SHARE: Final = 0.2
"""An encoder that tells less than this of the turning stands."""
WINDOW: Final = 6.0
"""Limits that an axis turns by before a comparison begins anew."""


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
            change, margin = abs(angle - before), self._margins_rad[index]
            if change <= margin:
                continue
            possible_s = max(gap_s, gap_before_s, self._period_s)
            limit = margin + TURNING_ALLOWANCE * self._rates_rad_s[index] * possible_s
            if not change <= limit:
                return Contradiction(index, change, limit)
        return None


class Turning(StrEnum):
    """How an axis turns otherwise than its wheels turn it."""

    STANDS = "stands"
    AGAINST = "against"
    OFF = "off"


@dataclass(frozen=True, slots=True)
class SteeredBy:
    """What turns the axis of an encoder.

    Attributes:
        encoder: its index.
        wheels: index of each drive that turns it, and by how much for its way [rad/m].
        brake: index of the brake that has to be released for it; None for an axis without.
    """

    encoder: int
    wheels: tuple[tuple[int, float], ...]
    brake: int | None = None

    def angle(self, ways_m: Sequence[float]) -> float:
        """Angle for ways of the drives; rate for their speeds."""
        return sum(ways_m[index] * per_metre for index, per_metre in self.wheels)


class AxisTurning:
    """One axis that wheels or a drive turn: whether its encoder follows them, and both the command.

    Compared is what has turned since a common beginning, which is moved up after some way.

    Args:
        limit_rad: what encoder and wheels may differ by, beside a share of the way.
    """

    def __init__(self, limit_rad: float) -> None:
        self._limit_rad = limit_rad
        self._begin: tuple[float, float] | None = None
        self._commanded_rad = 0.0

    def begin_anew(self) -> None:
        """Compare what turns from now on."""
        self._begin = None

    def look(self, heading_rad: float, driven_rad: float, commanded_rad: float) -> tuple[Turning, float, float] | None:
        """What contradicts, how far and beyond which limit [rad]; or None.

        Args:
            heading_rad: by the encoder.
            driven_rad: by what the wheels have rolled.
            commanded_rad: turning that was commanded since the last look.
        """
        if self._begin is None:
            self._begin, self._commanded_rad = (heading_rad, driven_rad), 0.0
            return None
        self._commanded_rad += commanded_rad
        said, driven = heading_rad - self._begin[0], driven_rad - self._begin[1]
        limit, off = self._limit_rad + WHEELS_SHARE * abs(driven), abs(said - driven)
        if not off <= limit:
            return _how(said, driven), off, limit
        if said * self._commanded_rad < 0 and abs(said) > limit:
            return Turning.AGAINST, abs(said), limit
        if abs(driven) > WINDOW * self._limit_rad:
            self.begin_anew()
        return None


def _how(said: float, driven: float) -> Turning:
    if abs(said) < STANDING_SHARE * abs(driven):
        return Turning.STANDS
    return Turning.AGAINST if said * driven < 0 else Turning.OFF
