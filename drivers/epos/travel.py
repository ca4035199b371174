"""Position and speed of a wheel out of its drive's position counter, which wraps, and restarts with the drive."""

from __future__ import annotations

import math

from drivers.epos.units import WheelUnits

NEW_REFERENCE_SPEEDS = 3.0
NEW_REFERENCE_QC = 1000
"""A position that differs from the last by more than this, beyond what three times the top speed makes in that time, is
no travel but a new reference (homing, restart)."""
_HALF_TURN, _FULL_TURN = 1 << 31, (1 << 32) - 1


class Travel:
    """Adds up what the wheel has travelled.

    Args:
        units: of the wheel.
        max_speed_m_s: its top speed at the rim.

    Attributes:
        raw_qc: the drive's counter at the last reading.
        position_m: rim distance since the first reading.
        speed_m_s: rim speed over the last two intervals between readings: position difference by time difference.
    """

    def __init__(self, units: WheelUnits, max_speed_m_s: float) -> None:
        self.raw_qc = 0
        self.position_m = self.speed_m_s = 0.0
        self._m_per_qc = units.m_per_qc
        self._fastest_qc_s = NEW_REFERENCE_SPEEDS * max_speed_m_s / abs(units.m_per_qc)
        self._qc = self._qc_before = 0
        self._last_s = self._before_s = -math.inf

    def take(self, raw_qc: int, now_s: float) -> None:
        """Take one reading of the counter at loop time ``now_s``."""
        moved_qc = ((raw_qc - self.raw_qc + _HALF_TURN) & _FULL_TURN) - _HALF_TURN
        self.raw_qc = raw_qc
        last_s = self._last_s
        if abs(moved_qc) > NEW_REFERENCE_QC + self._fastest_qc_s * (now_s - last_s) or last_s == -math.inf:
            moved_qc, self._qc_before, last_s = 0, self._qc, -math.inf
        qc = self._qc + moved_qc
        span_s = now_s - self._before_s
        if span_s > 0.0:
            self.speed_m_s = (qc - self._qc_before) * self._m_per_qc / span_s
        self._qc_before, self._before_s = self._qc, last_s
        self._qc, self._last_s = qc, now_s
        self.position_m = qc * self._m_per_qc

    def begin_anew(self) -> None:
        """The next reading is the first one of a drive that has restarted."""
        self._last_s = self._before_s = -math.inf
