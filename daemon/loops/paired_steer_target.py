"""What a paired-steer robot can be asked to do, and what it is refused."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

from canhelm.errors import LimitExceeded, UsageError
from daemon.loops.geometry import PAIR_NAMES, TurningSolution, solve_turning
from profiles.schema import Limits, PairedSteerGeometry

SINGLE_CENTRE_LIMIT_RAD: Final = 0.45
"""Above it, with both pairs turned for one curve, the wheels are more than 12 degrees off their headings."""
_ROUNDING: Final = 1e-9


@dataclass(frozen=True, slots=True)
class PairedSteerTarget:
    """A motion: headings of the pairs, speed of the centre and how far.

    A target is one motion: the law starts a motion whenever it is given another object.

    Attributes:
        rear_heading_rad: heading of the rear pair; None keeps it, for turning one pair only.
        front_heading_rad: heading of the front pair, likewise.
        speed_m_s: speed of the robot's centre, negative for backward.
        distance_m: way of the centre; 0 only steers; None drives until there is another target.
    """

    rear_heading_rad: float | None
    front_heading_rad: float | None
    speed_m_s: float
    distance_m: float | None

    @property
    def headings_rad(self) -> tuple[float | None, float | None]:
        """Headings in the order of the pairs."""
        return (self.rear_heading_rad, self.front_heading_rad)

    @property
    def moves(self) -> bool:
        """True when the wheels shall roll."""
        return self.speed_m_s != 0 and self.distance_m != 0


def parallel_target(heading_rad: float, speed_m_s: float, duration_s: float) -> PairedSteerTarget:
    """Parallel movement (MAX2D thesis, section 4.1): ``speed * duration`` far, ramps included in the way."""
    return PairedSteerTarget(heading_rad, heading_rad, speed_m_s, abs(speed_m_s) * duration_s)


def turn_target(
    rear_heading_rad: float, front_heading_rad: float, speed_m_s: float, duration_s: float
) -> PairedSteerTarget:
    """Turning with a radius of curvature (MAX2D thesis, section 4.2): an arc ``speed * duration`` long."""
    return PairedSteerTarget(rear_heading_rad, front_heading_rad, speed_m_s, abs(speed_m_s) * duration_s)


def steer_target(pair: int, heading_rad: float) -> PairedSteerTarget:
    """Turn one pair (0 rear, 1 front), keep the other, drive nowhere."""
    rear, front = (heading_rad, None) if pair == 0 else (None, heading_rad)
    return PairedSteerTarget(rear, front, 0.0, 0.0)


def direction_target(direction_rad: float, speed_m_s: float, steering_rad: float = 0.0) -> PairedSteerTarget:
    """Drive on in a direction of the robot's frame, backward for directions behind: all wheels parallel, or on an arc.

    Args:
        direction_rad: where to.
        speed_m_s: of the centre.
        steering_rad: by which the front pair turns from there, and the rear pair the other way.
    """
    heading = math.remainder(direction_rad, math.tau)
    if abs(heading) > math.pi / 2:
        heading, speed_m_s = heading - math.copysign(math.pi, heading), -speed_m_s
    return PairedSteerTarget(heading - steering_rad, heading + steering_rad, speed_m_s, None)


def why_not_rotate() -> str:
    """Why a paired-steer robot cannot turn about its own centre (MAX2D thesis, chapter 4, figure 4.3)."""
    return (
        "this robot cannot rotate about its own centre: the two wheels of a pair are coupled and always parallel, "
        "so they cannot both stand across the line to the centre; drive a turn instead"
    )


def check_target(geometry: PairedSteerGeometry, limits: Limits, target: PairedSteerTarget) -> None:
    """Refuse a target that lies outside the vehicle's limits.

    Raises:
        UsageError: a number is not finite, the distance is negative, or a heading is missing although it shall drive.
        LimitExceeded: a heading, the speed, or the speed of a wheel; the error names the limit and what would do.
    """
    _check_sense(target)
    for name, heading in zip(PAIR_NAMES, target.headings_rad, strict=True):
        if heading is not None:
            _check_heading(geometry, limits, name, heading)
    check_speed(limits, target.speed_m_s)
    if target.moves and target.rear_heading_rad is not None and target.front_heading_rad is not None:
        solution = solve_turning(geometry, target.rear_heading_rad, target.front_heading_rad, target.speed_m_s)
        _check_wheels(limits, target.speed_m_s, solution)


def check_speed(limits: Limits, speed_m_s: float) -> None:
    """Raise LimitExceeded for a speed that is beyond the vehicle's."""
    if abs(speed_m_s) > limits.speed_m_s * (1 + _ROUNDING):
        raise LimitExceeded(
            f"a speed of {speed_m_s:g} m/s is beyond the vehicle's limit",
            value=speed_m_s,
            limit=f"speed_m_s {limits.speed_m_s:g}",
            remedy=f"ask for at most {limits.speed_m_s:g} m/s",
        )


def _check_sense(target: PairedSteerTarget) -> None:
    numbers = (*target.headings_rad, target.speed_m_s, target.distance_m)
    if not all(math.isfinite(number) for number in numbers if number is not None):
        raise UsageError("a heading, speed or distance is not a finite number", remedy="give finite numbers")
    if target.distance_m is not None and target.distance_m < 0:
        raise UsageError(
            f"a distance of {target.distance_m:g} m is negative",
            value=target.distance_m,
            remedy="give a positive distance or duration; a negative speed drives backward",
        )
    if target.moves and None in target.headings_rad:
        raise UsageError("driving needs the headings of both pairs", remedy="give the rear and the front heading")


def _check_heading(geometry: PairedSteerGeometry, limits: Limits, name: str, heading_rad: float) -> None:
    heading_deg = math.degrees(heading_rad)
    if abs(heading_deg) > limits.heading_deg + _ROUNDING:
        raise LimitExceeded(
            f"a heading of {heading_deg:g} deg for the {name} pair is beyond the limit to each side; the stops stand "
            f"at {geometry.max_heading_deg:g} deg",
            value=round(heading_deg, 6),
            limit=f"heading_deg {limits.heading_deg:g}",
            remedy=f"ask for a heading from {-limits.heading_deg:g} to {limits.heading_deg:g} deg",
        )


def _check_wheels(limits: Limits, speed_m_s: float, solution: TurningSolution) -> None:
    fastest = max(abs(speed) for speed in solution.roll_speed_m_s)
    if fastest > limits.wheel_speed_m_s * (1 + _ROUNDING):
        possible = abs(speed_m_s) * limits.wheel_speed_m_s / fastest
        raise LimitExceeded(
            f"the fastest wheel would roll at {fastest:.3f} m/s, beyond its limit",
            value=round(fastest, 6),
            limit=f"wheel_speed_m_s {limits.wheel_speed_m_s:g}",
            remedy=f"on this curve the centre can do at most {math.floor(possible * 1000) / 1000:.3f} m/s",
        )


def turning_warnings(geometry: PairedSteerGeometry, solution: TurningSolution) -> tuple[str, ...]:
    """What is permitted but will not be driven as computed: sentences for people."""
    if solution.icr_m is None:
        return ()
    warnings = []
    if abs(solution.icr_m[1]) < geometry.pivot_track_m / 2 + geometry.contact_offset_m:
        warnings.append("the centre of rotation lies inside the track: the inner wheels are dragged sideways")
    rear, front = solution.heading_rad[0], solution.heading_rad[2]
    if rear * front < 0 and max(abs(rear), abs(front)) > SINGLE_CENTRE_LIMIT_RAD:
        worst = math.degrees(max(abs(angle) for angle in solution.mismatch_rad))
        warnings.append(
            f"headings beyond {math.degrees(SINGLE_CENTRE_LIMIT_RAD):.0f} deg: wheels move up to {worst:.0f} deg off "
            "their headings, the driven arc will differ from the computed one"
        )
    return tuple(warnings)
