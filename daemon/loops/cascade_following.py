"""A cascade that follows a path: position -> heading -> curvature -> bending angle -> steering angle.

The position's error asks for a heading towards the path, by a profile that is proportional when near and an arc when
far. The heading's error asks for a curvature of the reference unit, fed forward with that of the path and of the
profile. Driving backwards with a trailer, stable motion at that curvature gives a bending angle. It is approached no
faster than the steering can follow: half the square of its rate over the deceleration that the steering's own rate
allows must fit into what is left. Errors and bending angle are taken a little ahead in time, as far as the steering
as it is now will take them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final, NamedTuple

from daemon.loops.articulated import ArticulatedVehicle, Hitch
from daemon.loops.geometry import clamp
from daemon.loops.motion_profile import approach_speed
from daemon.loops.odometry import Pose
from daemon.loops.path import Path
from daemon.loops.path_following import FollowingStep, Limit, SectionFollower, errors_on

_NEAREST_TO_CENTRE: Final = 0.2
"""Part of an arc's radius; nearer to its centre, the feed-forward does not grow any more."""
_LEAD_STEPS: Final = 2


@dataclass(frozen=True, slots=True)
class CascadeTuning:
    """Gains and limits. The defaults suit the thesis' model vehicle; lengths scale with the trailer.

    Attributes:
        position_gain: heading for a small error of position [rad/m].
        approach_curvature: of the arc by which the heading is taken back on the way to the path [1/m].
        max_approach_rad: the steepest heading towards the path.
        sharpness: how abruptly the heading reaches it.
        heading_gain: curvature for an error of heading [1/m per rad].
        max_curvature: of the reference unit [1/m].
        max_bending_rad: the largest bending angle that is asked for.
        bending_gain: rate of the bending angle over the way for its error [1/m].
        rate_share: part of the steering's rate that approaching a bending angle may use.
        lead_s: time by which errors are taken ahead.
        preview_m: way by which the path's curvature is fed forward earlier, backwards with a trailer: about half of
            what the bending angle needs to follow.
    """

    position_gain: float = 6.83
    approach_curvature: float = 0.635
    max_approach_rad: float = 0.303
    sharpness: float = 11.3
    heading_gain: float = 3.21
    max_curvature: float = 5.0
    max_bending_rad: float = 1.2
    bending_gain: float = 13.4
    rate_share: float = 0.7
    lead_s: float = 0.22
    preview_m: float = 0.13


class _Errors(NamedTuple):
    """Errors of position and heading, and the bending angle."""

    position_m: float
    heading_rad: float
    bending_rad: float


class CascadeFollower(SectionFollower):
    """The cascade."""

    def __init__(
        self, vehicle: ArticulatedVehicle, path: Path, tuning: CascadeTuning, steering_rate_rad_s: float = math.inf
    ) -> None:
        """Begin at the path's first piece.

        Args:
            vehicle: with at most one trailer.
            path: of the reference points: forwards the truck's rear axle, backwards the last axle.
            tuning: gains and limits.
            steering_rate_rad_s: how fast the steering turns.

        Raises:
            ValueError: the vehicle's trailers cannot be steered backwards.
        """
        super().__init__(vehicle, path)
        self._tuning, self._rate = tuning, steering_rate_rad_s

    def step(self, pose: Pose, bending_rad: float, steering_rad: float, speed_m_s: float) -> FollowingStep:
        """One steering command.

        Args:
            pose: of the reference unit: driving forwards the truck's, backwards the trailer's.
            bending_rad: measured; without meaning for a truck alone.
            steering_rad: the steering angle now.
            speed_m_s: of the truck's rear axle; its sign does not matter.

        Raises:
            ValueError: a number is not finite.
        """
        meeting = self._meet(pose, bending_rad)
        piece = self._path.pieces[meeting.piece]
        errors = errors_on(piece, meeting, pose, bending_rad, self._hitch)
        lead_m = abs(speed_m_s) * self._tuning.lead_s
        hitch = self._hitch if piece.backward else None
        preview_m = 0.0 if hitch is None else self._tuning.preview_m
        ahead, _ = self._path.ahead(self.section, meeting.piece, meeting.along_m + lead_m + preview_m)
        path_curvature = ahead.heading_curvature
        now = _Errors(errors.position_m, errors.heading_rad, bending_rad)
        moved = _taken_ahead(now, hitch, self._vehicle.curvature(steering_rad), path_curvature, lead_m, piece.backward)
        heading, wanted = self._curvature(moved, path_curvature, piece.backward)
        curvature = clamp(wanted, self._tuning.max_curvature)
        limit = None if curvature == wanted else Limit.CURVATURE
        bending, truck_curvature = None, curvature
        if hitch is not None:
            stable = hitch.bending_for(curvature)
            bending = clamp(stable, self._tuning.max_bending_rad)
            limit = limit if bending == stable else Limit.BENDING
            truck_curvature = self._bending_law(hitch, moved.bending_rad, bending, abs(speed_m_s))
        steering = self._vehicle.steering(truck_curvature)
        return self._commanded(
            errors, curvature, steering, heading_target_rad=heading, bending_target_rad=bending, limit=limit
        )

    def _curvature(self, errors: _Errors, path_curvature: float, backward: bool) -> tuple[float, float]:
        """The heading towards the path, and the curvature that brings the reference unit to it."""
        tuning = self._tuning
        sense = -1.0 if backward else 1.0
        size, slope = self._approach(abs(errors.position_m))
        heading = -sense * math.copysign(size, errors.position_m)
        room = max(_NEAREST_TO_CENTRE, 1 - path_curvature * errors.position_m)
        along = path_curvature * math.cos(errors.heading_rad) / room
        back = tuning.heading_gain * (errors.heading_rad - heading) + slope * math.sin(errors.heading_rad)
        return heading, along - sense * back

    def _approach(self, distance_m: float) -> tuple[float, float]:
        """The heading towards the path at a distance, and its slope over the distance."""
        tuning = self._tuning
        free = approach_speed(distance_m, tuning.position_gain, tuning.approach_curvature)
        near = distance_m * tuning.position_gain**2 <= tuning.approach_curvature
        slope = tuning.position_gain if near else tuning.approach_curvature / free
        soft = 1 + (free / tuning.max_approach_rad) ** tuning.sharpness
        scale = soft ** (-1 / tuning.sharpness)
        return free * scale, slope * scale / soft

    def _bending_law(self, hitch: Hitch, bending: float, target: float, speed_m_s: float) -> float:
        """Curvature of the truck that takes the bending angle to its target, as fast as the steering can follow."""
        error = bending - target
        gain = self._tuning.bending_gain
        way_rate = self._rate / speed_m_s if speed_m_s else math.inf
        deceleration = self._tuning.rate_share * way_rate / self._vehicle.wheelbase_m
        approach = math.copysign(approach_speed(abs(error), gain, deceleration), error)
        effect = 1 + hitch.offset_m * math.cos(bending) / hitch.length_m
        return -(approach + math.sin(bending) / hitch.length_m) / effect


def _taken_ahead(
    errors: _Errors, hitch: Hitch | None, curvature: float, path_curvature: float, lead_m: float, backward: bool
) -> _Errors:
    """Errors and bending angle after the truck's way ``lead_m`` with its curvature as it is."""
    way = (-lead_m if backward else lead_m) / _LEAD_STEPS
    position, heading, bending = errors
    for _ in range(_LEAD_STEPS):
        ratio, turning = 1.0, curvature
        if hitch is not None:
            ratio = hitch.speed_ratio(curvature, bending)
            turning = curvature + hitch.bending_rate(curvature, bending)
            bending += way * (turning - curvature)
        room = max(_NEAREST_TO_CENTRE, 1 - path_curvature * position)
        along = path_curvature * math.cos(heading) / room * ratio
        position, heading = position + way * ratio * math.sin(heading), heading + way * (turning - along)
    return _Errors(position, heading, bending)
