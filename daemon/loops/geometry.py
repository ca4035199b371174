"""Kinematics of a robot whose wheels steer in pairs: contact points, centres of rotation, wheel velocities.

Wheels 1 to 4 are rear right, rear left, front left, front right; pairs are rear and front. The two wheels of a pair
always have the same heading, so the right wheels (1, 4) and the left wheels (2, 3) have each their own instantaneous
centre of rotation (ICR); the robot turns about the mean of both (MAX2D thesis, section 4.2).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

from profiles.schema import PairedSteerGeometry

Point = tuple[float, float]
PerWheel = tuple[float, float, float, float]
PerPair = tuple[float, float]

REAR: Final = 0
FRONT: Final = 1
PAIR_NAMES: Final = ("rear", "front")
WHEELS_OF_PAIR: Final = ((0, 1), (2, 3))
TURN_SIGN: Final[PerWheel] = (1.0, -1.0, -1.0, 1.0)
"""+1: the wheel rolls forward when its pair turns counter-clockwise (right wheels), -1: backward (left wheels)."""

_END: Final[PerWheel] = (-1.0, -1.0, 1.0, 1.0)
_SIDE: Final[PerWheel] = (-1.0, 1.0, 1.0, -1.0)
_PARALLEL: Final = 1e-9


@dataclass(frozen=True, slots=True)
class TurningSolution:
    """How the robot moves with given headings of its pairs at a given speed of its centre.

    Attributes:
        heading_rad: heading of each wheel.
        contact_m: contact point of each wheel in the robot's frame.
        icr_right_m: where the axle lines of wheels 1 and 4 meet; None when the headings are parallel.
        icr_left_m: where the axle lines of wheels 2 and 3 meet.
        icr_m: the mean of both, about which the robot turns.
        centre_radius_m: distance from the robot's centre to ``icr_m``; infinite when the headings are parallel.
        published_radius_m: the radius that the thesis' program prints: the mean distance of wheels 1 and 3 to the
            centres of their own sides.
        yaw_rate_rad_s: signed, so that the centre moves along the mean heading when the speed is positive.
        wheel_speed_m_s: speed of each contact point (with the sign of the centre's speed when headings are parallel).
        wheel_direction_rad: direction of that velocity (the common heading when headings are parallel).
        roll_speed_m_s: its component along the wheel's heading, the speed at which the wheel shall roll.
        lateral_speed_m_s: its component to the left of the heading, which the tyre has to slip.
        mismatch_rad: angle from the wheel's heading to the line of its velocity.
    """

    heading_rad: PerWheel
    contact_m: tuple[Point, Point, Point, Point]
    icr_right_m: Point | None
    icr_left_m: Point | None
    icr_m: Point | None
    centre_radius_m: float
    published_radius_m: float
    yaw_rate_rad_s: float
    wheel_speed_m_s: PerWheel
    wheel_direction_rad: PerWheel
    roll_speed_m_s: PerWheel
    lateral_speed_m_s: PerWheel
    mismatch_rad: PerWheel

    @property
    def parallel(self) -> bool:
        """True when all wheels point in one direction and the robot does not turn."""
        return self.icr_m is None


def clamp(value: float, limit: float) -> float:
    """``value`` limited to the range from ``-limit`` to ``limit``."""
    return max(-limit, min(limit, value))


def _contact(geometry: PairedSteerGeometry, wheel: int, heading_rad: float) -> Point:
    cos, sin = math.cos(heading_rad), math.sin(heading_rad)
    outward, ahead = _SIDE[wheel] * geometry.contact_offset_m, _END[wheel] * geometry.contact_lead_m
    return (
        _END[wheel] * geometry.wheelbase_m / 2 - outward * sin + ahead * cos,
        _SIDE[wheel] * geometry.pivot_track_m / 2 + outward * cos + ahead * sin,
    )


def contact_points(
    geometry: PairedSteerGeometry, rear_heading_rad: float, front_heading_rad: float
) -> tuple[Point, Point, Point, Point]:
    """Contact points of wheels 1 to 4 in the robot's frame [m] for the headings of the pairs.

    Each lies ``contact_offset_m`` outward along the axle and ``contact_lead_m`` outward along the heading (the front
    pair forward, the rear pair backward) of its steering axis (MAX2D thesis, figures 4.8 to 4.12).
    """
    return (
        _contact(geometry, 0, rear_heading_rad),
        _contact(geometry, 1, rear_heading_rad),
        _contact(geometry, 2, front_heading_rad),
        _contact(geometry, 3, front_heading_rad),
    )


def centre_of_rotation(
    geometry: PairedSteerGeometry, rear_heading_rad: float, front_heading_rad: float
) -> Point | None:
    """The mean ICR in the robot's frame [m], or None when the headings are parallel.

    Closed form of the intersection of the axle lines (MAX2D thesis, section 4.2, with alpha_12 the rear heading and
    alpha_34 minus the front heading). Both sides' centres lie half a pivot track to its right and left.
    """
    rear, front = rear_heading_rad, front_heading_rad
    sine = math.sin(rear - front)
    if abs(sine) < _PARALLEL:
        return None
    wheelbase, lead = geometry.wheelbase_m, geometry.contact_lead_m
    x = (wheelbase / 2 * math.sin(rear + front) + lead * (math.sin(rear) + math.sin(front))) / sine
    y = -(wheelbase * math.cos(rear) * math.cos(front) + lead * (math.cos(rear) + math.cos(front))) / sine
    return (x, y)


def solve_turning(
    geometry: PairedSteerGeometry, rear_heading_rad: float, front_heading_rad: float, speed_m_s: float
) -> TurningSolution:
    """Centre of rotation, yaw rate and wheel velocities for the headings of the pairs and the speed of the centre.

    Args:
        geometry: the robot.
        rear_heading_rad: heading of the rear pair (alpha_12 of the thesis).
        front_heading_rad: heading of the front pair (minus alpha_34 of the thesis).
        speed_m_s: speed of the robot's centre, negative for backward.

    Raises:
        ValueError: a heading is not within a quarter turn to either side.
    """
    if not (abs(rear_heading_rad) < math.pi / 2 and abs(front_heading_rad) < math.pi / 2):
        raise ValueError(f"headings {rear_heading_rad} and {front_heading_rad} rad must lie within a quarter turn")
    contact = contact_points(geometry, rear_heading_rad, front_heading_rad)
    icr = centre_of_rotation(geometry, rear_heading_rad, front_heading_rad)
    if icr is None:
        return _straight(rear_heading_rad, front_heading_rad, speed_m_s, contact)
    return _turning(geometry, (rear_heading_rad, front_heading_rad), speed_m_s, contact, icr)


def _straight(
    rear: float, front: float, speed_m_s: float, contact: tuple[Point, Point, Point, Point]
) -> TurningSolution:
    direction, none = (rear + front) / 2, (0.0, 0.0, 0.0, 0.0)
    all_wheels = (speed_m_s, speed_m_s, speed_m_s, speed_m_s)
    return TurningSolution(
        heading_rad=(rear, rear, front, front),
        contact_m=contact,
        icr_right_m=None,
        icr_left_m=None,
        icr_m=None,
        centre_radius_m=math.inf,
        published_radius_m=math.inf,
        yaw_rate_rad_s=0.0,
        wheel_speed_m_s=all_wheels,
        wheel_direction_rad=(direction, direction, direction, direction),
        roll_speed_m_s=all_wheels,
        lateral_speed_m_s=none,
        mismatch_rad=none,
    )


def _turning(
    geometry: PairedSteerGeometry,
    pair_heading_rad: PerPair,
    speed_m_s: float,
    contact: tuple[Point, Point, Point, Point],
    icr: Point,
) -> TurningSolution:
    rear, front = pair_heading_rad
    heading = (rear, rear, front, front)
    x, y = icr
    half = geometry.pivot_track_m / 2
    right, left = (x, y - half), (x, y + half)
    radius = math.hypot(x, y)
    mean = (rear + front) / 2
    unit_rate = math.copysign(1.0, y * math.cos(mean) - x * math.sin(mean)) / radius
    unit = [(-unit_rate * (cy - y), unit_rate * (cx - x)) for cx, cy in contact]
    roll = [vx * math.cos(phi) + vy * math.sin(phi) for (vx, vy), phi in zip(unit, heading, strict=True)]
    lateral = [vy * math.cos(phi) - vx * math.sin(phi) for (vx, vy), phi in zip(unit, heading, strict=True)]
    mismatch = [math.atan2(math.copysign(1.0, r) * t, abs(r)) for r, t in zip(roll, lateral, strict=True)]
    return TurningSolution(
        heading_rad=heading,
        contact_m=contact,
        icr_right_m=right,
        icr_left_m=left,
        icr_m=icr,
        centre_radius_m=radius,
        published_radius_m=(math.dist(left, contact[2]) + math.dist(right, contact[0])) / 2,
        yaw_rate_rad_s=speed_m_s * unit_rate,
        wheel_speed_m_s=_per_wheel([abs(speed_m_s) * math.hypot(vx, vy) for vx, vy in unit]),
        wheel_direction_rad=_per_wheel([math.atan2(speed_m_s * vy, speed_m_s * vx) for vx, vy in unit]),
        roll_speed_m_s=_per_wheel([speed_m_s * r for r in roll]),
        lateral_speed_m_s=_per_wheel([speed_m_s * t for t in lateral]),
        mismatch_rad=_per_wheel(mismatch),
    )


def _per_wheel(values: list[float]) -> PerWheel:
    first, second, third, fourth = values
    return (first, second, third, fourth)
