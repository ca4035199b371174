"""Driving a truck by a stream of steering angles and speeds."""

from __future__ import annotations

import math
from typing import Any

from canhelm.errors import DeviceFault
from daemon.loops.measurement import Command, Measurement
from daemon.loops.truck_drive import TruckLaw, TruckRecord, TruckTarget
from daemon.runtime.motions import Motion
from daemon.runtime.path_motions import FollowingVehicle
from daemon.runtime.rest import AT_REST_M_S
from daemon.runtime.streams import Streamed


class TruckStream(Motion):
    """Driving by a stream of values (``drive.set``); the truck comes to rest when the last one is too old.

    Args:
        vehicle: that drives.
        law: of its own.
        stream: of targets.

    Attributes:
        record: of the last step; None before the first.
    """

    def __init__(
        self,
        kind: str,
        lease: str | None,
        vehicle: FollowingVehicle,
        law: TruckLaw,
        stream: Streamed[TruckTarget],
    ) -> None:
        super().__init__(kind, vehicle.names, lease, stream)
        self.record: TruckRecord | None = None
        self._vehicle, self._law = vehicle, law

    def step(self, measurement: Measurement, dt_s: float) -> Command:
        """Follow the newest value, or come to rest where it is too old or the motion was stopped."""
        vehicle = self._vehicle
        target: TruckTarget | None = self.newest(None)
        record = self.record = self._law.step(vehicle.reading, None if self.stop_reason else target, dt_s)
        rests = record.speed_m_s == 0.0 and abs(vehicle.reading.speed_m_s) < AT_REST_M_S
        if record.failure and rests:
            remedy = "`canhelm status` shows drives and encoders"
            self.fail(DeviceFault(f"{self.kind}: {record.failure}", remedy=remedy))
        elif self.stop_reason and rests and record.steering_rate_rad_s == 0.0:
            self.finish({})
        speeds = vehicle.wheel_speeds(record.speed_m_s, vehicle.reading.steering_rad)
        return Command((*speeds, record.steering_rate_rad_s * vehicle.arm_m))

    def progress(self) -> dict[str, Any]:
        """What is commanded, and the limits that are active."""
        record = self.record
        if record is None:
            return {"phase": "enabling"}
        asked = record.steering_target_rad
        return {
            "phase": "stopping" if asked is None else "driving",
            "speed_m_s": round(record.speed_m_s, 4),
            "steering_deg": round(math.degrees(self._vehicle.reading.steering_rad), 3),
            "steering_target_deg": None if asked is None else round(math.degrees(asked), 3),
            "limits_active": list(record.limits_active),
        }
