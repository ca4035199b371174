"""The robot on two wheels: drives on CAN, or motors of an NXT brick, which can carry out moves itself."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from typing import Any

from canhelm.errors import LimitExceeded, Refused, UsageError
from daemon.loops.differential import DifferentialDrive, Move, bend, line, parse_move, way_to
from daemon.loops.differential_odometry import DifferentialOdometry
from daemon.loops.differential_twist import DifferentialTwistLaw
from daemon.loops.measurement import Measurement
from daemon.loops.odometry import Pose
from daemon.loops.pose_feedback import REPORT_GAINS, SLOW_CYCLE_GAINS, SeekSettings, Tolerance
from daemon.loops.turning_centre import Point, centre_of_twist
from daemon.runtime.differential_motions import BrickMoves, BrickWheels, PoseMotion
from daemon.runtime.differential_stream import DifferentialStream, SetPoint
from daemon.runtime.motions import Motion
from daemon.runtime.poses import place_and_yaw
from daemon.runtime.streams import streamed
from daemon.runtime.vehicle import Stick, Vehicle, both_ways, require_at_most, require_near
from drivers.contract import Drive
from drivers.nxt.motors import NxtDrive
from profiles.bricks import DifferentialGeometry, NxtMotorConfig
from profiles.schema import Profile

GAINS = {"slow": SLOW_CYCLE_GAINS, "report": REPORT_GAINS}
TOLERANCE_M, TOLERANCE_DEG, TIMEOUT_S = 0.002, 1.0, 30.0
FARTHEST_DEG = 1e8
"""A brick counts to 2^31."""


class DifferentialVehicle(Vehicle):
    """A robot on two wheels.

    Args:
        profile: the robot.
        wheels: its drives, right and left.
    """

    methods: tuple[str, ...] = ("drive.to", "drive.set")

    def __init__(self, profile: Profile, wheels: tuple[Drive, Drive]) -> None:
        super().__init__(profile, wheels)
        assert isinstance(profile.vehicle, DifferentialGeometry)
        configs = [profile.wheels[drive.name] for drive in wheels]
        self._radii_m = (configs[0].wheel_radius_m, configs[1].wheel_radius_m)
        self._drive = DifferentialDrive(self._radii_m[0], profile.vehicle.half_track_m)
        right, left = (math.radians(c.play_deg) if isinstance(c, NxtMotorConfig) else 0.0 for c in configs)
        order = list(profile.wheels)
        left_first = order.index(wheels[1].name) < order.index(wheels[0].name)
        self.odometry = DifferentialOdometry(self._drive, (right, left), left_first)
        self._names = tuple(drive.name for drive in wheels)
        self._brick = _brick_wheels(wheels)
        if self._brick is not None:
            self.methods = ("drive.to", "drive.set", "nxt.line", "nxt.bend", "nxt.goto", "nxt.moves")

    def measure(self, now_s: float) -> Measurement:
        """The newest readings; the pose by them."""
        right, left = (
            (drive.position_m / radius, drive.reading_time_s)
            for drive, radius in zip(self.drives, self._radii_m, strict=True)
        )
        if math.isfinite(right[1]) and math.isfinite(left[1]):
            self.odometry.update(right, left)
        return self._readings(now_s)

    # --- motions -----------------------------------------------------------------------------------------------

    def motion(self, method: str, params: dict[str, Any], lease: str | None) -> Motion:
        """The motion of ``drive.to``, ``drive.set`` or an ``nxt.*`` method."""
        if method == "drive.to":
            return self._to(params, lease)
        if method == "drive.set":
            law, wanted = DifferentialTwistLaw(self._drive, self.profile.limits), self.set_point(params)
            return DifferentialStream(method, self._names, lease, law, streamed(wanted, params))
        if method == "nxt.goto" and params.get("feedback", True):
            goal = _pose(params, 0.0)
            here = self.odometry.pose
            ahead, aside, yaw = goal.x_m, goal.y_m, here.yaw_rad
            x = here.x_m + ahead * math.cos(yaw) - aside * math.sin(yaw)
            y = here.y_m + ahead * math.sin(yaw) + aside * math.cos(yaw)
            return self._seek(method, [Pose(x, y, yaw + goal.yaw_rad)], params, lease)
        moves = self._moves(method, params)
        if method != "nxt.goto" and params.get("feedback"):
            return self._seek(method, self._ends(moves), params, lease)
        return self._carry_out(method, moves, bool(params.get("compensate")), lease)

    def set_point(self, params: dict[str, Any]) -> SetPoint:
        """Speed and yaw rate that ``drive.set`` asks for. Raises LimitExceeded or Refused."""
        if params.get("direction_deg") or params.get("steering_deg"):
            raise Refused("a robot on two wheels only drives forward and backward, and turns", remedy="give a yaw rate")
        wanted = SetPoint(float(params["speed_m_s"]), math.radians(params.get("yaw_rate_deg_s") or 0.0))
        limits = self.profile.limits
        require_at_most("speed", abs(wanted.forward_m_s), limits.speed_m_s, "m/s", "speed_m_s")
        require_at_most(
            "yaw rate", math.degrees(abs(wanted.yaw_rate_rad_s)), limits.yaw_rate_deg_s, "deg/s", "yaw_rate_deg_s"
        )
        return wanted

    def sticks(self) -> dict[str, Stick]:
        """Speed and yaw rate."""
        limits = self.profile.limits
        return {"speed": both_ways(limits.speed_m_s), "yaw_rate": both_ways(limits.yaw_rate_deg_s)}

    def _to(self, params: dict[str, Any], lease: str | None) -> Motion:
        if params.get("end_vx_m_s") or params.get("end_vy_m_s"):
            raise UsageError("a robot on two wheels comes to rest at its goal", remedy="leave the end velocity out")
        if params.get("planner") == "published":
            raise UsageError("that planner is for omni-wheels", remedy="leave it out")
        goal = _pose(params, math.degrees(self.odometry.pose.yaw_rad))
        return self._seek("drive.to", [goal], params, lease)

    def _seek(self, method: str, goals: Sequence[Pose], params: dict[str, Any], lease: str | None) -> Motion:
        """Under feedback, no faster than asked for and allowed."""
        speed = params.get("speed_m_s")
        limit = self.profile.limits.speed_m_s
        require_at_most("speed", speed or 0.0, limit, "m/s", "speed_m_s")
        reach, longest_m = params.get("tolerance_m") or TOLERANCE_M, _longest_m([self.odometry.pose, *goals])
        require_near(longest_m, self.profile.limits)
        settings = SeekSettings(
            Tolerance(reach, reach, math.radians(params.get("tolerance_deg") or TOLERANCE_DEG)),
            timeout_s=params.get("timeout_s") or TIMEOUT_S + 2 * longest_m / (speed or limit),
            wheel_limit_rad_s=(speed or limit) / self._drive.wheel_radius_m,
            gains=GAINS[params.get("gains") or "slow"],
        )
        return PoseMotion(method, self._names, lease, self._drive, self.odometry, goals, settings)

    def _carry_out(self, method: str, moves: Sequence[Move], compensate: bool, lease: str | None) -> Motion:
        assert self._brick is not None
        return BrickMoves(
            method, self._names, lease, self._drive, self.odometry, self._brick, moves, compensate=compensate
        )

    def _moves(self, method: str, params: dict[str, Any]) -> list[Move]:
        """What a method asks the brick for. Raises LimitExceeded or UsageError."""
        power = float(params.get("power") or self._slow_power())
        self._check_power(power)
        try:
            return _possible(self._wanted(method, params, power))
        except ValueError as error:
            remedy = "moves are as `line 0.5`, `line -0.2`, `bend 0.2 90`, `bend 0.2 90 right back`"
            raise UsageError(f"{method}: {error}", remedy=remedy) from error

    def _wanted(self, method: str, params: dict[str, Any], power: float) -> list[Move]:
        """Moves, one or several. Raises ValueError."""
        if method == "nxt.line":
            return [line(self._drive, float(params["distance_m"]), power)]
        if method == "nxt.bend":
            signed = -power if params.get("backward") else power
            angle = math.radians(params["angle_deg"])
            return [bend(self._drive, float(params["radius_m"]), angle, signed, params.get("side") == "right")]
        if method == "nxt.goto":
            return way_to(self._drive, _pose(params, 0.0), power)
        return [parse_move(self._drive, str(text), power) for text in params["moves"]]

    def _slow_power(self) -> int:
        """Power at the speed that the vehicle may have, rounded down to tens."""
        return max(10, int(self._power_at(self.profile.limits.speed_m_s) // 10 * 10))

    def _power_at(self, speed_m_s: float) -> float:
        return math.degrees(speed_m_s / self._drive.wheel_radius_m) / 10

    def _check_power(self, power: float) -> None:
        most = math.floor(self._power_at(self.profile.limits.wheel_speed_m_s))
        if not 0 < power <= most:
            raise LimitExceeded(
                f"a power of {power:g} is out of range",
                value=power,
                limit=f"1 to {most} (wheel_speed_m_s {self.profile.limits.wheel_speed_m_s:g})",
                remedy=f"give 1 to {most}",
            )

    def _ends(self, moves: Sequence[Move]) -> list[Pose]:
        """Where the moves would end, one after the other."""
        poses, pose = [], self.odometry.pose
        for move in moves:
            pose = self._drive.moved(pose, *(math.radians(leg.angle_deg) for leg in move))
            poses.append(pose)
        return poses

    @property
    def place(self) -> Pose:
        """Where it is by its odometry."""
        return self.odometry.pose

    def wheel_headings(self) -> dict[str, float]:
        """Both wheels roll straight ahead."""
        return dict.fromkeys(self._names, 0.0)

    @property
    def turning_centre(self) -> Point | None:
        """On the wheels' axis, by their speeds."""
        forward_m_s, yaw_rate_rad_s = self._motion
        return centre_of_twist(forward_m_s, 0.0, yaw_rate_rad_s)

    @property
    def _motion(self) -> tuple[float, float]:
        """Speed forward [m/s] and yaw rate [rad/s]."""
        right, left = (drive.speed_m_s for drive in self.drives)
        return (right + left) / 2, (right - left) / 2 / self._drive.half_track_m

    def status(self) -> dict[str, Any]:
        """Odometry and motion."""
        pose = self.odometry.pose
        forward_m_s, yaw_rate_rad_s = self._motion
        return {
            "type": DifferentialGeometry.type,
            "methods": list(self.methods),
            "odometry": place_and_yaw(pose),
            "velocity": {
                "forward_m_s": round(forward_m_s, 4) + 0.0,
                "yaw_rate_deg_s": round(math.degrees(yaw_rate_rad_s), 2) + 0.0,
            },
        }


def _longest_m(poses: Sequence[Pose]) -> float:
    """Distance of those two that are farthest apart of those that follow each other."""
    return max(math.hypot(b.x_m - a.x_m, b.y_m - a.y_m) for a, b in itertools.pairwise(poses))


def _pose(params: dict[str, Any], heading_deg: float) -> Pose:
    given = params.get("heading_deg")
    yaw = math.radians(heading_deg if given is None else given)
    return Pose(float(params["x_m"]), float(params["y_m"]), yaw)


def _possible(moves: list[Move]) -> list[Move]:
    """Moves whose angles the brick can count. Raises ValueError."""
    if not moves:
        raise ValueError("there is no move")
    if any(abs(leg.angle_deg) > FARTHEST_DEG for move in moves for leg in move):
        raise ValueError("a wheel would turn too far")
    return moves


def _brick_wheels(wheels: tuple[Drive, Drive]) -> BrickWheels | None:
    """Both wheels at one brick; None where they are not."""
    right, left = wheels
    if not (isinstance(right, NxtDrive) and isinstance(left, NxtDrive) and right.brick is left.brick):
        return None
    directions = (right.config.direction, left.config.direction)
    return BrickWheels(right.brick, (right.output, left.output), directions)
