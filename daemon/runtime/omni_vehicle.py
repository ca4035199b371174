"""The vehicle on omni-wheels (Turtle): its motions on the law ``daemon.loops.omni_drive``."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

from canhelm.errors import Refused, UsageError
from daemon.loops.accelerometer import Mounting
from daemon.loops.jerk_limit import JerkLimitedGuide
from daemon.loops.measurement import Measurement
from daemon.loops.odometry import Pose
from daemon.loops.omni_drive import OmniLaw
from daemon.loops.omni_guide import GoalGuide, Guide, PublishedGuide, Signals, Twist, TwistGuide
from daemon.loops.omni_senses import OmniSenses, omni_kinematics, omni_observer
from daemon.loops.planner import FARTHEST, PlanarLimits, PlanarState
from daemon.loops.slip import THRESHOLD_M_S2
from daemon.loops.traction import Traction, TractionTuning
from daemon.loops.turning_centre import Point, centre_of_twist
from daemon.runtime.motions import Motion
from daemon.runtime.omni_motions import GoalMotion, OmniMotion, TwistMotion, longest_drive_s
from daemon.runtime.poses import place_and_yaw
from daemon.runtime.rest import AT_REST_M_S
from daemon.runtime.streams import streamed
from daemon.runtime.vehicle import Stick, Vehicle, both_ways, require_at_most, require_near
from drivers.contract import Accelerometer as Sensor
from drivers.contract import Drive, DriveState
from profiles.schema import OmniGeometry, Profile

SLOWEST_M_S = 1e-3
"""Slowest speed limit that is planned with."""
SLIP_BY_CURRENTS_M_S2, GRIP_BY_CURRENTS_M_S2 = 0.5, 0.35
"""Levels at which slip begins and ends where currents tell the acceleration: above their errors while it turns."""


class OmniVehicle(Vehicle):
    """A robot on omni-wheels, in the order of its profile.

    Args:
        profile: the robot.
        drives: of its wheels.
        sensor: its accelerometer; without one the motors' currents tell slip.

    Attributes:
        senses: what it knows of its own motion.
    """

    methods = ("drive.to", "drive.parallel", "drive.rotate", "drive.set")

    def __init__(self, profile: Profile, drives: tuple[Drive, ...], sensor: Sensor | None) -> None:
        slowest = min(profile.drives[drive.name].acceleration_m_s2 for drive in drives)
        super().__init__(profile, drives, wheel_acceleration_m_s2=slowest)
        assert isinstance(profile.vehicle, OmniGeometry)
        limits = profile.limits
        self.limits = PlanarLimits(
            limits.speed_m_s,
            limits.acceleration_m_s2,
            math.radians(limits.yaw_rate_deg_s),
            math.radians(limits.yaw_acceleration_deg_s2),
        )
        self._kinematics = omni_kinematics(profile.vehicle)
        self._names = tuple(drive.name for drive in drives)
        self._sensor = sensor
        self._period_s = 1.0 / profile.network.cycle_hz
        config = profile.accelerometer
        mounting = Mounting(config.x_m, config.y_m, math.radians(config.rotation_deg)) if config else Mounting()
        self.senses = OmniSenses(self._kinematics, mounting, omni_observer(profile, self._kinematics))
        self._last_s = -math.inf

    # --- measuring ---------------------------------------------------------------------------------------------

    def measure(self, now_s: float) -> Measurement:
        """The newest readings; pose, acceleration of the centre and slip by them."""
        measurement = self._readings(now_s, self._sensor.acceleration_m_s2 if self._sensor else None)
        dt_s, self._last_s = min(now_s - self._last_s, 5 * self._period_s), now_s
        off = [drive.state is DriveState.DISABLED for drive in self.drives]
        slow = all(abs(speed) < AT_REST_M_S for speed in measurement.wheel_speed_m_s)
        powered = any(drive.state is DriveState.ENABLED for drive in self.drives)
        self.senses.update(measurement, dt_s, powered=powered, standing=all(off) and slow)
        return measurement

    @property
    def pushing(self) -> bool:
        """By its senses, where it has any that tell slip."""
        return self.senses.pushing

    # --- motions -----------------------------------------------------------------------------------------------

    def motion(self, method: str, params: dict[str, Any], lease: str | None) -> Motion:
        """The motion of ``drive.to``, ``drive.parallel``, ``drive.rotate`` or ``drive.set``."""
        if method == "drive.to":
            return self._to(params, lease)
        if method == "drive.parallel":
            return self._parallel(params, lease)
        if method == "drive.set":
            law, guide = self._on_twist(self.set_point(params))
            stream = streamed(guide.twist, params)
            return TwistMotion(method, self._names, lease, self.senses, law, guide, stream=stream)
        law, guide = self._on_twist(self._twist(0.0, 0.0, params["rate_deg_s"]))
        return TwistMotion(method, self._names, lease, self.senses, law, guide, params.get("duration_s"))

    def set_point(self, params: dict[str, Any]) -> Twist:
        """The twist that ``drive.set`` asks for. Raises LimitExceeded, Refused or UsageError."""
        if params.get("steering_deg"):
            raise Refused("omni-wheels do not steer", value=params["steering_deg"], remedy="give a direction")
        direction_deg = float(params.get("direction_deg") or 0.0)
        return self._twist(float(params["speed_m_s"]), direction_deg, params.get("yaw_rate_deg_s"))

    def sticks(self) -> dict[str, Stick]:
        """Speed in both directions, and yaw rate."""
        speed, rate = both_ways(self.limits.speed), both_ways(self.profile.limits.yaw_rate_deg_s)
        return {"speed": speed, "sideways": speed, "yaw_rate": rate}

    def to_goal(
        self,
        goal: PlanarState,
        limits: PlanarLimits,
        lease: str | None,
        *,
        kind: str = "drive.to",
        published: bool = False,
        signals: Signals | None = None,
        threshold_m_s2: float = THRESHOLD_M_S2,
    ) -> OmniMotion:
        """A motion to a goal in the odometry's frame.

        Args:
            goal: place, heading and velocity there.
            limits: of this motion, within the vehicle's.
            lease: who holds it.
            kind: the method that asks for it.
            published: by the planner and the traction controller of the Turtle robot's report.
            signals: accelerations that these detect slip by, instead of the robot's own.
            threshold_m_s2: of slip, for these.

        Raises:
            UsageError: a number is none, or too large.
            LimitExceeded: a limit is beyond the vehicle's, the velocity at the goal beyond the limit, or the goal of
                ``drive.to`` too far away.
        """
        self._check(goal, limits)
        here = self.senses.pose
        distance_m = math.hypot(goal.x - here.x_m, goal.y - here.y_m)
        if kind == "drive.to":
            require_near(distance_m, self.profile.limits)
        guide: Guide
        jerk, traction = self.profile.limits.jerk_m_s3, self._new_traction(limits.acceleration)
        longest_s = math.inf
        if published:
            guide = PublishedGuide(goal, limits, self._period_s, signals, threshold_m_s2)
            longest_s = longest_drive_s(distance_m, limits)
        elif jerk is not None:
            guide = JerkLimitedGuide(goal, limits, jerk, self._period_s, traction)
        else:
            guide = GoalGuide(goal, limits, traction)
        return GoalMotion(kind, self._names, lease, self.senses, self._law(guide), goal, longest_s)

    def _to(self, params: dict[str, Any], lease: str | None) -> Motion:
        heading, speed = params.get("heading_deg"), params.get("speed_m_s")
        yaw = self.senses.pose.yaw_rad if heading is None else math.radians(heading)
        goal = PlanarState(
            params["x_m"], params["y_m"], yaw, params.get("end_vx_m_s", 0.0), params.get("end_vy_m_s", 0.0)
        )
        limits = self.limits if speed is None else replace(self.limits, speed=float(speed))
        published = params.get("planner") == "published"
        if published and (heading is not None or goal.vx or goal.vy):
            what = "turns no robot" if heading is not None else "drives to a goal with a velocity again and again"
            remedy = "leave the planner (--published) out, or give a place alone"
            raise UsageError(f"the published planner {what}", object="planner", remedy=remedy)
        return self.to_goal(goal, limits, lease, published=published)

    def _parallel(self, params: dict[str, Any], lease: str | None) -> Motion:
        """The way that speed and duration make, as a goal."""
        pose, speed = self.senses.pose, float(params["speed_m_s"])
        angle, way = pose.yaw_rad + math.radians(params["angle_deg"]), speed * float(params["duration_s"])
        goal = PlanarState(pose.x_m + way * math.cos(angle), pose.y_m + way * math.sin(angle), pose.yaw_rad)
        limits = replace(self.limits, speed=max(abs(speed), SLOWEST_M_S))
        return self.to_goal(goal, limits, lease, kind="drive.parallel")

    def _twist(self, speed: float, direction_deg: float, rate_deg_s: float | None) -> Twist:
        """A twist within the limits. Raises LimitExceeded or UsageError."""
        rate, angle = math.radians(rate_deg_s or 0.0), math.radians(direction_deg)
        twist = speed * math.cos(angle), speed * math.sin(angle), rate
        if not all(map(math.isfinite, twist)):
            raise UsageError("a direction, speed or rate is not a finite number", remedy="give finite numbers")
        require_at_most("speed", abs(speed), self.limits.speed, "m/s", "speed_m_s")
        require_at_most("yaw rate", math.degrees(abs(rate)), math.degrees(self.limits.rate), "deg/s", "yaw_rate_deg_s")
        return twist

    def _on_twist(self, twist: Twist) -> tuple[OmniLaw, TwistGuide]:
        guide = TwistGuide(twist, self.limits, self._new_traction(self.limits.acceleration))
        return self._law(guide), guide

    def _new_traction(self, acceleration_m_s2: float) -> Traction | None:
        config = self.profile.traction
        if config is None or not self.senses.observing:
            return None
        tuning = TractionTuning(response_s=config.response_s)
        if self._sensor is None:
            tuning = replace(tuning, slip_m_s2=SLIP_BY_CURRENTS_M_S2, grip_m_s2=GRIP_BY_CURRENTS_M_S2)
        return Traction(acceleration_m_s2, tuning)

    def _law(self, guide: Guide) -> OmniLaw:
        published = isinstance(guide, PublishedGuide)
        return OmniLaw(self._kinematics, guide, self.limits, self.senses, holds_wheels=not published)

    def _check(self, goal: PlanarState, limits: PlanarLimits) -> None:
        bounds = {"speed_m_s": limits.speed, "acceleration_m_s2": limits.acceleration}
        place = {"x_m": goal.x, "y_m": goal.y, "heading_deg": math.degrees(goal.heading)}
        for name, number in {**place, "end_vx_m_s": goal.vx, "end_vy_m_s": goal.vy, **bounds}.items():
            if not abs(number) < FARTHEST:
                remedy = f"give a number below {FARTHEST:g}"
                raise UsageError(f"{name} is {number:g}: not a finite number, or too large", object=name, remedy=remedy)
            if name in bounds and number <= 0:
                raise UsageError(f"{name} is {number:g}: not positive", object=name, remedy="give more than 0")
        require_at_most("speed", limits.speed, self.limits.speed, "m/s", "speed_m_s")
        require_at_most("acceleration", limits.acceleration, self.limits.acceleration, "m/s^2", "acceleration_m_s2")
        require_at_most("speed at the goal", math.hypot(goal.vx, goal.vy), limits.speed, "m/s", "speed_m_s")

    @property
    def place(self) -> Pose:
        """Where it is by its odometry."""
        return self.senses.pose

    def wheel_headings(self) -> dict[str, float]:
        """Omni-wheels do not steer."""
        assert isinstance(self.profile.vehicle, OmniGeometry)
        return {name: math.radians(wheel.direction_deg) for name, wheel in self.profile.vehicle.wheels.items()}

    @property
    def turning_centre(self) -> Point | None:
        """By the motion of the body."""
        return centre_of_twist(*self.senses.motion)

    def status(self) -> dict[str, Any]:
        """Odometry, motion and acceleration of the centre."""
        pose, (vx, vy, rate), centre = self.senses.pose, self.senses.motion, self.senses.acceleration
        return {
            "type": OmniGeometry.type,
            "methods": list(self.methods),
            "odometry": place_and_yaw(pose),
            "velocity": {
                "forward_m_s": round(vx, 4),
                "left_m_s": round(vy, 4),
                "yaw_rate_deg_s": round(math.degrees(rate), 3),
            },
            "acceleration_m_s2": None if centre is None else [round(value, 3) for value in centre],
        }
