"""Kinematics of a robot on omni-wheels: body motion to wheel rim speeds and back.

A wheel rolls in its own direction and is free across it. Its rim speed is the robot's speed along that direction plus
yaw rate times lever, the distance of the robot's centre from the line on which the wheel rolls. Three wheels determine
the body's motion; with more of them it is the least-squares one.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

Row = tuple[float, float, float]
Motion = tuple[float, float, float]
"""Speed forward and to the left [m/s], yaw rate counter-clockwise [rad/s]."""

_DEGENERATE: Final = 1e-12
"""Smallest determinant of unit directions and levers in units of their mean that counts as not zero."""
_UNDETERMINED: Final = "these wheels leave a motion of the robot undetermined; check their directions and levers"


@dataclass(frozen=True, slots=True)
class OmniWheel:
    """Where a wheel rolls.

    Attributes:
        direction_rad: of rolling, in the robot's frame.
        lever_m: rim speed per yaw rate; positive where the wheel rolls counter-clockwise about the robot's centre.
    """

    direction_rad: float
    lever_m: float


def turtle_wheels(lever_1_m: float, lever_2_m: float, lever_3_m: float) -> tuple[OmniWheel, OmniWheel, OmniWheel]:
    """The Turtle robot's wheels (its report, appendix A): wheel 2 rolls forward, 3 and 1 at 120 and 240 degrees."""
    return (
        OmniWheel(math.radians(240), lever_1_m),
        OmniWheel(0.0, lever_2_m),
        OmniWheel(math.radians(120), lever_3_m),
    )


class OmniKinematics:
    """Both directions of the kinematics.

    Attributes:
        forward: one row a wheel; times the body's motion it is the wheel's rim speed.
        inverse: three rows; times the rim speeds they are the body's motion in the least-squares sense; with three
            wheels the inverse of ``forward``.
    """

    def __init__(self, wheels: Sequence[OmniWheel]) -> None:
        """Kinematics of at least three wheels.

        Raises:
            ValueError: the wheels leave a motion of the body undetermined (fewer than three, parallel directions,
                levers that cancel out), or a number is not finite.
        """
        self.forward: tuple[Row, ...] = tuple(
            (math.cos(wheel.direction_rad), math.sin(wheel.direction_rad), wheel.lever_m) for wheel in wheels
        )
        self.inverse = _pseudo_inverse(self.forward)

    def wheel_speeds(self, motion: Motion) -> tuple[float, ...]:
        """Rim speed of each wheel [m/s]."""
        vx, vy, yaw_rate = motion
        return tuple(cos * vx + sin * vy + lever * yaw_rate for cos, sin, lever in self.forward)

    def body_motion(self, wheel_speeds: Sequence[float]) -> Motion:
        """Motion of the body that fits the rim speeds [m/s] best."""
        forward, left, turn = self.inverse
        return (_dot(forward, wheel_speeds), _dot(left, wheel_speeds), _dot(turn, wheel_speeds))


def _dot(row: Sequence[float], column: Sequence[float]) -> float:
    return sum(a * b for a, b in zip(row, column, strict=True))


def _cross(a: Row, b: Row) -> Row:
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def _pseudo_inverse(rows: tuple[Row, ...]) -> tuple[tuple[float, ...], tuple[float, ...], tuple[float, ...]]:
    """(M^T M)^-1 M^T, with levers in units of their mean so that rows of metres and of ones weigh alike."""
    unit = sum(abs(lever) for _, _, lever in rows) / len(rows) if rows else 0.0
    if not 0 < unit < math.inf:
        raise ValueError(_UNDETERMINED)
    scaled = [(cos, sin, lever / unit) for cos, sin, lever in rows]
    a, b, c = zip(*scaled, strict=True)
    normal: tuple[Row, Row, Row] = (
        (_dot(a, a), _dot(a, b), _dot(a, c)),
        (_dot(a, b), _dot(b, b), _dot(b, c)),
        (_dot(a, c), _dot(b, c), _dot(c, c)),
    )
    adjugate = (_cross(normal[1], normal[2]), _cross(normal[2], normal[0]), _cross(normal[0], normal[1]))
    determinant = _dot(normal[0], adjugate[0])
    if not (_DEGENERATE < determinant < math.inf):
        raise ValueError(_UNDETERMINED)
    x, y, turn = (tuple(_dot(part, row) / determinant for row in scaled) for part in adjugate)
    return x, y, tuple(value / unit for value in turn)
