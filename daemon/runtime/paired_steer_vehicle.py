"""The vehicle whose wheels steer in pairs (MAX2D): its motions on the law ``daemon.loops.paired_steer``."""

from __future__ import annotations

import asyncio
import math
from typing import Any

from canhelm.errors import DeviceFault, Interlock, Refused, UsageError
from daemon.loops.geometry import PAIR_NAMES
from daemon.loops.measurement import Command, Measurement
from daemon.loops.odometry import Odometry
from daemon.loops.paired_steer import PairedSteerLaw, PairedSteerRecord
from daemon.loops.paired_steer_target import (
    PairedSteerTarget,
    check_target,
    direction_target,
    parallel_target,
    steer_target,
    turn_target,
    why_not_rotate,
)
from daemon.runtime.motions import Motion
from daemon.runtime.vehicle import Vehicle
from drivers.contract import Brake, Drive, SteeringEncoder
from profiles.schema import PairedSteerGeometry, Profile

STREAM_END_S = 2.0
"""A stream whose last value has been too old for this long, with the robot at rest, is over."""


class PairedSteerMotion(Motion):
    """One target of the law, from steering to rest.

    Args:
        law: a law of its own, at rest.
        target: what to do.
    """

    def __init__(
        self, kind: str, drives: tuple[str, ...], lease: str | None, law: PairedSteerLaw, target: PairedSteerTarget
    ) -> None:
        super().__init__(kind, drives, lease)
        self._law = law
        self._target: PairedSteerTarget | None = target
        self._record: PairedSteerRecord | None = None

    def step(self, measurement: Measurement, dt_s: float) -> Command:
        """One step of the law; without a target it brings the robot to rest and engages the brakes."""
        if self.stop_reason:
            self._target = None
        command, record = self._law.step(measurement, self._target, dt_s)
        if self._target is not None:
            self._record = record
        if record.failure:
            self.fail(DeviceFault(f"{self.kind}: {record.failure}", remedy="`canhelm status` shows drives and brakes"))
        elif record.done:
            self.finish(self._result(measurement.time_s))
        return command

    def _result(self, now_s: float) -> dict[str, Any]:
        error = max((abs(value) for value in self._record.heading_error_rad), default=0.0) if self._record else 0.0
        warnings = list(self._record.warnings) if self._record else []
        return {
            "steering_error_deg": round(math.degrees(error), 4),
            "duration_s": round(now_s - self.begun_s, 3),
            "warnings": warnings,
        }

    def progress(self) -> dict[str, Any]:
        """Phase, headings still to turn, speed, way to go, curve and mismatch angles."""
        record = self._record
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


class StreamMotion(PairedSteerMotion):
    """Driving by a stream of values (``drive.set``); the robot stops when the last one is too old."""

    streaming = True

    def __init__(
        self, kind: str, drives: tuple[str, ...], lease: str | None, law: PairedSteerLaw, target: PairedSteerTarget,
        valid_for_s: float,
    ) -> None:  # fmt: skip
        super().__init__(kind, drives, lease, law, target)
        self._wanted = target
        self._valid_for_s = valid_for_s
        self._taken_s = asyncio.get_running_loop().time()
        self._age_s = 0.0

    def take(self, target: PairedSteerTarget, valid_for_s: float) -> None:
        """A new value."""
        self._wanted = self._wanted if target == self._wanted else target
        self._valid_for_s = valid_for_s
        self._taken_s = asyncio.get_running_loop().time()

    def step(self, measurement: Measurement, dt_s: float) -> Command:
        """Follow the newest value, or come to rest where it is too old."""
        self._age_s = measurement.time_s - self._taken_s
        self._target = self._wanted if self._age_s <= self._valid_for_s else None
        if not self.stop_reason and self._target is None and self._age_s > self._valid_for_s + STREAM_END_S:
            self.stop("no new value came")
        if self.stop_reason or self._target is not None:
            return super().step(measurement, dt_s)
        return self._law.step(measurement, None, dt_s)[0]

    def progress(self) -> dict[str, Any]:
        """As of any motion, and the age of the last value."""
        return {**super().progress(), "value_age_ms": round(self._age_s * 1e3)}


class PairedSteerVehicle(Vehicle):
    """A robot with paired steering; order of wheels, encoders and brakes as in ``daemon.loops.geometry``."""

    methods = ("steer", "drive.parallel", "drive.turn", "drive.rotate", "drive.set")

    def __init__(
        self,
        profile: Profile,
        drives: tuple[Drive, ...],
        encoders: tuple[SteeringEncoder, ...],
        brakes: tuple[Brake, ...],
    ) -> None:
        super().__init__(profile, drives, encoders, brakes)
        assert isinstance(profile.vehicle, PairedSteerGeometry)
        self._geometry = profile.vehicle
        self._limits = profile.limits
        self._odometry = Odometry(profile.vehicle)
        self._names = tuple(drive.name for drive in drives)

    def motion(self, method: str, params: dict[str, Any], lease: str | None) -> Motion:
        """The motion of ``steer``, ``drive.parallel``, ``drive.turn`` or ``drive.set``; ``drive.rotate`` is refused."""
        if method == "drive.rotate":
            raise Refused(why_not_rotate(), remedy="`canhelm drive turn` or `canhelm drive parallel`")
        target = self._target(method, params)
        check_target(self._geometry, self._limits, target)
        law = PairedSteerLaw(self._geometry, self._limits)
        if method == "drive.set":
            return StreamMotion(method, self._names, lease, law, target, _valid_for_s(params))
        return PairedSteerMotion(method, self._names, lease, law, target)

    def update(
        self, method: str, params: dict[str, Any], lease: str | None, motions: list[Motion]
    ) -> dict[str, Any] | None:
        """A further value of a stream that this holder drives by."""
        if method != "drive.set":
            return None
        for motion in motions:
            if isinstance(motion, StreamMotion) and motion.lease == lease and not motion.stop_reason:
                target = self._target(method, params)
                check_target(self._geometry, self._limits, target)
                motion.take(target, _valid_for_s(params))
                return {"motion": motion.identity}
        return None

    def _target(self, method: str, params: dict[str, Any]) -> PairedSteerTarget:
        if method == "steer":
            pair = str(params["pair"])
            if pair not in PAIR_NAMES:
                raise UsageError(f"no wheel pair {pair!r}", remedy=f"one of {', '.join(PAIR_NAMES)}")
            return steer_target(PAIR_NAMES.index(pair), math.radians(params["angle_deg"]))
        speed = float(params["speed_m_s"])
        if method == "drive.set":
            if params.get("yaw_rate_deg_s"):
                raise Refused(why_not_rotate(), remedy="leave the yaw rate out")
            return direction_target(math.radians(params["direction_deg"]), speed)
        duration = float(params["duration_s"])
        if method == "drive.parallel":
            return parallel_target(math.radians(params["angle_deg"]), speed, duration)
        return turn_target(math.radians(params["rear_deg"]), math.radians(params["front_deg"]), speed, duration)

    def observe(self, measurement: Measurement) -> None:
        """Odometry."""
        self._odometry.update(measurement)

    def require_free(self, motion: Motion) -> None:
        """A single wheel turns only with both steering brakes engaged; the law engages them, and needs the headings."""
        if isinstance(motion, PairedSteerMotion):
            for encoder in self.encoders:
                encoder.require_ready()
            return
        loose = [brake.name for brake in self.brakes if brake.state != "engaged"]
        if loose:
            raise Interlock(
                f"the {' and '.join(loose)} steering brake is not engaged: a wheel would turn its pair",
                remedy="`canhelm brake engage`, or `canhelm steer` to turn a pair",
            )

    def status(self) -> dict[str, Any]:
        """Headings and odometry."""
        pose = self._odometry.pose
        return {
            "type": self._geometry.type,
            "methods": list(self.methods),
            "heading_deg": {
                name: round(math.degrees(encoder.heading_rad), 3)
                for name, encoder in zip(PAIR_NAMES, self.encoders, strict=True)
            },
            "odometry": {
                "x_m": round(pose.x_m, 4),
                "y_m": round(pose.y_m, 4),
                "yaw_deg": round(math.degrees(pose.yaw_rad), 3),
            },
        }


def _valid_for_s(params: dict[str, Any]) -> float:
    return float(params["valid_for_ms"]) / 1e3
