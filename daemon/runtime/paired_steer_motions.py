"""Motions of a robot with paired steering, from their begin to rest."""

from __future__ import annotations

import math
from typing import Any

from canhelm.errors import DeviceFault
from daemon.loops.measurement import Command, Measurement
from daemon.loops.paired_steer import PairedSteerLaw, PairedSteerRecord
from daemon.loops.paired_steer_target import PairedSteerTarget
from daemon.loops.steering import REST_SPEED_M_S
from daemon.runtime.motions import Motion
from daemon.runtime.streams import Streamed


class PairedSteerMotion(Motion):
    """One target of the law from steering to rest, or those of a stream (``drive.set``).

    Args:
        law: a law of its own, at rest.
        target: what to do; None: come to rest.
        stream: of targets; the robot rests while the newest is too old.

    Attributes:
        record: of the last step; None before the first.
    """

    def __init__(
        self,
        kind: str,
        drives: tuple[str, ...],
        lease: str | None,
        law: PairedSteerLaw,
        target: PairedSteerTarget | None,
        stream: Streamed[PairedSteerTarget] | None = None,
    ) -> None:
        super().__init__(kind, drives, lease, stream)
        self._law = law
        self._target = target
        self.record: PairedSteerRecord | None = None
        self._driven: PairedSteerRecord | None = None

    def step(self, measurement: Measurement, dt_s: float) -> Command:
        """One step of the law; without a target it brings the robot to rest and engages the brakes."""
        self._target = None if self.stop_reason else self.newest(self._target)
        command, record = self._law.step(measurement, self._target, dt_s)
        self.record = record
        if self._target is not None:
            self._driven = record
        if record.failure:
            told = f"{self.kind}: {record.failure}{self._rolling(measurement)}"
            self.fail(DeviceFault(told, remedy="`canhelm status` shows drives and brakes"))
        elif record.done and not self.goes_on_at_rest:
            self.on_done(measurement.time_s)
        return command

    def _rolling(self, measurement: Measurement) -> str:
        """Which wheels roll, in brackets; empty where none does."""
        speeds = zip(self.drives, measurement.wheel_speed_m_s, strict=False)
        rolling = [name for name, speed in speeds if abs(speed) > REST_SPEED_M_S]
        return f" ({', '.join(rolling)})" if rolling else ""

    def on_done(self, now_s: float) -> None:
        """The robot rests at the target, or after a stop."""
        self.finish(self._result(now_s))

    def _result(self, now_s: float) -> dict[str, Any]:
        error = max((abs(value) for value in self._driven.heading_error_rad), default=0.0) if self._driven else 0.0
        warnings = list(self._driven.warnings) if self._driven else []
        return {
            "steering_error_deg": round(math.degrees(error), 4),
            "duration_s": round(now_s - self.begun_s, 3),
            "warnings": warnings,
        }

    def progress(self) -> dict[str, Any]:
        """Phase, headings still to turn, speed, way to go, curve and mismatch angles."""
        record = self._driven
        if record is None:
            return {"phase": "enabling"}
        return {
            "phase": record.phase.value,
            "pair": record.pair,
            "heading_error_deg": [round(math.degrees(error), 3) for error in record.heading_error_rad],
            "speed_m_s": round(record.speed_m_s, 4),
            "remaining_m": None if record.remaining_m is None else round(record.remaining_m, 4),
            "icr_m": None if record.icr_m is None else [round(value, 4) for value in record.icr_m],
            "mismatch_deg": [round(math.degrees(angle), 3) for angle in record.mismatch_rad],
            "limits_active": list(record.limits_active),
            "warnings": list(record.warnings),
        }
