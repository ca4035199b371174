"""How fast to drive along a path: slower in bends and before them, beside the path, and on the way to an end."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum

from daemon.loops.motion_profile import approach_speed
from daemon.loops.path import Path
from daemon.loops.path_following import FollowingStep


class SpeedLimit(StrEnum):
    """What the speed of a step is limited by."""

    COMMAND = "commanded_speed"
    CURVATURE = "lateral_acceleration"
    STEERING = "speed_for_steering"
    ERROR = "path_error"
    APPROACH = "approach_to_end"


@dataclass(frozen=True, slots=True)
class SpeedTuning:
    """Limits of the speed along a path.

    Attributes:
        speed_m_s: highest.
        acceleration_m_s2: of all ramps.
        lateral_acceleration_m_s2: in bends.
        backward_m_s: highest when driving backwards, where the steering has to be quick enough for the way.
        position_free_m, heading_free_rad: errors up to which the speed is not lowered; at twice as much it is halved.
        slowest: part of the speed that is left far beside the path.
        end_gain: of the approach to an end [1/s].
        creep_m_s: speed of the last centimetre.
    """

    speed_m_s: float
    acceleration_m_s2: float
    lateral_acceleration_m_s2: float
    backward_m_s: float = math.inf
    position_free_m: float = 0.25
    heading_free_rad: float = math.radians(20)
    slowest: float = 0.4
    end_gain: float = 3.0
    creep_m_s: float = 0.012


class PathSpeed:
    """The speed along one path.

    Args:
        path: to be driven.
        tuning: its limits.
    """

    def __init__(self, path: Path, tuning: SpeedTuning) -> None:
        self._path, self._tuning = path, tuning

    def wanted(self, step: FollowingStep) -> tuple[float, SpeedLimit]:
        """Speed [m/s, not negative] at a point of the path, and what limits it; of equal limits the first one."""
        tuning = self._tuning
        top, reason = tuning.speed_m_s, SpeedLimit.COMMAND
        if step.backward and tuning.backward_m_s < top:
            top, reason = tuning.backward_m_s, SpeedLimit.STEERING
        off = abs(step.errors.position_m) / tuning.position_free_m
        off = max(1.0, off, abs(step.errors.heading_rad) / tuning.heading_free_rad)
        candidates = (
            (top, reason),
            (self._in_bends(step, top), SpeedLimit.CURVATURE),
            (top * max(tuning.slowest, 1 / off), SpeedLimit.ERROR),
            (self._to_end(step.remaining_m), SpeedLimit.APPROACH),
        )
        return min(candidates, key=lambda candidate: candidate[0])

    def _to_end(self, remaining_m: float) -> float:
        tuning = self._tuning
        approach = approach_speed(max(0.0, remaining_m), tuning.end_gain, tuning.acceleration_m_s2)
        return max(tuning.creep_m_s, approach)

    def _in_bends(self, step: FollowingStep, top: float) -> float:
        """What bends allow: that of the piece, and those ahead within the way that braking needs."""
        tuning, path = self._tuning, self._path
        last = path.section_end(step.meeting.piece)
        speed, ahead_m = top, 0.0
        for number in range(step.meeting.piece, last + 1):
            piece = path.pieces[number]
            curvature = abs(piece.curvature)
            if curvature:
                allowed = tuning.lateral_acceleration_m_s2 / curvature + 2 * tuning.acceleration_m_s2 * ahead_m
                speed = min(speed, math.sqrt(allowed))
            ahead_m += piece.length_m - (step.meeting.along_m if number == step.meeting.piece else 0.0)
            if 2 * tuning.acceleration_m_s2 * ahead_m > top * top:
                break
        return speed
