"""Motions in the plane that reach the speed limit: a change of velocity, a cruise, another change.

Units as in planner_arcs; along and across are meant with respect to the cruise. From the goal back in time to a cruise
is the same problem as from the start to it.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Final

from daemon.loops.planner_arcs import Arc, Bend, Ramp, Slide, Vector, ramp_between

Half = Callable[[float, float], Vector]
"""From a velocity (along, across) to the cruise: displacement along and across."""

STEEPEST: Final = math.pi / 3
"""An optimal bend meets the circle of the speed limit no farther than this from the cruise."""
FLAT: Final = 1e-13
"""Below this, a velocity across is none."""


def cruise(half: Half, travel: Vector, start: Vector, end: Vector, heading: float) -> Vector | None:
    """Heading [rad] and length of the cruise; None if there is none.

    Seeks the heading in which the rest of the travel lies, both changes of velocity taken off (secant method).

    Args:
        half: displacement of a change of velocity.
        travel: displacement to the goal.
        start: velocity at the start.
        end: velocity at the goal.
        heading: where the search begins [rad].
    """
    step = last_across = math.nan
    for _ in range(16):
        c, s = math.cos(heading), math.sin(heading)
        first_along, first_across = half(start[0] * c + start[1] * s, start[1] * c - start[0] * s)
        last_along, end_across = half(end[0] * c + end[1] * s, end[1] * c - end[0] * s)
        along = travel[0] * c + travel[1] * s - first_along - last_along
        across = travel[1] * c - travel[0] * s - first_across - end_across
        if abs(across) < 1e-13 * (1 + abs(along)):
            return (heading, along) if along >= 0.0 else None
        if math.isnan(last_across):
            step = across / (1 + abs(along))
        elif last_across != across:
            step *= across / (last_across - across)
        step = max(-0.5, min(0.5, step))
        heading, last_across = heading + step, across
    return None


def half_ramp(along: float, across: float) -> Vector:
    """Displacement of the straight change from a velocity to the cruise."""
    time = math.hypot(1 - along, across)
    return (1 + along) / 2 * time, across / 2 * time


def ramp_arcs(start: Vector, end: Vector, heading: float, length: float) -> list[Arc]:
    """Straight change of velocity, cruise, straight change of velocity."""
    fast = math.cos(heading), math.sin(heading)
    return [ramp_between(start, fast), Ramp(length, fast), ramp_between(fast, end)]


def half_turn(along: float, across: float) -> Vector:
    """Displacement of the optimal change from a velocity to the cruise: a bend, then a slide."""
    if abs(across) < FLAT:
        return (1 - along * along) / 2, 0.0
    p, h = contact(along, abs(across))
    c, s = math.cos(p), math.sin(p)
    b = s * s / (1 + c)
    d = b * c
    u = math.asinh(s / c) + h
    sh, ch = math.sinh(u), math.cosh(u)
    bending = d * (sh - s / c)
    forward = bending - d * d * (sh * ch + h - s / (c * c)) / 2 + s
    return forward, math.copysign(s * bending + d * d * (h * sh - ch + 1 / c) + 1 - c, across)


def contact(along: float, across: float) -> Vector:
    """Where the optimal change from a velocity to the cruise meets the circle of the speed limit.

    The bend meets the circle tangentially at an angle p from the cruise. With b = 1 - cos p and the bend lasting over h
    of its u, the constant Hamiltonian makes along = 1 - b (cosh h + sin p sinh h), and the costate across = sin p +
    b h cos p. h follows from the first equation; p is the zero of the second (Newton's method, kept in a bracket).

    Args:
        along: component of the velocity, at most 1.
        across: the other component, positive.

    Returns:
        p [rad] and h.
    """
    low, high = 0.0, min(math.asin(min(1.0, across)), STEEPEST)
    p, h = high, 0.0
    for _ in range(60):
        c, s = math.cos(p), math.sin(p)
        b = s * s / (1 + c)
        ratio = (1 - along) / b
        h = math.log(max(1.0, (ratio + math.sqrt(max(0.0, ratio * ratio - c * c))) / (1 + s)))
        error = s + b * c * h - across
        if abs(error) < 1e-15 * (1 + across) or high - low < 1e-16:
            break
        low, high = (low, p) if error > 0 else (p, high)
        sh, ch = math.sinh(h), math.cosh(h)
        slope = c + h * s * (2 * c - 1) - c * (ratio * s + b * c * sh) / (sh + s * ch)
        p -= error / slope if slope > 0 else math.inf
        if not low < p < high:
            p = (low + high) / 2
    return p, h


def turn_arcs(start: Vector, end: Vector, heading: float, length: float) -> list[Arc]:
    """Bend, slide, cruise, slide, bend; with a straight change of velocity in place of a turn that is none."""
    e = math.cos(heading), math.sin(heading)
    arcs = [*_turn(start, heading, e, 1.0), Ramp(length, e)]
    return arcs + _turn(end, heading, e, -1.0)[::-1]


def _turn(velocity: Vector, heading: float, e: Vector, toward: float) -> list[Arc]:
    """Bend and slide from the velocity to the cruise (toward = 1) or, in reverse order, from the cruise to it (-1)."""
    along, across = velocity[0] * e[0] + velocity[1] * e[1], velocity[1] * e[0] - velocity[0] * e[1]
    if abs(across) < FLAT:
        return [ramp_between(velocity, e) if toward > 0 else ramp_between(e, velocity)]
    p, h = contact(along, abs(across))
    c, s = math.cos(p), math.sin(p)
    shortest, touch = s * s / (1 + c) * c, math.asinh(s / c)
    duration = shortest * (math.sinh(touch + h) - s / c)
    side = -toward * math.copysign(1.0, across)
    meeting = heading + math.copysign(p, across)
    if toward > 0:
        return [Bend(duration, velocity, e, side, shortest, -touch - h), Slide(p, meeting, side)]
    tangent = math.cos(meeting), math.sin(meeting)
    return [Bend(duration, tangent, e, side, shortest, touch), Slide(p, heading, side)]
