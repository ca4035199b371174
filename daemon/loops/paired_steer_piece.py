"""What a robot with paired steering can drive in one go: a line at any angle, or an arc of fixed steering.

The centre of the arc is the point that both pairs' axles point to. With u(p) the direction of a pair's heading p, b the
contact lead and c the centre in the robot's frame (MAX2D thesis, section 4.2, solved for the headings)::

    (c + (l/2, 0)) . u(rear) = -b        (c - (l/2, 0)) . u(front) = b
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

from daemon.loops.geometry import TurningSolution, solve_turning
from daemon.loops.odometry import Pose
from daemon.loops.paired_steer_target import PairedSteerTarget
from daemon.loops.path import STRAIGHT, Piece, Point, line, wrap
from profiles.schema import Limits, PairedSteerGeometry

MAX_MISMATCH_RAD: Final = math.radians(12)
"""Between a wheel's motion and its heading; beyond it the driven arc is not the computed one."""


@dataclass(frozen=True, slots=True)
class Steered:
    """Headings for a motion.

    Attributes:
        rear_rad, front_rad: headings of the pairs.
        sense: 1 when the wheels roll forward, -1 backward.
        motion: at 1 m/s.
    """

    rear_rad: float
    front_rad: float
    sense: int
    motion: TurningSolution


@dataclass(frozen=True, slots=True)
class DrivenPiece:
    """One piece of the way, between two stops.

    Attributes:
        piece: way of the robot's centre.
        yaw_rad: of the robot at its beginning.
        first, last: pieces of the path that it stands for.
        deviation_m: largest distance of these from it.
    """

    piece: Piece
    yaw_rad: float
    first: int
    last: int
    deviation_m: float

    @property
    def end(self) -> Pose:
        """Pose of the robot at the end."""
        piece = self.piece
        x, y = piece.point(piece.length_m)
        return Pose(x, y, self.yaw_rad + piece.curvature * piece.length_m)


def steered(
    geometry: PairedSteerGeometry, limits: Limits, direction_rad: float, curvature: float, spare_rad: float = 0.0
) -> Steered | None:
    """Headings that move the robot's centre in a direction of its frame, on a line or circle; None where none do.

    Args:
        geometry: the robot.
        limits: of the vehicle.
        direction_rad: of travel, any.
        curvature: positive bends to the left of travel [1/m]; 0 is a line.
        spare_rad: to leave to the limits of headings and mismatch.
    """
    direction = wrap(direction_rad)
    headings = _folded(direction) if abs(curvature) < STRAIGHT else _to_centre(geometry, direction, curvature)
    if headings is None or max(map(abs, headings)) > math.radians(limits.heading_deg) - spare_rad:
        return None
    motion = solve_turning(geometry, *headings, 1.0)
    if max(map(abs, motion.mismatch_rad)) > MAX_MISMATCH_RAD - spare_rad:
        return None
    sense = 1 if math.cos(direction - sum(headings) / 2) > 0 else -1
    return Steered(*headings, sense, motion)


def _folded(direction: float) -> tuple[float, float]:
    """Both headings along a line, within a quarter turn."""
    heading = math.remainder(direction, math.pi)
    return heading, heading


def _to_centre(geometry: PairedSteerGeometry, direction: float, curvature: float) -> tuple[float, float] | None:
    """Headings across the lines to the centre of a circle; None where the centre is too near to a pair."""
    x, y = -math.sin(direction) / curvature, math.cos(direction) / curvature
    half, lead = geometry.wheelbase_m / 2, geometry.contact_lead_m
    headings = []
    for ahead, way in ((x + half, -lead), (x - half, lead)):
        far = math.hypot(ahead, y)
        if far <= abs(way):
            return None
        across, bearing = math.acos(way / far), math.atan2(y, ahead)
        headings.append(min(wrap(bearing - across), wrap(bearing + across), key=abs))
    rear, front = headings
    return rear, front


def bow(begin: Point, end: Point, sweep_rad: float) -> Piece:
    """The arc between two points on which the direction turns by ``sweep_rad``; a line where it does not turn."""
    chord = line(begin, end)
    half = sweep_rad / 2
    if abs(half) * chord.length_m < STRAIGHT:
        return chord
    length = chord.length_m * half / math.sin(half)
    return Piece(*begin, chord.direction_rad - half, length, sweep_rad / length)


def aimed(geometry: PairedSteerGeometry, limits: Limits, planned: DrivenPiece, pose: Pose) -> DrivenPiece | None:
    """A piece from where the robot really is to where the planned one ends; None where that cannot be steered.

    An arc takes back an error of yaw, too, if it can.
    """
    begin, end = (pose.x_m, pose.y_m), planned.end
    turn = planned.piece.curvature * planned.piece.length_m
    for sweep in (wrap(end.yaw_rad - pose.yaw_rad), turn) if turn else (0.0,):
        piece = bow(begin, (end.x_m, end.y_m), sweep)
        if steered(geometry, limits, piece.direction_rad - pose.yaw_rad, piece.curvature) is not None:
            return DrivenPiece(piece, pose.yaw_rad, planned.first, planned.last, planned.deviation_m)
    return None


def target_of(
    geometry: PairedSteerGeometry, limits: Limits, driven: DrivenPiece, speed_m_s: float
) -> PairedSteerTarget:
    """The motion that drives a piece which can be steered, no faster than the wheels may."""
    piece = driven.piece
    headings = steered(geometry, limits, piece.direction_rad - driven.yaw_rad, piece.curvature)
    assert headings is not None
    fastest = max(1.0, *map(abs, headings.motion.roll_speed_m_s))
    speed = min(speed_m_s, limits.speed_m_s, limits.wheel_speed_m_s / fastest)
    return PairedSteerTarget(headings.rear_rad, headings.front_rad, headings.sense * speed, piece.length_m)
