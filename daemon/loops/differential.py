"""A robot on two driven wheels: its kinematics, and moves as turns of its wheels.

Right wheel first everywhere. Angles are counter-clockwise positive, wheel turns and speeds positive when the wheel
rolls forward. The kinematics are those of Siegwart and Nourbakhsh, *Autonomous Mobile Robots*, section 3.2, with ``l``
the distance of a wheel from the robot's centre.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

from daemon.loops.odometry import Pose, moved_along_arc


def wrap_angle(angle_rad: float) -> float:
    """The same direction from -pi to pi."""
    return math.remainder(angle_rad, math.tau)


@dataclass(frozen=True, slots=True)
class DifferentialDrive:
    """Two driven wheels on one axis.

    Attributes:
        wheel_radius_m: of both wheels.
        half_track_m: from the robot's centre to each wheel.
    """

    wheel_radius_m: float
    half_track_m: float

    def __post_init__(self) -> None:
        if not (0 < self.wheel_radius_m < math.inf and 0 < self.half_track_m < math.inf):
            raise ValueError("wheel radius and half track have to be more than 0 m")

    def body_motion(self, right_rad_s: float, left_rad_s: float) -> tuple[float, float]:
        """Speed forward [m/s] and yaw rate [rad/s] for the speeds of the wheels; the same for turns [m, rad]."""
        radius = self.wheel_radius_m
        return radius * (right_rad_s + left_rad_s) / 2, radius * (right_rad_s - left_rad_s) / (2 * self.half_track_m)

    def wheel_speeds(self, forward_m_s: float, yaw_rate_rad_s: float) -> tuple[float, float]:
        """Speeds of the wheels [rad/s] for a motion of the body; the same for turns [rad]."""
        turning = self.half_track_m * yaw_rate_rad_s
        return (forward_m_s + turning) / self.wheel_radius_m, (forward_m_s - turning) / self.wheel_radius_m

    def moved(self, pose: Pose, right_rad: float, left_rad: float) -> Pose:
        """The pose after the wheels have turned at a constant ratio: exact on arcs and on lines."""
        forward, turn = self.body_motion(right_rad, left_rad)
        return moved_along_arc(pose, forward, 0.0, turn)


def share_power(right: float, left: float, most: float) -> tuple[float, float]:
    """Powers in the ratio of the wheel speeds, the larger of them ``most``; signs are kept, rest stays rest."""
    largest = max(abs(right), abs(left))
    return (right / largest * most, left / largest * most) if largest else (0.0, 0.0)


def limit_speeds(right: float, left: float, most: float) -> tuple[float, float]:
    """Wheel speeds in the same ratio, both at most ``most``: slower where they have to be, on the same arc."""
    return share_power(right, left, most) if max(abs(right), abs(left)) > most else (right, left)


class Leg(NamedTuple):
    """What one wheel does in a move; both numbers have the sign of its direction, and are 0 for a wheel that rests."""

    power: float
    angle_deg: float


class Move(NamedTuple):
    """A motion along an arc or a line, at a constant ratio of the wheel speeds."""

    right: Leg
    left: Leg


def arc_move(drive: DifferentialDrive, forward_m: float, turn_rad: float, power: float) -> Move:
    """A move by inverse kinematics: the centre's way along its arc, and the turn.

    Args:
        drive: the robot.
        forward_m: length of the arc, negative for backward.
        turn_rad: change of heading.
        power: of the wheel that turns faster, in the units of the motor; negative drives the same move backward.

    Raises:
        ValueError: no power, or a number that is not finite.
    """
    if not (math.isfinite(forward_m) and math.isfinite(turn_rad) and math.isfinite(power)):
        raise ValueError(f"way {forward_m} m, turn {turn_rad} rad and power {power} have to be finite")
    if power == 0 and (forward_m or turn_rad):
        raise ValueError("at power 0 a move never ends")
    sign = math.copysign(1.0, power)
    angles = drive.wheel_speeds(sign * forward_m, sign * turn_rad)
    powers = share_power(*angles, abs(power))
    right, left = (Leg(share, math.degrees(angle)) for share, angle in zip(powers, angles, strict=True))
    return Move(right, left)


def line(drive: DifferentialDrive, distance_m: float, power: float) -> Move:
    """Straight on (NXT report, listing 1), backward where distance or power is negative. Raises ValueError."""
    return arc_move(drive, distance_m, 0.0, power)


def bend(drive: DifferentialDrive, radius_m: float, angle_rad: float, power: float, clockwise: bool) -> Move:
    """Along a circle (NXT report, listing 2); a radius below half the track turns the inner wheel backward.

    Args:
        drive: the robot.
        radius_m: from the circle's centre to that of the robot; 0 turns on the spot.
        angle_rad: how far; negative drives backward along the circle.
        power: of the outer wheel; negative drives backward.
        clockwise: a bend to the right.

    Raises:
        ValueError: a negative radius, no power, or a number that is not finite.
    """
    if radius_m < 0:
        raise ValueError(f"a circle has no radius of {radius_m} m; say which way it bends")
    return arc_move(drive, radius_m * angle_rad, -angle_rad if clockwise else angle_rad, power)


def way_to(drive: DifferentialDrive, goal: Pose, power: float) -> list[Move]:
    """Open loop from the origin to a pose: turn towards it, drive there, turn to its heading. Raises ValueError."""
    direction = math.atan2(goal.y_m, goal.x_m) if goal.x_m or goal.y_m else 0.0
    return [
        arc_move(drive, 0.0, direction, power),
        line(drive, math.hypot(goal.x_m, goal.y_m), power),
        arc_move(drive, 0.0, wrap_angle(goal.yaw_rad - direction), power),
    ]


def parse_move(drive: DifferentialDrive, text: str, power: float) -> Move:
    """A move in words: ``line METRES``, or ``bend METRES DEGREES [right] [back]``. Raises ValueError."""
    kind, *words = text.split() or [""]
    no_move = ValueError(f"{text!r} is no move: line METRES, or bend METRES DEGREES [right] [back]")
    try:
        numbers = [float(word) for word in words if word not in ("right", "back")]
    except ValueError:
        raise no_move from None
    flags = [word for word in words if word in ("right", "back")]
    if kind == "line" and len(numbers) == 1 and not flags:
        return line(drive, numbers[0], power)
    if kind == "bend" and len(numbers) == 2:
        signed = -power if "back" in flags else power
        return bend(drive, numbers[0], math.radians(numbers[1]), signed, clockwise="right" in flags)
    raise no_move


class TachoCompensation:
    """Takes what a wheel turned too far off its next move (NXT report, listing 4), with the signs of both directions.

    Attributes:
        error_deg: what the wheels have turned too far up to now.
    """

    def __init__(self) -> None:
        self.error_deg = (0.0, 0.0)

    def corrected(self, move: Move) -> Move:
        """The move to command; a wheel of which nothing is left rests."""
        right, left = (_shortened(leg, error) for leg, error in zip(move, self.error_deg, strict=True))
        return Move(right, left)

    def moved(self, wanted: Move, turned_deg: tuple[float, float]) -> None:
        """Take note of how far the wheels have turned in a move that was wanted as ``wanted``."""
        right, left = (
            turned + error - leg.angle_deg
            for turned, error, leg in zip(turned_deg, self.error_deg, wanted, strict=True)
        )
        self.error_deg = (right, left)


def _shortened(leg: Leg, error_deg: float) -> Leg:
    angle = leg.angle_deg - error_deg
    return Leg(math.copysign(leg.power, angle), angle) if leg.power else Leg(0.0, 0.0)
