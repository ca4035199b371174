"""Slip of single wheels kept where a tyre pulls best: the correction for pushing an obstacle, and for wheels on ice.

Lowering the acceleration of the whole robot is no answer to an obstacle: the body cannot follow at any. Here a wheel
that slips may turn only a little faster than the floor passes under it, while the others go on as commanded. Whatever
is believed of the floor, no wheel is made faster than it is commanded, or was just before.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class WheelGripTuning:
    """What suits a tyre.

    Attributes:
        slip_m_s: rim speed above the floor's that a slipping wheel may have; at its best pull.
        slip_ratio: part of the floor's speed that is added to it.
        recovery_m_s2: how fast the allowance grows after slip, until it binds no more.
    """

    slip_m_s: float = 0.04
    slip_ratio: float = 0.06
    recovery_m_s2: float = 0.5


@dataclass(frozen=True, slots=True)
class WheelGripRecord:
    """The terms of one step.

    Attributes:
        wheel_speeds_m_s: to command.
        allowance_m_s: how much faster or slower than the floor each wheel may roll; infinite where free.
        limited: whether each wheel is held back in this step.
    """

    wheel_speeds_m_s: tuple[float, ...]
    allowance_m_s: tuple[float, ...]
    limited: tuple[bool, ...]


class WheelGrip:
    """One limit a wheel.

    Args:
        wheels: their number.
        tuning: of the tyres.
    """

    def __init__(self, wheels: int, tuning: WheelGripTuning | None = None) -> None:
        self._tuning = WheelGripTuning() if tuning is None else tuning
        self._allowance = (math.inf,) * wheels
        self._last = (0.0,) * wheels

    def step(
        self, wanted: Sequence[float], ground: Sequence[float], slipping: Sequence[bool], dt: float
    ) -> WheelGripRecord:
        """One cycle.

        Args:
            wanted: rim speeds [m/s].
            ground: speed of the floor under each wheel, along it [m/s].
            slipping: for each wheel.
            dt: time since the last step [s].
        """
        wheels = list(zip(wanted, ground, slipping, self._allowance, strict=True))
        self._allowance = tuple(self._allowed(*wheel, dt) for wheel in wheels)
        limits = zip(wanted, ground, self._allowance, self._last, strict=True)
        speeds = self._last = tuple(_held(*limit) for limit in limits)
        limited = tuple(speed != want for speed, want in zip(speeds, wanted, strict=True))
        return WheelGripRecord(speeds, self._allowance, limited)

    def _allowed(self, wanted: float, ground: float, slipping: bool, allowance: float, dt: float) -> float:
        tuning = self._tuning
        if slipping:
            return tuning.slip_m_s + tuning.slip_ratio * abs(ground)
        if abs(wanted - ground) <= allowance:
            return math.inf
        return allowance + tuning.recovery_m_s2 * dt


def _held(wanted: float, ground: float, allowance: float, last: float) -> float:
    if not math.isfinite(ground):
        return wanted
    most = max(abs(wanted), abs(last))
    near = max(ground - allowance, min(ground + allowance, wanted))
    return max(-most, min(most, near))
