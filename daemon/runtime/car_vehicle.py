"""The car with front-wheel steering (ENPM808X report): its motions on the law ``daemon.loops.ackermann_drive``."""

from __future__ import annotations

import math
from typing import Any

from canhelm.errors import LimitExceeded, Refused, UsageError
from daemon.loops.ackermann_drive import CarLaw, CarOdometry, CarTarget
from daemon.loops.measurement import Measurement
from daemon.runtime.car_motions import CarMotion, CarStream
from daemon.runtime.motions import Motion
from daemon.runtime.steered_vehicle import SteeredVehicle
from drivers.contract import Drive, SteeringEncoder
from profiles.schema import Profile
from profiles.steered import CarGeometry

_ROUNDING = 1e-9


class CarVehicle(SteeredVehicle):
    """A car; its drives are those of the rear wheels, left and right, and of the steering."""

    methods = ("drive.heading", "drive.turn", "drive.set")

    def __init__(self, profile: Profile, wheels: tuple[Drive, ...], steering: Drive, encoder: SteeringEncoder) -> None:
        assert isinstance(profile.vehicle, CarGeometry)
        acceleration = min(profile.drives[drive.name].acceleration_m_s2 for drive in wheels)
        super().__init__(profile, profile.vehicle.steering, wheels, steering, (encoder,), acceleration)
        self._geometry = profile.vehicle
        self._limits = profile.limits
        self._wheel_radius_m = profile.drives[wheels[0].name].wheel_radius_m
        self._period_s = 1.0 / profile.network.cycle_hz
        self._names = tuple(drive.name for drive in self.drives)
        self._wheel_acceleration_m_s2 = acceleration
        self.odometry = CarOdometry(profile.vehicle)

    # --- motions -----------------------------------------------------------------------------------------------

    def motion(self, method: str, params: dict[str, Any], lease: str | None) -> Motion:
        """The motion of ``drive.heading``, ``drive.turn`` or ``drive.set``."""
        law = self._law()
        if method == "drive.set":
            return CarStream(method, self._names, lease, self, law, self._direction(params), _valid_for_s(params))
        if method == "drive.turn":
            return CarMotion(method, self._names, lease, self, law, self._arc(params))
        target = CarTarget(self._speed(params), heading_rad=math.radians(params["heading_deg"]))
        return CarMotion(method, self._names, lease, self, law, target, float(params["duration_s"]))

    def _law(self) -> CarLaw:
        return CarLaw(
            self._geometry,
            self._limits,
            self._wheel_radius_m,
            self._wheel_acceleration_m_s2,
            self.arm_m,
            self._period_s,
        )

    def update(
        self, method: str, params: dict[str, Any], lease: str | None, motions: list[Motion]
    ) -> dict[str, Any] | None:
        """A further value of a stream that this holder drives by."""
        if method != "drive.set":
            return None
        for motion in motions:
            if isinstance(motion, CarStream) and motion.lease == lease and not motion.stop_reason:
                motion.take(self._direction(params), _valid_for_s(params))
                return {"motion": motion.identity}
        return None

    def _speed(self, params: dict[str, Any]) -> float:
        speed = float(params["speed_m_s"])
        if not math.isfinite(speed):
            raise UsageError("the speed is not a finite number", remedy="give m/s")
        if speed < 0:
            raise Refused(
                "this car has no reverse gear: none of its wheels turns backwards",
                value=speed,
                remedy="give a positive speed, and turn round forwards",
            )
        _at_most("speed", speed, self._limits.speed_m_s, "m/s", "speed_m_s")
        return speed

    def _direction(self, params: dict[str, Any]) -> CarTarget:
        """A direction in the car's frame as the heading that lies there now."""
        if params.get("yaw_rate_deg_s"):
            raise Refused("this car turns by its heading only", remedy="leave the yaw rate out, give a direction")
        heading = self.odometry.pose.yaw_rad + math.radians(params["direction_deg"])
        return CarTarget(self._speed(params), heading_rad=heading)

    def _arc(self, params: dict[str, Any]) -> CarTarget:
        """An arc of fixed steering; only the front axle steers."""
        speed, front_deg = self._speed(params), float(params["front_deg"])
        if params["rear_deg"]:
            raise Refused("the rear wheels of this car do not steer", value=params["rear_deg"], remedy="give --rear 0")
        _at_most("steering angle", abs(front_deg), self._geometry.steering.limit_deg, "deg", "limit_deg")
        steering = math.radians(front_deg)
        slope = abs(math.tan(steering)) / self._geometry.wheelbase_m
        grip = math.sqrt(self._limits.lateral_acceleration_m_s2 / slope) if slope else math.inf
        _at_most("speed on this arc", speed, grip, "m/s", "lateral_acceleration_m_s2 allows")
        wheels = self._limits.wheel_speed_m_s / (1.0 + self._geometry.track_m / 2 * slope)
        _at_most("speed on this arc", speed, wheels, "m/s", "wheel_speed_m_s of the outer wheel allows")
        return CarTarget(speed, steering_rad=steering, distance_m=speed * float(params["duration_s"]))

    # --- measuring ---------------------------------------------------------------------------------------------

    def observe(self, measurement: Measurement) -> None:
        """Odometry."""
        self.odometry.update(measurement)

    def require_free(self, motion: Motion) -> None:
        """The law needs the steering angle."""
        if isinstance(motion, CarMotion):
            self.encoders[0].require_ready()

    def status(self) -> dict[str, Any]:
        """Steering angle and odometry of the rear axle's middle."""
        pose = self.odometry.pose
        return {
            "type": self._geometry.type,
            "methods": list(self.methods),
            "steering_deg": round(math.degrees(self.encoders[0].heading_rad), 3),
            "odometry": {
                "x_m": round(pose.x_m, 4),
                "y_m": round(pose.y_m, 4),
                "yaw_deg": round(math.degrees(pose.yaw_rad), 3),
            },
        }


def _valid_for_s(params: dict[str, Any]) -> float:
    return float(params["valid_for_ms"]) / 1e3


def _at_most(what: str, value: float, limit: float, unit: str, name: str) -> None:
    if value > limit * (1 + _ROUNDING):
        allowed = math.floor(limit * 1000 * (1 + _ROUNDING)) / 1000
        raise LimitExceeded(
            f"a {what} of {value:g} {unit} is beyond the limit",
            value=round(value, 6),
            limit=f"{name} {allowed:g}",
            remedy=f"ask for at most {allowed:g} {unit}",
        )
