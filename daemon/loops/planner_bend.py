"""Motions in the plane without a cruise: two straight changes of velocity, and the optimal bend near them.

Units and vectors as in planner_arcs.
"""

from __future__ import annotations

import math
from cmath import log
from collections.abc import Callable, Iterator
from math import cosh, sinh
from typing import Final

from daemon.loops.planner_arcs import Bend, Ramp, ramp_between

Trial = tuple[float, complex]
"""How far a point is from the solution, and Newton's step from there."""

ROUNDING: Final = 1e-12
STRAIGHT: Final = 1e-9
"""Nearer than this [rad] to straight on or straight back, two changes of velocity have no bend beside them."""
TRIALS: Final = range(20)
LEAST_PART: Final = 0.1
"""Part of a Newton step below which it is taken even where it does not help."""
CONVERGED: Final = 1e-6
"""A Newton step as short as this leaves its square, which is none."""
RATIOS: Final = 1.2, 1.6, 3.0
"""Lengths of the costate at the end of a bend over that at its start, tried as guesses."""
NOWHERE: Final[Trial] = math.inf, complex(math.inf)
SHORTEST_PART: Final = 1e-10
"""Time in which the speed hardly changes."""
LIMIT: Final = 1.0 + ROUNDING
"""The speed limit."""


def corner(
    travel: complex, start: complex, end: complex, guess: complex, converged: float = CONVERGED
) -> complex | None:
    """The velocity between two straight changes of velocity that cover the travel, however high it is.

    There is more than one where a fast goal is so near that it is passed and met again.

    Args:
        travel: displacement to the goal.
        start: velocity at the start.
        end: velocity at the goal.
        guess: where the search begins.
        converged: a Newton step as short as this is the last one.
    """

    def trial(via: complex) -> Trial:
        first, last = via - start, via - end
        before, after = abs(first), abs(last)
        begun, ended = via + start, via + end
        left = 2 * travel - begun * before - ended * after
        begun /= 2.0 * before or 1.0
        ended /= 2.0 * after or 1.0
        by_via = begun * first.conjugate() + ended * last.conjugate() + (before + after)
        by_mirrored = begun * first + ended * last
        size, mirrored = abs(by_via), abs(by_mirrored)
        slope = (size - mirrored) * (size + mirrored)
        return abs(left), (by_via.conjugate() * left - by_mirrored * left.conjugate()) / slope

    return solve(trial, guess, converged, math.sqrt(abs(travel)) + 1.0)


def ramps(start: complex, end: complex, via: complex) -> list[Ramp]:
    """Two straight changes of velocity."""
    return [ramp_between(start, via), ramp_between(via, end)]


def bend(travel: complex, start: complex, end: complex, via: complex) -> Bend | None:
    """The bend that covers the travel; None if there is none, or none that differs from a straight line.

    The first guess is fitted to random problems: half of the change of u from the angle between the two straight
    changes of velocity and the logarithm of the ratio of their durations, its middle from that ratio.

    Args:
        travel: displacement to the goal.
        start: velocity at the start.
        end: velocity at the goal.
        via: the corner.
    """
    first, last = via - start, end - via
    if not (first and last) or start == end:
        return None
    turn = log(last / first)
    longer, turned = turn.real, turn.imag
    angle = abs(turned)
    if not STRAIGHT < angle < math.pi - STRAIGHT:
        return None
    half = 1.19 * math.asinh(0.643 * math.tan(angle * 0.5) * (1.0 + 0.328 * longer * longer)) + 0.49 * angle
    middle = longer * (0.41 + 0.49 / half)
    return _bend_near(travel, start, end, math.copysign(1.0, turned), complex(middle - half, middle + half))


def bends(travel: complex, start: complex, end: complex) -> Iterator[Bend]:
    """Bends without a corner to begin from, as where little more than a straight change of velocity is left to do.

    What that change misses tells the side; the turn that makes up for it, 12 / length^2 of the miss, is tried as the
    first, the middle and the last part of a bend.
    """
    change = end - start
    length = abs(change)
    if length < ROUNDING:
        return
    missed = travel - (start + end) / 2 * length
    across = (change.conjugate() * missed).imag / length
    turn = min(1.0, 12 * abs(across) / (length * length)) or 1.0
    side = -math.copysign(1.0, across)
    for ratio in RATIOS:
        near, far = math.asinh((1 - 1 / ratio) / turn), math.log(ratio)
        for guess in complex(near, near + far), complex(-near - far, -near), complex(-far, far):
            if arc := _bend_near(travel, start, end, side, guess):
                yield arc


def _bend_near(travel: complex, start: complex, end: complex, side: float, guess: complex) -> Bend | None:
    """Newton's method for both ends u of a bend, as one complex number.

    With the shortest costate along i and of length 1, the velocity changes by r0 - r1 + i (u1 - u0) within s1 - s0;
    turned and scaled by z, that is the change from start to end, which is taken as 1 here. Of the displacement that a
    straight change of velocity would miss, the logarithm is what has to agree: it is nearer to linear than the miss.
    """
    change = end - start
    first, whole = start / change, travel / (change * abs(change))
    if side < 0.0:
        first, whole = first.conjugate(), whole.conjugate()
    mean, last = first + 0.5, first + 1.0
    missed = whole - mean

    def trial(ends: complex) -> Trial:
        u0, u1 = ends.real, ends.imag
        if not u0 < u1:
            return NOWHERE
        s0, r0, span = sinh(u0), cosh(u0), u1 - u0
        s1, r1 = sinh(u1), cosh(u1)
        z = 1 / (r0 - r1 + span * 1j)
        rest, scale = (s1 * r1 - s0 * r0 + span) * 0.5 * z, abs(z)
        c0, c1 = s0 + 1j, s1 + 1j
        onward = rest + c1
        way = first * (s1 - s0) + onward
        turn0, turn1 = c0.conjugate() * z, c1.conjugate() * z
        less_by_u0 = first * r0 + (rest + c0) * turn0 + turn0.real * way
        more_by_u1 = last * r1 + onward * turn1 + turn1.real * way
        found = way * scale - mean
        left = log(missed / found)
        step, ratio = left * found / (less_by_u0 * scale), more_by_u1 / less_by_u0
        further = step.imag / ratio.imag
        return abs(left), ratio.real * further - step.real + further * 1j

    ends = solve(trial, guess, CONVERGED, 1.5)
    return bend_between(start, end, side, ends.real, ends.imag) if ends and ends.real < ends.imag else None


def bend_between(start: complex, end: complex, side: float, u0: float, u1: float) -> Bend:
    """The bend from u0 to u1, scaled and turned so that it leads from one velocity to the other."""
    middle, half = (u0 + u1) * 0.5, 2.0 * sinh((u1 - u0) * 0.5)
    scale = (end - start) / complex(-sinh(middle) * half, side * (u1 - u0))
    shortest = abs(scale)
    return Bend(shortest * cosh(middle) * half, start, scale / shortest, side, shortest, shortest * sinh(u0))


def leads_farthest(arc: Bend, travel: complex, end: complex) -> bool:
    """Whether no shorter motion covers what a bend covers; where this is false, there may be one.

    A bend leads as far along its costate's change as any motion of its duration can (maximum principle; what can be
    reached in a time is convex). If that is forward, a shorter motion is forward at some time, too; with that velocity
    held for what is left of the duration, it would lead farther than the bend. If not, how far a motion can lead is
    convex in its duration: it grows by e . start + |c| where c, followed back from the end, has got to, and in the
    reverse by e . end + |c|. Where it does nothing but grow up to the bend's duration, it was too little before.

    Args:
        arc: the bend.
        travel: displacement that it covers.
        end: velocity at its end.
    """
    back = arc.direction.conjugate()
    if (travel * back).real > 0.0:
        return True
    nearest = max(arc.begin, 0.0) or min(arc.begin + arc.duration, 0.0)
    fastest = max((arc.velocity * back).real, (end * back).real)
    return fastest + math.hypot(nearest, arc.shortest) >= 0.0


def keeps_limit(arc: Bend, end: complex) -> bool:
    """Whether the speed stays within the limit all through a bend.

    It does if the bend is too short to get beyond from either end, or from either end and from its velocity half-way
    between the two. Else the velocity keeps to one side of its tangents at both ends of a half, so where they cross
    within the limit, all of the half is; other halves are halved again, until a velocity is above the limit.

    Args:
        arc: the bend.
        end: velocity at its end.
    """
    if abs(arc.velocity) + abs(end) + arc.duration <= 2.0:
        return True
    d, begin, back = arc.shortest, arc.begin, arc.direction.conjugate()
    start, final = arc.velocity * back, end * back
    if arc.side < 0.0:
        start, final = start.conjugate(), final.conjugate()
    r0, u0 = math.hypot(begin, d), math.asinh(begin / d)
    parts = [(begin, start, begin + arc.duration, final)]
    while parts:
        low, before, high, after = parts.pop()
        slow = abs(before)
        highest = (slow + abs(after) + high - low) * 0.5
        middle = low + highest - slow
        velocity = start + complex(r0 - math.hypot(middle, d), d * (math.asinh(middle / d) - u0))
        speed = abs(velocity)
        if speed > LIMIT:
            return False
        if highest + speed > 2.0 * LIMIT and min(middle - low, high - middle) > SHORTEST_PART:
            if _crossing_speed(low, before, middle, velocity, d) > LIMIT:
                parts.append((low, before, middle, velocity))
            if _crossing_speed(middle, velocity, high, after, d) > LIMIT:
                parts.append((middle, velocity, high, after))
    return True


def _crossing_speed(low: float, before: complex, high: float, after: complex, d: float) -> float:
    """Speed where the tangents of a velocity cross, from the side of the acceleration; both ends given with s."""
    change = after - before
    way = (change.real + change.imag * high / d) / (high - low)
    return abs(before + way * complex(-low, d))


def solve(trial: Callable[[complex], Trial], guess: complex, converged: float, longest: float) -> complex | None:
    """Where nothing is missing: Newton's method, its steps halved while they do not help.

    Args:
        trial: how far a point is from there, infinite where it is not allowed, and Newton's step from it.
        guess: the first point.
        converged: a step as short as this is the last one.
        longest: step allowed.

    Returns:
        The point; None if it does not converge.
    """
    point, part = guess, 1.0
    try:
        error, step = trial(guess)
        for _ in TRIALS:
            length = abs(step)
            if length <= converged:
                return point + step
            if not length <= longest:
                if not math.isfinite(length):
                    return None
                step *= longest / length
            nearer = point + part * step
            left, onward = trial(nearer)
            if left < error or part < LEAST_PART:
                point, error = nearer, left
                step, part = onward, 1.0
            else:
                part /= 2
    except (ArithmeticError, ValueError):
        return None
    return None
