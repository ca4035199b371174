"""Motions of a car, from their begin to rest."""

from __future__ import annotations

import math
from typing import Any, Protocol

from canhelm.errors import DeviceFault
from daemon.loops.ackermann_drive import CarLaw, CarRecord, CarTarget
from daemon.loops.measurement import Command, Measurement
from daemon.loops.truck_odometry import TruckOdometry
from daemon.runtime.motions import Motion
from daemon.runtime.poses import place_and_heading
from daemon.runtime.rest import AT_REST_M_S
from daemon.runtime.streams import Streamed


class Senses(Protocol):
    """What the vehicle knows of its own motion."""

    odometry: TruckOdometry


class CarMotion(Motion):
    """One target for a time or a way, or those of a stream (``drive.set``), then rest.

    Args:
        senses: the pose.
        law: of its own.
        target: what to do.
        duration_s: time after which the car comes to rest; None: when the target's way is covered, or until stopped.
        stream: of targets; the car rests while the newest is too old.

    Attributes:
        record: of the last step; None before the first.
        target: in force; None while the car comes to rest.
    """

    def __init__(
        self,
        kind: str,
        drives: tuple[str, ...],
        lease: str | None,
        senses: Senses,
        law: CarLaw,
        target: CarTarget,
        duration_s: float | None = None,
        stream: Streamed[CarTarget] | None = None,
    ) -> None:
        super().__init__(kind, drives, lease, stream)
        self.record: CarRecord | None = None
        self.target: CarTarget | None = target
        self._senses = senses
        self._law = law
        self._remaining_s = math.inf if duration_s is None else duration_s
        self._last_error_rad = 0.0

    def step(self, measurement: Measurement, dt_s: float) -> Command:
        """One step of the law; without a target it brings the car to rest."""
        self._remaining_s -= dt_s
        self.target = self.newest(self.target)
        if self.stop_reason or self._remaining_s <= 0.0:
            self.target = None
        command, record = self._law.step(measurement, self._senses.odometry.pose.yaw_rad, self.target, dt_s)
        self.record = record
        if self.target is not None:
            self._last_error_rad = record.heading_error_rad
        at_rest = all(abs(speed) < AT_REST_M_S for speed in measurement.wheel_speed_m_s)
        if record.failure:
            remedy = "`canhelm status` shows drives and encoders"
            self.fail(DeviceFault(f"{self.kind}: {record.failure}", remedy=remedy))
        elif record.done and at_rest and not self.goes_on_at_rest:
            self.finish(self._result(measurement.time_s))
        return command

    def _result(self, now_s: float) -> dict[str, Any]:
        return {
            **place_and_heading(self._senses.odometry.pose),
            "heading_error_deg": round(math.degrees(self._last_error_rad), 3),
            "duration_s": round(now_s - self.begun_s, 3),
        }

    def progress(self) -> dict[str, Any]:
        """Steering, heading still to turn, speed, way to go."""
        record = self.record
        if record is None:
            return {"phase": "enabling"}
        asked = record.steering_target_rad
        return {
            "phase": "stopping" if self.target is None else "driving",
            "steering_deg": round(math.degrees(record.steering_rad), 3),
            "steering_target_deg": None if asked is None else round(math.degrees(asked), 3),
            "heading_error_deg": round(math.degrees(record.heading_error_rad), 3),
            "speed_m_s": round(record.speed_m_s, 4),
            "remaining_m": None if record.remaining_m is None else round(record.remaining_m, 4),
            "limits_active": list(record.limits_active),
        }
