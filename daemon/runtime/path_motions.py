"""Following a path with a vehicle that has a steered axle, with or without a trailer."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Sequence
from typing import Any, Protocol

from canhelm.errors import LimitExceeded, Refused
from daemon.loops.articulated import ArticulatedVehicle
from daemon.loops.measurement import Command, Measurement
from daemon.loops.path import Path, wrap
from daemon.loops.path_driving import DrivingStep, PathDriver, Phase, VehicleReading, at_begin, error_limits
from daemon.loops.path_speed import SpeedTuning
from daemon.loops.steered_axle import SteeredAxleLaw
from daemon.runtime.following import Following
from daemon.runtime.motions import Motion
from daemon.runtime.path_commands import PathPlan
from daemon.runtime.poses import place_and_heading
from profiles.steered import SteeredAxle

KIND = "drive.path"


class FollowingVehicle(Protocol):
    """A vehicle that can follow paths.

    Attributes:
        kinematics: with the limits of steering and bending angle.
        axle: its steered axle.
        arm_m: at which the steering drive's speed counts.
        names: of its drives, that of the steering last.
        reading: newest one.
    """

    kinematics: ArticulatedVehicle
    axle: SteeredAxle
    arm_m: float
    names: tuple[str, ...]
    reading: VehicleReading

    def wheel_speeds(self, speed_m_s: float, steering_rad: float) -> Sequence[float]:
        """Rim speeds of the driven wheels for a speed of the rear axle's middle."""
        ...


class PathMotion(Motion):
    """One path, from setting the steering to rest at its end.

    Args:
        lease: who holds it.
        vehicle: that drives.
        path: to be driven.
        driver: its law.

    Attributes:
        path: to be driven.
        record: of the last step; None before the first.
        limits_active: in the last step: of the speed, of the steering law, of the steered axle.
        limits_s: for how long each limit was active.
        largest_error_m: of the position, while driving.
    """

    path: Path

    def __init__(self, lease: str | None, vehicle: FollowingVehicle, path: Path, driver: PathDriver) -> None:
        super().__init__(KIND, vehicle.names, lease)
        self.record: DrivingStep | None = None
        self.limits_active: tuple[str, ...] = ()
        self.limits_s: defaultdict[str, float] = defaultdict(float)
        self.largest_error_m = 0.0
        self._vehicle, self.path, self._driver = vehicle, path, driver
        self._axle = SteeredAxleLaw(vehicle.axle)

    def step(self, measurement: Measurement, dt_s: float) -> Command:
        """One step of the laws of speed and steering."""
        vehicle = self._vehicle
        if self.stop_reason:
            self._driver.stop()
        record = self.record = self._driver.step(vehicle.reading, dt_s)
        steering = self._axle.step(record.steering_rad, vehicle.reading.steering_rad, dt_s)
        if steering.failure:
            self._driver.fail(steering.failure)
        self.limits_active = (*record.limits_active, *steering.limits_active)
        if record.phase is Phase.DRIVING:
            self._note(record, dt_s)
        if record.phase is Phase.DONE:
            self._end(record, measurement.time_s)
        speeds = vehicle.wheel_speeds(record.speed_m_s, vehicle.reading.steering_rad)
        return Command((*speeds, steering.rate_rad_s * vehicle.arm_m))

    def _note(self, record: DrivingStep, dt_s: float) -> None:
        for limit in self.limits_active:
            self.limits_s[limit] += dt_s
        self.largest_error_m = max(self.largest_error_m, abs(record.following.errors.position_m))

    def _end(self, record: DrivingStep, now_s: float) -> None:
        if record.failure:
            remedy = "straighten the vehicle forwards, or begin nearer to the path; `canhelm status` shows where it is"
            self.fail(LimitExceeded(f"{KIND}: {record.failure}", value=self.progress(), remedy=remedy))
        else:
            self.finish(self._result(now_s))

    def _result(self, now_s: float) -> dict[str, Any]:
        """Where the reference point is against the path's end, and how it went."""
        last, vehicle = self.path.pieces[-1], self._vehicle
        units = vehicle.kinematics.poses(vehicle.reading.truck, vehicle.reading.bending_rad)
        unit = units[-1 if last.backward else 0]
        end_m = last.length_m if math.isfinite(last.length_m) else last.project(unit.x_m, unit.y_m)[0]
        turned = wrap(unit.yaw_rad - last.heading(end_m))
        return {
            **place_and_heading(unit),
            "end_error_m": round(math.dist(last.point(end_m), (unit.x_m, unit.y_m)), 4),
            "end_heading_error_deg": round(math.degrees(turned), 3),
            "largest_error_m": round(self.largest_error_m, 4),
            "limits_s": {name: round(seconds, 2) for name, seconds in sorted(self.limits_s.items())},
            "duration_s": round(now_s - self.begun_s, 3),
        }

    def following(self) -> Following | None:
        """Errors of the last step."""
        if self.record is None:
            return None
        step, vehicle = self.record.following, self._vehicle
        return Following(
            self.path.way_to(step.meeting.piece, step.meeting.along_m),
            self.path.length_m,
            step.errors.position_m,
            step.errors.heading_rad,
            step.errors.bending_rad,
            step.backward,
            error_limits(vehicle.kinematics, step.errors, vehicle.reading),
        )

    def progress(self) -> dict[str, Any]:
        """Phase, where on the path, errors, and the limits that are active."""
        record = self.record
        if record is None:
            return {"phase": "enabling"}
        following, errors = record.following, record.following.errors
        bending = errors.bending_rad
        return {
            "phase": str(record.phase),
            "section": record.section,
            "piece": self.path.told(following.meeting.piece),
            "remaining_m": round(following.remaining_m, 3),
            "error_m": round(errors.position_m, 4),
            "heading_error_deg": round(math.degrees(errors.heading_rad), 2),
            "bending_error_deg": None if bending is None else round(math.degrees(bending), 2),
            "speed_m_s": round(record.speed_m_s, 4),
            "steering_deg": round(math.degrees(record.steering_rad), 2),
            "limits_active": list(self.limits_active),
        }


class FollowedPath(PathPlan):
    """A path that a vehicle with a steered axle can follow.

    Args:
        vehicle: that drives.
        path: of its reference points, drivable; an attribute, too.
        speed: limits of the speed.
        published: by the thesis' law instead of the cascade.
    """

    def __init__(self, vehicle: FollowingVehicle, path: Path, speed: SpeedTuning, published: bool) -> None:
        self.path = path
        self._vehicle, self._speed, self._published = vehicle, speed, published

    def summary(self) -> dict[str, Any]:
        """Size of the path, where it begins, and about how long it takes."""
        path, first = self.path, self.path.pieces[0]
        return {
            "pieces": len(path.pieces),
            "sections": len(path.sections),
            "length_m": round(path.length_m, 3),
            "least_radius_m": round(1 / path.sharpest, 3) if path.sharpest else None,
            "begin": {
                "x_m": round(first.x_m, 4),
                "y_m": round(first.y_m, 4),
                "heading_deg": round(math.degrees(wrap(first.heading(0.0))), 2),
                "backward": first.backward,
            },
            "law": "published" if self._published else "cascade",
        }

    def require_begin(self) -> None:
        """Raise Refused where the vehicle is not at the path's beginning."""
        vehicle, reading = self._vehicle, self._vehicle.reading
        reason = at_begin(vehicle.kinematics, self.path, reading.truck, reading.bending_rad)
        if reason:
            remedy = "drive there first, or leave start: out of the path file to begin where the vehicle is"
            raise Refused(f"{KIND}: {reason}", remedy=remedy)

    def motion(self, lease: str | None) -> PathMotion:
        """The motion."""
        vehicle = self._vehicle
        rate = math.radians(vehicle.axle.rate_deg_s)
        driver = PathDriver(vehicle.kinematics, self.path, self._speed, rate, self._published)
        return PathMotion(lease, vehicle, self.path, driver)
