"""A path in pieces: what a robot with paired steering drives, stops after, steers for, and drives on."""

from __future__ import annotations

import math
from typing import Any, Protocol

from canhelm.errors import DeviceFault, Refused
from daemon.loops.measurement import Command, Measurement
from daemon.loops.odometry import Odometry
from daemon.loops.paired_steer import PairedSteerLaw
from daemon.loops.paired_steer_piece import DrivenPiece, aimed, target_of
from daemon.loops.paired_steer_target import PairedSteerTarget
from daemon.loops.path import Path, Point, wrap
from daemon.loops.path_in_pieces import distance
from daemon.runtime.following import NO_LIMITS, Following
from daemon.runtime.paired_steer_motions import PairedSteerMotion
from daemon.runtime.path_commands import PathPlan
from daemon.runtime.poses import place_and_heading
from profiles.schema import Limits, PairedSteerGeometry

AT_BEGIN_M = 0.05
"""The robot is at the path's beginning when it is nearer than this."""
SHORTEST_M = 0.005
"""A way that is shorter is not worth steering for."""


class Robot(Protocol):
    """What the plan needs of the vehicle."""

    geometry: PairedSteerGeometry
    limits: Limits
    names: tuple[str, ...]
    odometry: Odometry

    def new_law(self) -> PairedSteerLaw:
        """A law at rest, for one motion."""
        ...


class PiecesPlan(PathPlan):
    """The pieces that were chosen.

    Args:
        robot: that shall drive them.
        path: to be followed.
        speed_m_s: no faster than.

    Attributes:
        way: the path.
        pieces: in the order of travel.
    """

    def __init__(self, robot: Robot, path: Path, speed_m_s: float) -> None:
        self.way = path
        self.pieces: list[DrivenPiece] = []
        self._robot, self._speed_m_s = robot, speed_m_s
        self._told: list[dict[str, Any]] = []

    def add(self, piece: DrivenPiece) -> None:
        """One more piece, in the order of travel."""
        self.pieces.append(piece)
        target = target_of(self._robot.geometry, self._robot.limits, piece, self._speed_m_s)
        entries = [self.way.told(piece.first), self.way.told(piece.last)]
        self._told.append({"path_pieces": entries, **_told(piece, target)})

    def summary(self) -> dict[str, Any]:
        """Number and largest deviation, and each piece with its own."""
        return {
            "stops": len(self.pieces) - 1,
            "length_m": round(sum(one.piece.length_m for one in self.pieces), 4),
            "deviation_m": round(max(one.deviation_m for one in self.pieces), 4),
            "pieces": self._told,
        }

    def require_begin(self) -> None:
        """Raise Refused where the robot is not at the path's beginning."""
        pose, (x, y) = self._robot.odometry.pose, self.way.pieces[0].point(0.0)
        away = math.hypot(pose.x_m - x, pose.y_m - y)
        if away > AT_BEGIN_M:
            raise Refused(
                f"the path begins {away:.2f} m from the robot",
                value=round(away, 3),
                limit=f"{AT_BEGIN_M:g} m",
                remedy="leave start: out of the path file, or drive to its beginning first",
            )

    def motion(self, lease: str | None) -> PathInPieces:
        """The motion."""
        return PathInPieces(lease, self._robot, self.way, self.pieces, self._speed_m_s, self.summary())


def _told(one: DrivenPiece, target: PairedSteerTarget) -> dict[str, Any]:
    assert target.rear_heading_rad is not None
    assert target.front_heading_rad is not None
    bend = one.piece.curvature
    return {
        "kind": "arc" if bend else "line",
        "length_m": round(one.piece.length_m, 4),
        "radius_m": round(1 / bend, 4) if bend else None,
        "rear_deg": round(math.degrees(target.rear_heading_rad), 2),
        "front_deg": round(math.degrees(target.front_heading_rad), 2),
        "speed_m_s": round(target.speed_m_s, 3),
        "deviation_m": round(one.deviation_m, 4),
    }


class PathInPieces(PairedSteerMotion):
    """Piece after piece, each from where the robot really is to where the planned one ends.

    Args:
        robot: the vehicle.
        path: to be followed.
        pieces: of the plan.
        speed_m_s: no faster than.
        summary: of the plan.

    Attributes:
        path: to be followed.
        number: of the piece under way, from 0.
        driven_m: largest distance of the robot's centre from the path so far, by odometry, piece by piece.
    """

    path: Path

    def __init__(
        self,
        lease: str | None,
        robot: Robot,
        path: Path,
        pieces: list[DrivenPiece],
        speed_m_s: float,
        summary: dict[str, Any],
    ) -> None:
        super().__init__("drive.path", robot.names, lease, robot.new_law(), None)
        self._robot, self.path, self._pieces, self._speed_m_s = robot, path, pieces, speed_m_s
        self._summary = summary
        self._way, self._nearest = path.pieces, pieces[0].first
        self.number = 0
        self.driven_m = [0.0] * len(pieces)
        self._go_on(0)

    def step(self, measurement: Measurement, dt_s: float) -> Command:
        """One step of the law for the piece under way."""
        self._measure()
        return super().step(measurement, dt_s)

    def _measure(self) -> None:
        point, planned = self._place, self._pieces[self.number]
        numbers = range(planned.first, planned.last + 1)
        self._nearest = min(numbers, key=lambda number: distance(self._way[number], point))
        off = distance(self._way[self._nearest], point)
        self.driven_m[self.number] = max(self.driven_m[self.number], off)

    @property
    def _place(self) -> Point:
        pose = self._robot.odometry.pose
        return (pose.x_m, pose.y_m)

    def following(self) -> Following | None:
        """Distance from the path, and the yaw against that of the planned piece; nothing ends the motion by them."""
        piece, planned = self._way[self._nearest], self._pieces[self.number]
        along, offset = piece.project(*self._place, piece.length_m / 2)
        way = planned.piece.project(*self._place, planned.piece.length_m / 2)[0]
        turned = self._robot.odometry.pose.yaw_rad - planned.yaw_rad - planned.piece.curvature * way
        return Following(
            self.path.way_to(self._nearest, min(max(along, 0.0), piece.length_m)),
            self.path.length_m,
            math.copysign(distance(piece, self._place), -offset if piece.backward else offset),
            wrap(turned),
            None,
            piece.backward,
            NO_LIMITS,
        )

    def on_done(self, now_s: float) -> None:
        """A piece is over: go on with the next one that is a way at all, or end."""
        if self.stop_reason or not self._go_on(self.number + 1):
            super().on_done(now_s)

    def _go_on(self, number: int) -> bool:
        """Steer for the first piece from ``number`` on that is a way at all; False where there is none."""
        for index in range(number, len(self._pieces)):
            self.number = index
            target = self._aimed()
            if target is None or target.distance_m is None or target.distance_m >= SHORTEST_M:
                self._target = target
                return True
        return False

    def _aimed(self) -> PairedSteerTarget | None:
        """The motion for the piece under way, from where the robot is; without one it has failed."""
        robot = self._robot
        piece = aimed(robot.geometry, robot.limits, self._pieces[self.number], robot.odometry.pose)
        if piece is None:
            message = f"piece {self.number} of the way cannot be steered from where the robot is"
            remedy = "drive from here by a new path, more slowly; `canhelm status` shows the odometry"
            self.fail(DeviceFault(f"{self.kind}: {message}", remedy=remedy))
            return None
        return target_of(robot.geometry, robot.limits, piece, self._speed_m_s)

    def _result(self, now_s: float) -> dict[str, Any]:
        pose, end = self._robot.odometry.pose, self._pieces[-1].end
        told = [
            {**piece, "driven_deviation_m": round(off, 4)}
            for piece, off in zip(self._summary["pieces"], self.driven_m, strict=True)
        ]
        return {
            **self._summary,
            "driven_deviation_m": round(max(self.driven_m), 4),
            **place_and_heading(pose),
            "error_m": round(math.hypot(pose.x_m - end.x_m, pose.y_m - end.y_m), 4),
            "duration_s": round(now_s - self.begun_s, 3),
            "pieces": told,
        }

    def progress(self) -> dict[str, Any]:
        """As of any motion, and which piece, and the largest distance from the path so far."""
        number = f"{self.number + 1} of {len(self._pieces)}"
        return {**super().progress(), "piece": number, "driven_deviation_m": round(max(self.driven_m), 4)}
