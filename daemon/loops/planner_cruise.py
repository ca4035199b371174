"""Motions in the plane that reach the speed limit: a change of velocity, a cruise, another change.

Units and vectors as in planner_arcs. Velocities relative to a cruise have it along the real axis: along + i across.
From the goal back in time to a cruise is the same problem as from the start to it.
"""

from __future__ import annotations

from cmath import rect
from collections.abc import Callable
from math import asin, atan2, copysign, cos, log1p, sin, sqrt
from typing import Final

from daemon.loops.planner_arcs import Arc, Bend, Ramp, Slide, ramp_between

Cruise = tuple[complex, float, float]
"""A heading, as a unit vector, with the contacts [rad] of the changes of velocity before and after it."""
Change = tuple[float, float, float, float]
"""Displacement across the cruise; its slope by the heading; the contact where the bend meets the circle of the speed
limit, as an angle from the cruise [rad], 0 without a bend; its slope by the heading."""
Half = Callable[[complex, float], Change]
"""From a velocity relative to the cruise, and where the contact is thought to be, to the change of velocity."""

STEEPEST: Final = 1.047
"""An optimal bend meets the circle of the speed limit at less than pi / 3 from the cruise."""
FLAT: Final = 1e-13
"""Below this, a velocity across is none."""
ON_CIRCLE: Final = 1e-12
"""A velocity as near to the speed limit as this slides, within pi / 3 of the cruise."""
LEAST_BENT: Final = 1e-9
"""Where a velocity is near the circle, so is the zero of the bend's slope."""
TRIALS: Final = range(30)
LONGEST_STEP: Final = 0.5
CONVERGED: Final = 1e-6
"""A Newton step as short as this leaves its square, which is none."""
AT_REST: Final[Change] = 0.0, 0.0, 0.0, 0.0
"""From rest every heading is alike."""


def cruise(half: Half, travel: complex, start: complex, end: complex, heading: complex) -> Cruise | None:
    """The cruise in whose heading the rest of the travel lies, changes of velocity taken off; None if none is found.

    Newton's method for the heading and both contacts at once.

    Args:
        half: change of velocity.
        travel: displacement to the goal.
        start: velocity at the start.
        end: velocity at the goal.
        heading: where the search begins, a unit vector.
    """
    first = last = 0.0
    for _ in TRIALS:
        back = heading.conjugate()
        left = travel * back
        begun, begun_slope, first_contact, first_slope = half(start * back, first)
        ended, ended_slope, last_contact, last_slope = half(end * back, last) if end else AT_REST
        slope = left.real + begun_slope + ended_slope
        if not slope:
            return None
        step = (left.imag - begun - ended) / slope
        length = abs(step)
        if length > LONGEST_STEP:
            step = copysign(LONGEST_STEP, step)
        heading *= rect(1.0, step)
        first_before, first = first, first_contact + first_slope * step
        last_before, last = last, last_contact + last_slope * step
        if (
            length < CONVERGED
            and _settled(start, step, first_before, first)
            and (not end or _settled(end, step, last_before, last))
        ):
            return heading, first, last
    return None


def _settled(velocity: complex, step: float, before: float, contact: float) -> bool:
    """Whether a contact has converged; without a bend, whether the velocity stays in line with the cruise."""
    return abs(contact - before) <= CONVERGED * before if contact else abs(velocity * step) < FLAT


def half_ramp(velocity: complex, _: float) -> Change:
    """The straight change from a velocity to the cruise."""
    time = abs(1 - velocity)
    if not time:
        return 0.0, 0.0, 0.0, 0.0
    along, across = velocity.real, velocity.imag
    return across / 2 * time, -(across * across / time + along * time) / 2, 0.0, 0.0


def half_turn(velocity: complex, contact: float) -> Change:
    """The optimal change from a velocity to the cruise: a bend, then a slide.

    The bend meets the circle tangentially at an angle p from the cruise. With b = 1 - cos p and the bend lasting over h
    of its u, the constant Hamiltonian makes along = 1 - b (cosh h + sin p sinh h), and the costate across = sin p +
    b h cos p. The first has h = log((q + root) / (1 + sin p)) with q = (1 - along) / b, root = sqrt(q^2 - cos^2 p); a
    Newton step leads from a guess of p towards the zero of the second. What the change costs, its duration less its
    displacement along, has the costate for its gradient; turned with the heading that is the displacement across,
    b (along cos p + across root).

    Args:
        velocity: at most 1.
        contact: p, 0 to begin with a polynomial that is near it.
    """
    along, signed = velocity.real, velocity.imag
    across = abs(signed)
    if across < FLAT:
        return 0.0, -along * (1 - along), 0.0, 0.0
    if along > 0.5 and 1.0 - along * along - across * across < ON_CIRCLE:
        turned = copysign(1.0, signed)
        return turned * (1 - along), -across, atan2(across, along), -turned
    p = contact if 0.0 < contact < STEEPEST else across * (0.87 + 0.08 * along - across * (0.74 - 0.69 * across))
    s = sin(p)
    if s > across:
        p, s = asin(across), across
    c = cos(p)
    b, q, root = _bend(along, c, s)
    h = log1p((q - 1.0 + root - s) / (1.0 + s))
    steepness, tilt = q / root, along - across * c / root
    bent = 1.0 + s * (h - steepness)
    if bent < LEAST_BENT:
        bent = LEAST_BENT
    miss, turning, narrow = (across - s - b * c * h) / bent, tilt / bent, 2.0 * c - 1.0
    tilted = s * tilt
    displaced = b * (along * c + across * root) + tilted * miss
    slope = b * (across * c - along * root) - across * across * steepness - tilted * turning
    if signed < 0.0:
        return -displaced, slope, p + miss / narrow, turning / narrow
    return displaced, slope, p + miss / narrow, -turning / narrow


def _bend(along: float, c: float, s: float) -> tuple[float, float, float]:
    """b, q and root of :func:`half_turn`, from cos p and sin p."""
    b = s * s / (1.0 + c)
    q = (1.0 - along) / b
    if q < 1.0:
        q = 1.0
    return b, q, sqrt((q - 1.0) * (q + 1.0) + s * s)


def ramp_arcs(travel: complex, start: complex, end: complex, found: Cruise) -> list[Arc]:
    """Straight change of velocity, cruise, straight change of velocity; none if the cruise would lead back."""
    fast, _, _ = found
    first, last = ramp_between(start, fast), ramp_between(fast, end)
    left = travel - ((start + fast) * first.duration + (fast + end) * last.duration) / 2
    length = (left * fast.conjugate()).real
    return [first, Ramp(length, fast), last] if length >= 0.0 else []


def turn_arcs(travel: complex, start: complex, end: complex, found: Cruise) -> list[Arc]:
    """Bend, slide, cruise, slide, bend; a straight change of velocity in place of a turn that is none.

    None at all if the cruise would lead back.
    """
    heading, first_contact, last_contact = found
    first, begun = _turn(start, heading, first_contact, 1.0)
    last, ended = _turn(end, heading, last_contact, -1.0)
    length = (travel * heading.conjugate()).real - begun - ended
    return [*first, Ramp(length, heading), *last] if length >= 0.0 else []


def _turn(velocity: complex, heading: complex, contact: float, toward: float) -> tuple[list[Arc], float]:
    """From a velocity to the cruise (toward = 1) or from the cruise to it (-1), and the displacement along it."""
    relative = velocity * heading.conjugate()
    along, across = relative.real, relative.imag
    if not contact:
        ramp = ramp_between(velocity, heading) if toward > 0 else ramp_between(heading, velocity)
        return [ramp], (1.0 - along * along) * 0.5
    c, s = cos(contact), sin(contact)
    b, q, root = _bend(along, c, s)
    bending = b * (root - s)
    # From half_turn, with b c h = across - s.
    forward = bending - b * (b * (root * q - s) + c * (abs(across) - s)) * 0.5 + s
    side = -toward * copysign(1.0, across)
    meeting = heading * complex(c, copysign(s, across))
    if toward > 0:
        return [Bend(bending, velocity, heading, side, b * c, -b * root), Slide(contact, meeting, side)], forward
    return [Slide(contact, heading, side), Bend(bending, meeting, heading, side, b * c, b * s)], forward
