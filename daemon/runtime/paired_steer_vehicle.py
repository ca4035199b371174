"""The vehicle whose wheels steer in pairs (MAX2D): its motions on the law ``daemon.loops.paired_steer``."""

from __future__ import annotations

import asyncio
import math
from typing import Any, Final

from canhelm.errors import Interlock, Refused, UsageError
from daemon.loops.geometry import PAIR_NAMES, Point, centre_of_rotation
from daemon.loops.locked_drive import LockedDrive
from daemon.loops.measurement import Measurement
from daemon.loops.odometry import Odometry, Pose
from daemon.loops.paired_steer import PairedSteerLaw
from daemon.loops.paired_steer_target import (
    SINGLE_CENTRE_LIMIT_RAD,
    PairedSteerTarget,
    check_speed,
    check_target,
    direction_target,
    parallel_target,
    steer_target,
    turn_target,
    why_not_rotate,
)
from daemon.loops.paired_traction import rim_drives
from daemon.loops.path_in_pieces import PiecePlanner
from daemon.loops.turning_centre import if_near
from daemon.runtime.motions import Motion
from daemon.runtime.paired_steer_motions import PairedSteerMotion
from daemon.runtime.path_building import build_path
from daemon.runtime.path_commands import PathRequest
from daemon.runtime.path_in_pieces import PiecesPlan
from daemon.runtime.poses import place_and_yaw
from daemon.runtime.streams import streamed
from daemon.runtime.vehicle import Stick, Vehicle, both_ways
from drivers.contract import Brake, Drive, SteeringEncoder
from profiles.schema import PairedSteerGeometry, Profile

PAUSE_S: Final = 0.002
"""Between two bits of planning a path: about as long as one takes, so that the control cycle keeps its time."""


class PairedSteerVehicle(Vehicle):
    """A robot with paired steering; order of wheels, encoders and brakes as in ``daemon.loops.geometry``."""

    methods = ("steer", "drive.parallel", "drive.turn", "drive.rotate", "drive.set", "drive.path")
    steers_at_rest = True

    def __init__(
        self,
        profile: Profile,
        drives: tuple[Drive, ...],
        encoders: tuple[SteeringEncoder, ...],
        brakes: tuple[Brake, ...],
    ) -> None:
        super().__init__(profile, drives, encoders, brakes)
        assert isinstance(profile.vehicle, PairedSteerGeometry)
        self.geometry = profile.vehicle
        self.limits = profile.limits
        self.odometry = Odometry(profile.vehicle)
        self.names = tuple(drive.name for drive in drives)

    def motion(self, method: str, params: dict[str, Any], lease: str | None) -> Motion:
        """The motion of ``steer``, ``drive.parallel``, ``drive.turn`` or ``drive.set``; ``drive.rotate`` is refused."""
        if method == "drive.rotate":
            raise Refused(why_not_rotate(), remedy="`canhelm drive turn` or `canhelm drive parallel`")
        if method == "drive.set":
            set_point = self.set_point(params)
            stream = streamed(set_point, params)
            return PairedSteerMotion(method, self.names, lease, self.new_law(), set_point, stream)
        target = self._target(method, params)
        check_target(self.geometry, self.limits, target)
        return PairedSteerMotion(method, self.names, lease, self.new_law(), target)

    def set_point(self, params: dict[str, Any]) -> PairedSteerTarget:
        """The target that ``drive.set`` asks for. Raises LimitExceeded, Refused or UsageError."""
        if params.get("yaw_rate_deg_s"):
            raise Refused(why_not_rotate(), remedy="leave the yaw rate out, give a steering angle")
        direction_rad = math.radians(params.get("direction_deg") or 0.0)
        steering_rad = math.radians(params.get("steering_deg") or 0.0)
        target = direction_target(direction_rad, float(params["speed_m_s"]), steering_rad)
        check_target(self.geometry, self.limits, target)
        return target

    def sticks(self) -> dict[str, Stick]:
        """Speed, steering of both pairs against each other as far as one centre serves all wheels, and direction."""
        heading_deg = self.limits.heading_deg
        steering_deg = min(math.degrees(SINGLE_CENTRE_LIMIT_RAD), heading_deg)
        return {
            "speed": both_ways(self.limits.speed_m_s),
            "steering": both_ways(steering_deg),
            "direction": both_ways(heading_deg),
        }

    def ramp_s(self) -> float:
        """On the narrowest curve, where the fastest wheel's ramp counts."""
        steering_rad = math.radians(self.sticks()["steering"][1])
        curve = LockedDrive(self.geometry, self.limits, (-steering_rad, steering_rad))
        return self.limits.speed_m_s / curve.acceleration_m_s2

    def new_law(self) -> PairedSteerLaw:
        """A law of its own for one motion."""
        return PairedSteerLaw(self.geometry, self.limits, rim_drives(self.profile))

    def _target(self, method: str, params: dict[str, Any]) -> PairedSteerTarget:
        if method == "steer":
            pair = str(params["pair"])
            if pair not in PAIR_NAMES:
                raise UsageError(f"no wheel pair {pair!r}", remedy=f"one of {', '.join(PAIR_NAMES)}")
            return steer_target(PAIR_NAMES.index(pair), math.radians(params["angle_deg"]))
        speed = float(params["speed_m_s"])
        duration = float(params["duration_s"])
        if method == "drive.parallel":
            return parallel_target(math.radians(params["angle_deg"]), speed, duration)
        return turn_target(math.radians(params["rear_deg"]), math.radians(params["front_deg"]), speed, duration)

    async def plan_path(self, request: PathRequest) -> PiecesPlan:
        """The pieces in which a path is followed; the robot stops and steers between them.

        Raises:
            UsageError: the path is empty, or its pieces do not join.
            LimitExceeded: it cannot be followed closely enough, or the speed is beyond the limit.
            Refused: another law than the vehicle's own is asked for.
        """
        if request.law != "cascade":
            raise Refused(
                f"this robot stops to steer: it does not follow paths by the {request.law} law",
                remedy="leave --published out",
            )
        speed = self.limits.speed_m_s if request.speed_m_s is None else request.speed_m_s
        check_speed(self.limits, speed)
        pose = self.odometry.pose
        path = await build_path(
            request.spec,
            pose,
            exchanged=request.backward,
            forward_curvature=math.inf,
            backward_curvature=math.inf,
            run_out_m=0.0,
        )
        plan = PiecesPlan(self, path, speed)
        for piece in PiecePlanner(self.geometry, self.limits, path, pose.yaw_rad):
            if piece is not None:
                plan.add(piece)
            await asyncio.sleep(PAUSE_S)
        return plan

    def observe(self, measurement: Measurement) -> None:
        """Odometry."""
        self.odometry.update(measurement)

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

    @property
    def place(self) -> Pose:
        """Where it is by its odometry."""
        return self.odometry.pose

    def wheel_headings(self) -> dict[str, float]:
        """Those of the pairs, by their encoders."""
        rear, front = (encoder.heading_rad for encoder in self.encoders)
        return dict(zip(self.names, (rear, rear, front, front), strict=True))

    @property
    def turning_centre(self) -> Point | None:
        """Where both pairs' axles point to, also at rest."""
        rear, front = (encoder.heading_rad for encoder in self.encoders)
        return if_near(centre_of_rotation(self.geometry, rear, front))

    def smallest_radius_m(self, *, backward: bool) -> float | None:
        """Zero: what cannot be steered is driven in parts, between which the robot stops."""
        return 0.0

    def status(self) -> dict[str, Any]:
        """Headings and odometry."""
        return {
            "type": self.geometry.type,
            "methods": list(self.methods),
            "heading_deg": {
                name: round(math.degrees(encoder.heading_rad), 3)
                for name, encoder in zip(PAIR_NAMES, self.encoders, strict=True)
            },
            "odometry": place_and_yaw(self.odometry.pose),
        }
