"""The car with front-wheel steering (ENPM808X report): headings, arcs, streams, and paths."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any, Final

from canhelm.errors import Refused, UsageError
from daemon.loops.ackermann import wheel_angles, wheel_speeds
from daemon.loops.ackermann_drive import CarLaw, CarTarget, car_kinematics
from daemon.loops.articulated import ArticulatedVehicle
from daemon.loops.measurement import Measurement
from daemon.loops.odometry import Pose
from daemon.loops.path_driving import VehicleReading
from daemon.loops.path_following import FollowingTuning
from daemon.loops.path_speed import SpeedTuning
from daemon.loops.truck_odometry import TruckOdometry
from daemon.loops.turning_centre import Point, centre_of_curvature
from daemon.runtime.car_motions import CarMotion
from daemon.runtime.motions import Motion
from daemon.runtime.path_building import build_path
from daemon.runtime.path_commands import PathRequest
from daemon.runtime.path_motions import FollowedPath, PathMotion
from daemon.runtime.poses import place_and_yaw
from daemon.runtime.shapes import FRONT, both_sides
from daemon.runtime.steered_vehicle import SteeredVehicle
from daemon.runtime.streams import streamed
from daemon.runtime.vehicle import Stick, both_ways, require_at_most
from drivers.contract import Drive, SteeringEncoder
from profiles.schema import Profile
from profiles.steered import CarGeometry

STEERING_SHARE: Final = 0.9
"""Of the steering angle, what a path may need; the rest is left to the law."""
NO_REVERSE: Final = "this car has no reverse gear: none of its wheels turns backwards"


class CarVehicle(SteeredVehicle):
    """A car; its drives are those of the rear wheels, left and right, and of the steering.

    Attributes:
        kinematics: those of a truck without a trailer, for paths.
        axle: the front axle.
        names: of its drives.
        reading: newest one.
        odometry: where the middle of the rear axle is.
    """

    methods = ("drive.heading", "drive.turn", "drive.set", "drive.path")

    def __init__(self, profile: Profile, wheels: tuple[Drive, ...], steering: Drive, encoder: SteeringEncoder) -> None:
        assert isinstance(profile.vehicle, CarGeometry)
        acceleration = min(profile.drives[drive.name].acceleration_m_s2 for drive in wheels)
        super().__init__(profile, profile.vehicle.steering, wheels, steering, (encoder,), acceleration)
        self._geometry = profile.vehicle
        self._limits = profile.limits
        self._wheel_radius_m = profile.drives[wheels[0].name].wheel_radius_m
        self._car = car_kinematics(profile.vehicle, profile.limits, self._wheel_radius_m)
        self._period_s = 1.0 / profile.network.cycle_hz
        self.names = tuple(drive.name for drive in self.drives)
        self._wheel_acceleration_m_s2 = acceleration
        self.axle = profile.vehicle.steering
        limit_rad = math.radians(self.axle.limit_deg)
        self.kinematics = ArticulatedVehicle(profile.vehicle.wheelbase_m, (), limit_rad)
        self._planned = ArticulatedVehicle(profile.vehicle.wheelbase_m, (), STEERING_SHARE * limit_rad)
        self.odometry = TruckOdometry(profile.vehicle.wheelbase_m)
        self.reading = VehicleReading(Pose(), (), 0.0, 0.0)

    # --- motions -----------------------------------------------------------------------------------------------

    def motion(self, method: str, params: dict[str, Any], lease: str | None) -> Motion:
        """The motion of ``drive.heading``, ``drive.turn`` or ``drive.set``."""
        law = self._law()
        if method == "drive.set":
            target = self.set_point(params)
            return CarMotion(method, self.names, lease, self, law, target, stream=streamed(target, params))
        if method == "drive.turn":
            return CarMotion(method, self.names, lease, self, law, self._arc(params))
        target = CarTarget(self._speed(params), heading_rad=math.radians(params["heading_deg"]))
        return CarMotion(method, self.names, lease, self, law, target, float(params["duration_s"]))

    def _law(self) -> CarLaw:
        return CarLaw(
            self._geometry,
            self._limits,
            self._wheel_radius_m,
            self._wheel_acceleration_m_s2,
            self.arm_m,
            self._period_s,
        )

    def _speed(self, params: dict[str, Any]) -> float:
        speed = float(params["speed_m_s"])
        if not math.isfinite(speed):
            raise UsageError("the speed is not a finite number", remedy="give m/s")
        if speed < 0:
            raise Refused(NO_REVERSE, value=speed, remedy="give a positive speed, and turn round forwards")
        require_at_most("speed", speed, self._limits.speed_m_s, "m/s", "speed_m_s")
        return speed

    def set_point(self, params: dict[str, Any]) -> CarTarget:
        """A steering angle, or a direction in the car's frame as the heading that lies there now."""
        steering_deg, direction_deg = params.get("steering_deg"), float(params.get("direction_deg") or 0.0)
        if params.get("yaw_rate_deg_s"):
            remedy = "leave the yaw rate out, give a direction or a steering angle"
            raise Refused("this car turns by its steering only", remedy=remedy)
        if steering_deg is None:
            heading = self.odometry.pose.yaw_rad + math.radians(direction_deg)
            return CarTarget(self._speed(params), heading_rad=heading)
        if direction_deg:
            raise UsageError("a direction and a steering angle contradict each other", remedy="give one of them")
        require_at_most("steering angle", abs(steering_deg), self._geometry.steering.limit_deg, "deg", "limit_deg")
        return CarTarget(self._speed(params), steering_rad=math.radians(steering_deg))

    def sticks(self) -> dict[str, Stick]:
        """Speed, forward only, and steering angle."""
        return {"speed": (0.0, self._limits.speed_m_s), "steering": both_ways(self.axle.limit_deg)}

    def _arc(self, params: dict[str, Any]) -> CarTarget:
        """An arc of fixed steering; only the front axle steers."""
        speed, front_deg = self._speed(params), float(params["front_deg"])
        if params["rear_deg"]:
            raise Refused("the rear wheels of this car do not steer", value=params["rear_deg"], remedy="give --rear 0")
        require_at_most("steering angle", abs(front_deg), self._geometry.steering.limit_deg, "deg", "limit_deg")
        steering = math.radians(front_deg)
        slope = abs(math.tan(steering)) / self._geometry.wheelbase_m
        grip = math.sqrt(self._limits.lateral_acceleration_m_s2 / slope) if slope else math.inf
        require_at_most("speed on this arc", speed, grip, "m/s", "lateral_acceleration_m_s2 allows")
        wheels = self._limits.wheel_speed_m_s / (1.0 + self._geometry.track_m / 2 * slope)
        require_at_most("speed on this arc", speed, wheels, "m/s", "wheel_speed_m_s of the outer wheel allows")
        return CarTarget(speed, steering_rad=steering, distance_m=speed * float(params["duration_s"]))

    # --- paths -------------------------------------------------------------------------------------------------

    async def plan_path(self, request: PathRequest) -> FollowedPath:
        """See :class:`daemon.runtime.path_commands.PathVehicle`; this car is refused what is driven backwards."""
        _refuse_reverse(request)
        speed = self._limits.speed_m_s if request.speed_m_s is None else self._speed({"speed_m_s": request.speed_m_s})
        path = await build_path(
            request.spec,
            self.reading.truck,
            forward_curvature=self._planned.stable_curvature,
            backward_curvature=0.0,
            run_out_m=FollowingTuning().look_ahead_m,
        )
        tuning = SpeedTuning(speed, self._limits.acceleration_m_s2, self._limits.lateral_acceleration_m_s2)
        return FollowedPath(self, path, tuning, request.law == "published")

    def wheel_speeds(self, speed_m_s: float, steering_rad: float) -> tuple[float, float]:
        """Rim speeds of the left and the right rear wheel for a speed of their axle's middle."""
        left, right = wheel_speeds(self._car, steering_rad, speed_m_s)
        return max(0.0, left * self._wheel_radius_m), max(0.0, right * self._wheel_radius_m)

    # --- measuring ---------------------------------------------------------------------------------------------

    def measure(self, now_s: float) -> Measurement:
        """The newest readings, and where the car is by them."""
        measurement = self._readings(now_s)
        (left, right, _), (steering,) = measurement.wheel_travel_m, measurement.heading_rad
        pose = self.odometry.update((left + right) / 2, steering)
        speed = (measurement.wheel_speed_m_s[0] + measurement.wheel_speed_m_s[1]) / 2
        self.reading = VehicleReading(pose, (), steering, speed)
        return measurement

    def locate(self, rear_axle: Pose, weight: float = 1.0) -> None:
        """Go on from where somebody else says that the rear axle's middle is; weight 1 believes it, 0 does not."""
        self.odometry.correct(rear_axle, weight)
        self.reading = replace(self.reading, truck=self.odometry.pose)

    def require_free(self, motion: Motion) -> None:
        """The laws need the steering angle."""
        if isinstance(motion, CarMotion | PathMotion):
            self.encoders[0].require_ready()

    @property
    def place(self) -> Pose:
        """Where it is by its odometry."""
        return self.odometry.pose

    def wheel_headings(self) -> dict[str, float]:
        """The front wheels' by the steering angle, each about the centre of the turn (report, eq. 4.2, 4.3)."""
        steering = wheel_angles(self._car, self.encoders[0].heading_rad)
        return dict(zip((*self.names[:2], *both_sides(FRONT)), (0.0, 0.0, *steering), strict=True))

    @property
    def turning_centre(self) -> Point | None:
        """Beside the rear axle, by the steering angle, also at rest."""
        return centre_of_curvature(self.kinematics.curvature(self.encoders[0].heading_rad))

    def smallest_radius_m(self, *, backward: bool) -> float | None:
        """That of the steering angle that a path may need; None backward."""
        return None if backward else 1.0 / self._planned.stable_curvature

    def status(self) -> dict[str, Any]:
        """Steering angle and odometry of the rear axle's middle."""
        return {
            "type": self._geometry.type,
            "methods": list(self.methods),
            "steering_deg": round(math.degrees(self.encoders[0].heading_rad), 3),
            "odometry": place_and_yaw(self.place),
        }


def _refuse_reverse(request: PathRequest) -> None:
    """Raise Refused, with the piece, where a path is driven backwards."""
    remedy = "drive the path forwards: leave --backward and drive: backward out"
    if request.backward:
        raise Refused(NO_REVERSE, remedy=remedy)
    for number, piece in enumerate(request.spec.pieces):
        if piece.drive == "backward":
            raise Refused(NO_REVERSE, object=f"pieces[{number}]", remedy=remedy)
