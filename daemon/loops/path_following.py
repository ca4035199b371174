"""The semi-trailer thesis' path following (chapter 3): an auxiliary circle to a target point ahead on the path.

From the point of the path that the vehicle is at, the target lies a look-ahead further along. The circle through the
target that is tangential to the reference unit gives a curvature: forwards the truck's, steered directly; backwards
the trailer's, for which a bending angle is set that a proportional law holds. :class:`PathFollower` does it with the
formulas put right, or as they are printed (docs/semitrailer.md).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum

from daemon.loops.articulated import ArticulatedVehicle, Hitch
from daemon.loops.geometry import clamp
from daemon.loops.odometry import Pose
from daemon.loops.path import STRAIGHT, Meeting, Path, Piece, Point, wrap


@dataclass(frozen=True, slots=True)
class FollowingTuning:
    """The two parameters of the thesis (section 6.1).

    Attributes:
        look_ahead_m: c_v, way along the path from the meeting point to the target.
        bending_gain: c_p, steering angle per deviation of the bending angle.
    """

    look_ahead_m: float = 0.425
    bending_gain: float = 4.0


class Limit(StrEnum):
    """What kept a law from commanding what it wanted."""

    CURVATURE = "curvature"
    """Of the reference unit's way back to the path."""
    BENDING = "bending"
    """The bending angle that it may have while driving backwards."""
    STEERING = "steering"
    """The steering angle."""


@dataclass(frozen=True, slots=True)
class FollowingErrors:
    """How the vehicle stands to the path at the meeting point (section 6.1), all positive to the left.

    Attributes:
        position_m: of the reference point, from the path.
        heading_rad: of the reference unit, against the path's.
        bending_rad: against that of stable motion on the path; None without a trailer or when there is none.
    """

    position_m: float
    heading_rad: float
    bending_rad: float | None


@dataclass(frozen=True, slots=True)
class FollowingStep:
    """Terms and result of one step.

    Attributes:
        meeting: where on the path the vehicle is.
        remaining_m: way to the end of the section; negative beyond it.
        backward: driving direction.
        errors: against the path.
        target: the point headed for; None in a law that has none.
        heading_target_rad: the heading's error that is wanted for now; None in a law that has none.
        curvature: that the reference unit shall drive, positive with its centre to the left of the heading [1/m].
        bending_target_rad: for driving backwards with a trailer, else None.
        wanted_steering_rad: before the limit.
        steering_rad: the command.
        limit: that changed the command, if any; of several the last in the chain.
    """

    meeting: Meeting
    remaining_m: float
    backward: bool
    errors: FollowingErrors
    target: Point | None
    heading_target_rad: float | None
    curvature: float
    bending_target_rad: float | None
    wanted_steering_rad: float
    steering_rad: float
    limit: Limit | None


def circle_curvature(pose: Pose, target: Point) -> float:
    """Signed curvature of the circle through ``target``, tangential to the heading at ``pose`` (eq. 3.6).

    Twice the target's distance to the left over its squared distance; 0 when the target is where the vehicle is.
    """
    dx, dy = target[0] - pose.x_m, target[1] - pose.y_m
    squared = dx * dx + dy * dy
    left = dy * math.cos(pose.yaw_rad) - dx * math.sin(pose.yaw_rad)
    return 2 * left / squared if squared else 0.0


def published_circle_curvature(pose: Pose, target: Point) -> float:
    """The curvature as printed (eq. 3.6): with the difference of the points reversed, which turns its sign."""
    return -circle_curvature(pose, target)


def published_target(piece: Piece, along_m: float, look_ahead_m: float) -> Point:
    """The target point as printed (eq. 3.2, 3.4): on a circle turned by a matrix with a wrong sign."""
    if abs(piece.curvature) < STRAIGHT:
        return piece.point(along_m + look_ahead_m)
    cx, cy = piece.centre()
    x, y = piece.point(along_m)
    angle = look_ahead_m * abs(piece.curvature)
    cos, sin = math.cos(angle), math.sin(angle)
    return (cx + cos * (x - cx) - sin * (y - cy), cy + sin * (x - cx) - cos * (y - cy))


def bending_law(vehicle: ArticulatedVehicle, gain: float, target_rad: float, bending_rad: float) -> float:
    """Steering angle that brings the bending angle to a target when driving backwards (eq. 3.9, 3.10), not limited."""
    holding = vehicle.steering(vehicle.hitches[0].holding_curvature(bending_rad))
    return gain * (target_rad - bending_rad) + holding


def reversing_hitch(vehicle: ArticulatedVehicle) -> Hitch | None:
    """The hitch of the one trailer that the laws can steer backwards; None for a truck alone.

    Raises:
        ValueError: there are more trailers, or the hitch is further from its axle than the trailer is long.
    """
    if not vehicle.hitches:
        return None
    hitch = vehicle.hitches[0]
    if len(vehicle.hitches) > 1 or hitch.offset_m >= hitch.length_m:
        raise ValueError("only one trailer, longer than its hitch's offset, can be steered backwards")
    return hitch


def errors_on(piece: Piece, meeting: Meeting, pose: Pose, bending_rad: float, hitch: Hitch | None) -> FollowingErrors:
    """Position, heading and bending angle against those on the path."""
    stable = None
    if hitch is not None:
        curvature = piece.heading_curvature
        stable = hitch.bending_for(curvature) if piece.backward else hitch.stable_bending(curvature)
    return FollowingErrors(
        -meeting.offset_m if piece.backward else meeting.offset_m,
        wrap(pose.yaw_rad - piece.heading(meeting.along_m)),
        None if stable is None else wrap(bending_rad - stable),
    )


class SectionFollower:
    """Where on a path the vehicle is: one section after the other.

    Attributes:
        section: the one being followed.
    """

    def __init__(self, vehicle: ArticulatedVehicle, path: Path) -> None:
        """Begin at the path's first piece.

        Raises:
            ValueError: the vehicle's trailers cannot be steered backwards.
        """
        self._vehicle, self._path = vehicle, path
        self._hitch = reversing_hitch(vehicle)
        self.section = 0
        self._meeting = Meeting(0, 0.0, 0.0)

    def next_section(self) -> bool:
        """Go on to the next section, once the vehicle rests at the end of this one; False after the last."""
        if self.section + 1 == len(self._path.sections):
            return False
        self.section += 1
        self._meeting = Meeting(self._path.sections[self.section][0], 0.0, 0.0)
        return True

    def _meet(self, pose: Pose, bending_rad: float) -> Meeting:
        if not math.isfinite(pose.x_m + pose.y_m + pose.yaw_rad + bending_rad):
            raise ValueError(f"no steering for a pose {pose} and a bending angle of {bending_rad} rad")
        self._meeting = self._path.meet(self.section, self._meeting, pose.x_m, pose.y_m)
        return self._meeting

    def _commanded(
        self,
        errors: FollowingErrors,
        curvature: float,
        wanted_steering_rad: float,
        *,
        target: Point | None = None,
        heading_target_rad: float | None = None,
        bending_target_rad: float | None = None,
        limit: Limit | None = None,
    ) -> FollowingStep:
        """The step at the meeting point, its steering limited."""
        meeting = self._meeting
        steering = clamp(wanted_steering_rad, self._vehicle.max_steering_rad)
        return FollowingStep(
            meeting=meeting,
            remaining_m=self._path.remaining(self.section, meeting.piece, meeting.along_m),
            backward=self._path.pieces[meeting.piece].backward,
            errors=errors,
            target=target,
            heading_target_rad=heading_target_rad,
            curvature=curvature,
            bending_target_rad=bending_target_rad,
            wanted_steering_rad=wanted_steering_rad,
            steering_rad=steering,
            limit=limit if steering == wanted_steering_rad else Limit.STEERING,
        )


class PathFollower(SectionFollower):
    """The law of the thesis."""

    def __init__(
        self, vehicle: ArticulatedVehicle, path: Path, tuning: FollowingTuning, published: bool = False
    ) -> None:
        """Begin at the path's first piece.

        Args:
            vehicle: with at most one trailer.
            path: of the reference points: forwards the truck's rear axle, backwards the last axle.
            tuning: look-ahead and gain.
            published: with the formulas as printed, which do not hold a vehicle on a path.

        Raises:
            ValueError: the vehicle's trailers cannot be steered backwards.
        """
        super().__init__(vehicle, path)
        self._tuning, self._published = tuning, published

    def step(self, pose: Pose, bending_rad: float, look_ahead_m: float | None = None) -> FollowingStep:
        """One steering command.

        Args:
            pose: of the reference unit: driving forwards the truck's, backwards the trailer's.
            bending_rad: measured; without meaning for a truck alone.
            look_ahead_m: of this step; None: that of the tuning.

        Raises:
            ValueError: a number is not finite.
        """
        meeting = self._meet(pose, bending_rad)
        piece = self._path.pieces[meeting.piece]
        target = self._target(piece, meeting, self._tuning.look_ahead_m if look_ahead_m is None else look_ahead_m)
        curvature = published_circle_curvature(pose, target) if self._published else circle_curvature(pose, target)
        bending_target = None
        if piece.backward and self._hitch is not None:
            bending_target = self._hitch.bending_for(curvature)
            wanted = bending_law(self._vehicle, self._tuning.bending_gain, bending_target, bending_rad)
        else:
            wanted = self._vehicle.steering(curvature)
        errors = errors_on(piece, meeting, pose, bending_rad, self._hitch)
        return self._commanded(errors, curvature, wanted, target=target, bending_target_rad=bending_target)

    def _target(self, piece: Piece, meeting: Meeting, look_ahead_m: float) -> Point:
        if self._published:
            return published_target(piece, meeting.along_m, look_ahead_m)
        ahead, along = self._path.ahead(self.section, meeting.piece, meeting.along_m + look_ahead_m)
        return ahead.point(along)
