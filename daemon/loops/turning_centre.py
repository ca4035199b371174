"""Where the instantaneous centre of rotation of a body is, in its own frame."""

from __future__ import annotations

import math
from typing import Final

Point = tuple[float, float]

STRAIGHT: Final = 0.01
"""Curvature [1/m] below which a body counts as moving straight: its centre is more than 100 m away."""
AT_REST_RAD_S: Final = math.radians(0.5)
"""Yaw rate below which a body counts as not turning: noise of wheels that rest."""


def centre_of_twist(forward_m_s: float, left_m_s: float, yaw_rate_rad_s: float) -> Point | None:
    """The point that rests while the body moves: where forward speed, left speed and yaw rate cancel out.

    A point (x, y) moves with (forward - rate y, left + rate x). None for a body that rests or moves straight.
    """
    least = max(AT_REST_RAD_S, STRAIGHT * math.hypot(forward_m_s, left_m_s))
    if abs(yaw_rate_rad_s) < least:
        return None
    return (-left_m_s / yaw_rate_rad_s, forward_m_s / yaw_rate_rad_s)


def centre_of_curvature(curvature: float) -> Point | None:
    """The centre beside an axle that moves with a curvature [1/m], positive to the left; None where it is straight."""
    return None if abs(curvature) < STRAIGHT else (0.0, 1.0 / curvature)


def if_near(centre: Point | None) -> Point | None:
    """The same centre; None where it is so far away that the body counts as moving straight."""
    return None if centre is None or math.hypot(*centre) * STRAIGHT > 1.0 else centre
