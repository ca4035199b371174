"""The truck with a semi-trailer: it follows paths, forwards and backwards, or set-points of a person."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any, Final

from canhelm.errors import Refused
from daemon.loops.articulated import ArticulatedVehicle, Hitch
from daemon.loops.bending_observer import BendingObserver
from daemon.loops.measurement import Measurement
from daemon.loops.odometry import Pose
from daemon.loops.path_driving import VehicleReading
from daemon.loops.path_following import FollowingTuning
from daemon.loops.path_speed import SpeedTuning
from daemon.loops.truck_drive import TruckLaw, TruckTarget
from daemon.loops.truck_odometry import TruckOdometry
from daemon.loops.turning_centre import Point, centre_of_curvature
from daemon.runtime.motions import Motion
from daemon.runtime.path_building import build_path
from daemon.runtime.path_commands import PathRequest
from daemon.runtime.path_motions import FollowedPath, PathMotion
from daemon.runtime.poses import place_and_yaw
from daemon.runtime.shapes import FRONT, REAR, TRAILER, both_sides
from daemon.runtime.steered_vehicle import SteeredVehicle
from daemon.runtime.streams import streamed
from daemon.runtime.truck_stream import TruckStream
from daemon.runtime.vehicle import Stick, both_ways, require_at_most
from drivers.contract import Drive, SteeringEncoder
from profiles.schema import Profile
from profiles.steered import SemitrailerGeometry

STEERING_SHARE: Final = 0.9
"""Of the steering angle, what a path may need; the rest is left to the law."""
BENDING_SHARE: Final = 0.6
"""Likewise of the bending angle."""
STEERING_PER_WAY_DEG_M: Final = 300.0
"""Backwards the speed leaves the steering so much time for each metre: what the laws were tuned for."""


class SemitrailerVehicle(SteeredVehicle):
    """A truck with a semi-trailer.

    Args:
        profile: the robot.
        drive: of the driven axle.
        steering: of the front axle.
        encoders: of the steering angle and of the bending angle.

    Attributes:
        geometry: its part of the profile.
        kinematics: with the limits of steering and bending angle.
        axle: the front axle.
        names: of its drives.
        reading: newest one; the truck's pose in it is that of the odometry.
        odometry: where the truck's driven axle is.
    """

    methods = ("drive.path", "drive.set")

    def __init__(
        self, profile: Profile, drive: Drive, steering: Drive, encoders: tuple[SteeringEncoder, SteeringEncoder]
    ) -> None:
        assert isinstance(profile.vehicle, SemitrailerGeometry)
        geometry = self.geometry = profile.vehicle
        acceleration = profile.drives[drive.name].acceleration_m_s2
        super().__init__(profile, geometry.steering, (drive,), steering, encoders, acceleration)
        hitches = (Hitch(geometry.hitch_offset_m, geometry.trailer.length_m),)
        steering_rad = math.radians(geometry.steering.limit_deg)
        bending_rad = math.radians(geometry.trailer.max_bending_deg)
        self.kinematics = ArticulatedVehicle(geometry.wheelbase_m, hitches, steering_rad, bending_rad)
        self._planned = ArticulatedVehicle(
            geometry.wheelbase_m, hitches, STEERING_SHARE * steering_rad, BENDING_SHARE * bending_rad
        )
        self.axle = geometry.steering
        self.names: tuple[str, ...] = (drive.name, steering.name)
        self.odometry = TruckOdometry(geometry.wheelbase_m)
        self.reading = VehicleReading(Pose(), (0.0,), 0.0, 0.0)
        self._bending = BendingObserver(hitches[0])
        self._travel_m: float | None = None
        self._measured_s = 0.0

    # --- measuring ---------------------------------------------------------------------------------------------

    def measure(self, now_s: float) -> Measurement:
        """The newest readings, and where the truck is by them."""
        measurement = self._readings(now_s)
        steering, sensed = measurement.heading_rad
        travel, last = measurement.wheel_travel_m[0], self._travel_m
        way = 0.0 if last is None else travel - last
        bending = self._bending.update(sensed, way, self.kinematics.curvature(steering), now_s - self._measured_s)
        self._travel_m, self._measured_s = travel, now_s
        truck = self.odometry.update(travel, steering)
        self.reading = VehicleReading(truck, (bending,), steering, measurement.wheel_speed_m_s[0])
        return measurement

    def locate(self, truck: Pose, weight: float = 1.0) -> None:
        """Go on from where somebody else says that the driven axle's middle is.

        Args:
            truck: its pose.
            weight: of that against the odometry's: 1 believes it, 0 does not.
        """
        self.odometry.correct(truck, weight)
        self.reading = replace(self.reading, truck=self.odometry.pose)

    # --- motions -----------------------------------------------------------------------------------------------

    def motion(self, method: str, params: dict[str, Any], lease: str | None) -> Motion:
        """The motion of ``drive.set``; ``drive.path`` plans first, and never comes here."""
        law = TruckLaw(self.kinematics, self.axle, self.profile.limits)
        return TruckStream(method, lease, self, law, streamed(self.set_point(params), params))

    def set_point(self, params: dict[str, Any]) -> TruckTarget:
        """The target that ``drive.set`` asks for. Raises LimitExceeded or Refused."""
        if params.get("yaw_rate_deg_s") or params.get("direction_deg"):
            remedy = "leave direction and yaw rate out; a negative speed drives backward"
            raise Refused("this truck turns by its steering angle only", remedy=remedy)
        speed, steering_deg = float(params["speed_m_s"]), float(params.get("steering_deg") or 0.0)
        self._speed(abs(speed))
        require_at_most("steering angle", abs(steering_deg), self.axle.limit_deg, "deg", "limit_deg")
        return TruckTarget(speed, math.radians(steering_deg))

    def sticks(self) -> dict[str, Stick]:
        """Speed, backward no faster than it is steered well, and steering angle."""
        fastest = self.profile.limits.speed_m_s
        return {"speed": (-min(fastest, self._backward_m_s), fastest), "steering": both_ways(self.axle.limit_deg)}

    async def plan_path(self, request: PathRequest) -> FollowedPath:
        """See :class:`daemon.runtime.path_commands.PathVehicle`."""
        speed = self._speed(request.speed_m_s)
        units = self.kinematics.poses(self.reading.truck, self.reading.bending_rad)
        pieces = request.spec.pieces
        backward = bool(pieces) and (pieces[0].drive == "backward") != request.backward
        path = await build_path(
            request.spec,
            units[-1 if backward else 0],
            lead_m=self.kinematics.straight_lead_m,
            exchanged=request.backward,
            forward_curvature=self._planned.stable_curvature,
            backward_curvature=self._planned.stable_rear_curvature,
            run_out_m=FollowingTuning().look_ahead_m,
        )
        return FollowedPath(self, path, speed, request.law == "published")

    def _speed(self, wanted_m_s: float | None) -> SpeedTuning:
        limits = self.profile.limits
        top = limits.speed_m_s if wanted_m_s is None else wanted_m_s
        require_at_most("speed", top, limits.speed_m_s, "m/s", "speed_m_s")
        return SpeedTuning(top, limits.acceleration_m_s2, limits.lateral_acceleration_m_s2, self._backward_m_s)

    @property
    def _backward_m_s(self) -> float:
        """Speed at which it is steered well backwards."""
        return self.axle.rate_deg_s / STEERING_PER_WAY_DEG_M

    def wheel_speeds(self, speed_m_s: float, steering_rad: float) -> tuple[float]:
        """The driven axle has one motor."""
        return (speed_m_s,)

    def require_free(self, motion: Motion) -> None:
        """The laws need both angles."""
        if isinstance(motion, PathMotion | TruckStream):
            for encoder in self.encoders:
                encoder.require_ready()

    @property
    def place(self) -> Pose:
        """Where it is by its odometry."""
        return self.reading.truck

    def wheel_headings(self) -> dict[str, float]:
        """The front axle's steering angle; all other wheels roll straight ahead."""
        straight = dict.fromkeys((*both_sides(REAR), *both_sides(TRAILER)), 0.0)
        return {**dict.fromkeys(both_sides(FRONT), self.reading.steering_rad), **straight}

    @property
    def turning_centre(self) -> Point | None:
        """Of the truck: beside its driven axle, by the steering angle, also at rest."""
        return centre_of_curvature(self.kinematics.curvature(self.reading.steering_rad))

    def smallest_radius_m(self, *, backward: bool) -> float | None:
        """Of the truck's axle forward, of the trailer's backward, in stable motion that leaves the law a reserve."""
        return 1.0 / (self._planned.stable_rear_curvature if backward else self._planned.stable_curvature)

    def status(self) -> dict[str, Any]:
        """Angles, jackknife margin and odometry of truck and trailer."""
        reading = self.reading
        truck, trailer = self.kinematics.poses(reading.truck, reading.bending_rad)
        return {
            "type": SemitrailerGeometry.type,
            "methods": list(self.methods),
            "steering_deg": round(math.degrees(reading.steering_rad), 3),
            "bending_deg": round(math.degrees(reading.bending_rad[0]), 3),
            "jackknife_margin_deg": round(math.degrees(self.kinematics.jackknife_margin(reading.bending_rad)), 3),
            "odometry": place_and_yaw(truck),
            "trailer": place_and_yaw(trailer),
        }
