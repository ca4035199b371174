"""A vehicle of one's own kind: what the daemon does around the law that a profile names."""

from __future__ import annotations

import inspect
import logging
import math
from typing import Any

from canhelm.errors import DeviceFault, Refused, UsageError
from daemon.loops.measurement import Measurement
from daemon.loops.odometry import MAX_STEP_M, Pose, moved_along_arc
from daemon.loops.own_vehicle import OwnVehicle, Twist
from daemon.loops.turning_centre import Point, centre_of_twist
from daemon.runtime.motions import Motion
from daemon.runtime.own_motions import OwnMotion
from daemon.runtime.poses import place_and_yaw
from daemon.runtime.streams import streamed
from daemon.runtime.vehicle import Stick, Vehicle, both_ways, require_at_most
from drivers.contract import Brake, Drive, SteeringEncoder
from profiles.own_class import load_class
from profiles.own_vehicle import OwnGeometry
from profiles.schema import Profile

LOGGER = logging.getLogger("canhelm")


class OwnKindVehicle(Vehicle):
    """A vehicle with a law of its own.

    Args:
        profile: the robot.
        drives, encoders, brakes: in the order of the law.

    Attributes:
        pose: where the robot is, by its wheels.
        motion_now: of its body, by its wheels.
        skipped: readings that were not used because they cannot be true.
        failure: why the law's odometry cannot be trusted any more; empty while it can.

    Raises:
        ImportError: the law is not there any more.
    """

    methods = ("drive.parallel", "drive.rotate", "drive.set")

    def __init__(
        self,
        profile: Profile,
        drives: tuple[Drive, ...],
        encoders: tuple[SteeringEncoder, ...],
        brakes: tuple[Brake, ...],
    ) -> None:
        super().__init__(profile, drives, encoders, brakes)
        assert isinstance(profile.vehicle, OwnGeometry)
        self._geometry = profile.vehicle
        self._class = load_class(profile.vehicle.kind)
        self._names = tuple(drive.name for drive in drives)
        self._law = self._new_law()
        self._last_m: tuple[float, ...] | None = None
        self.pose = Pose()
        self.motion_now = Twist(0.0, 0.0, 0.0)
        self.skipped = 0
        self.failure = ""
        file = inspect.getsourcefile(self._class)
        LOGGER.info("%s of %s runs inside this daemon, with all of its rights", profile.vehicle.kind, file)

    def _new_law(self) -> OwnVehicle:
        law: OwnVehicle = self._class(self._geometry.parameters, self.profile.limits)
        return law

    # --- motions -----------------------------------------------------------------------------------------------

    def motion(self, method: str, params: dict[str, Any], lease: str | None) -> Motion:
        """The motion of ``drive.parallel``, ``drive.rotate`` or ``drive.set``."""
        if self.failure:
            raise DeviceFault(self.failure, remedy="mend the class, then start the daemon anew")
        law = self._new_law()
        if method == "drive.set":
            twist = self.set_point(params)
            return OwnMotion(method, self._names, lease, law, self, twist, stream=streamed(twist, params))
        angle_deg, speed_m_s = params.get("angle_deg", 0.0), params.get("speed_m_s", 0.0)
        twist = self._twist(speed_m_s, angle_deg, params.get("rate_deg_s", 0.0))
        return OwnMotion(method, self._names, lease, law, self, twist, params.get("duration_s"))

    def set_point(self, params: dict[str, Any]) -> Twist:
        """The twist that ``drive.set`` asks for. Raises LimitExceeded, Refused or UsageError."""
        if params.get("steering_deg"):
            raise Refused("this robot takes no steering angle", remedy="give a direction and a yaw rate")
        direction_deg = params.get("direction_deg") or 0.0
        return self._twist(params["speed_m_s"], direction_deg, params.get("yaw_rate_deg_s") or 0.0)

    def sticks(self) -> dict[str, Stick]:
        """Speed in both directions, and yaw rate; what the law objects to is refused all the same."""
        speed, rate = both_ways(self.profile.limits.speed_m_s), both_ways(self.profile.limits.yaw_rate_deg_s)
        return {"speed": speed, "sideways": speed, "yaw_rate": rate}

    def _twist(self, speed: float, angle_deg: float, rate_deg_s: float) -> Twist:
        """A twist that limits and law allow. Raises LimitExceeded, Refused or UsageError."""
        angle = math.radians(angle_deg)
        twist = Twist(speed * math.cos(angle), speed * math.sin(angle), math.radians(rate_deg_s))
        if not all(map(math.isfinite, twist)):
            raise UsageError("a direction, speed or rate is not a finite number", remedy="give finite numbers")
        limits = self.profile.limits
        require_at_most("speed", abs(speed), limits.speed_m_s, "m/s", "speed_m_s")
        require_at_most("yaw rate", abs(rate_deg_s), limits.yaw_rate_deg_s, "deg/s", "yaw_rate_deg_s")
        if objection := self._law.objection(twist):
            raise Refused(objection, remedy="ask for another direction, speed or yaw rate")
        return twist

    # --- measuring ---------------------------------------------------------------------------------------------

    def observe(self, measurement: Measurement) -> None:
        """Odometry by the law; a law that fails here is asked no more, and a motion under way ends."""
        if self.failure:
            return
        last, self._last_m = self._last_m, measurement.wheel_travel_m
        rolled = [new - old for new, old in zip(measurement.wheel_travel_m, last or self._last_m, strict=True)]
        if not all(abs(way) <= MAX_STEP_M for way in rolled):
            self.skipped += 1
            return
        try:
            self.motion_now = self._law.body_motion(measurement.wheel_speed_m_s, measurement.heading_rad)
            way = self._law.body_motion(rolled, measurement.heading_rad)
            if not all(map(math.isfinite, way)):
                raise ValueError(f"{way} is no way of a body")
            self.pose = moved_along_arc(self.pose, *way)
        except Exception as error:
            LOGGER.exception("%s failed", self._geometry.kind)
            self.failure = f"the odometry of {self._geometry.kind} failed: {error}"

    @property
    def place(self) -> Pose:
        """Where it is by its odometry."""
        return self.pose

    @property
    def turning_centre(self) -> Point | None:
        """By the motion of the body; the law says nothing of the wheels' places."""
        return centre_of_twist(*self.motion_now)

    def status(self) -> dict[str, Any]:
        """Its kind, odometry and motion."""
        forward, left, rate = self.motion_now
        return {
            "type": self._geometry.type,
            "kind": self._geometry.kind,
            "methods": list(self.methods),
            "failure": self.failure,
            "odometry": place_and_yaw(self.pose),
            "velocity": {
                "forward_m_s": round(forward, 4),
                "left_m_s": round(left, 4),
                "yaw_rate_deg_s": round(math.degrees(rate), 3),
            },
        }
