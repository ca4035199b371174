"""Motions in the plane without a cruise: two straight changes of velocity, and the optimal bend near them.

Units and vectors as in planner_arcs.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Final

from daemon.loops.planner_arcs import Bend, Ramp, ramp_between

Trial = tuple[complex, complex, complex]
"""What is missing with two numbers, and its slopes by each of them."""

ROUNDING: Final = 1e-12
STRAIGHT: Final = 1e-9
"""Below this length of the shortest costate, relative to the duration, a bend is two straight changes of velocity."""
TRIALS: Final = 25
LEAST_STEP: Final = 1e-1
"""Part of a Newton step that is taken even where it does not help."""
CONVERGED: Final = 1e-6
"""A Newton step as short as this, relative to the numbers, leaves its square, which is none."""
RATIOS: Final = 1.2, 1.6, 3.0
"""Lengths of the costate at the end of a bend over that at its start, tried as guesses."""
MOST: Final = 40.0
"""Highest |u| of a bend: there its costate is 1e17 times longer than at its shortest."""
NOWHERE: Final[Trial] = complex(math.inf, math.inf), 0j, 0j
SHORTEST_PART: Final = 1e-6
"""Angle of the costate [rad] within which the speed hardly differs."""
LIMIT: Final = 1.0 + ROUNDING
"""The speed limit."""


def corner(travel: complex, start: complex, end: complex, guess: complex, precise: float = ROUNDING) -> complex | None:
    """The velocity between two straight changes of velocity that cover the travel, however high it is.

    There is more than one where a fast goal is so near that it is passed and met again.

    Args:
        travel: displacement to the goal.
        start: velocity at the start.
        end: velocity at the goal.
        guess: where the search begins.
        precise: part of the travel that may be missed.
    """

    def missing(x: float, y: float) -> Trial:
        via = complex(x, y)
        first, last = via - start, via - end
        before, after = abs(first), abs(last)
        begun, ended = start + via, end + via
        left = travel - (begun * before + ended * after) / 2
        before_turned, after_turned = first / (before or 1.0), last / (after or 1.0)
        by_x = before + after + begun * before_turned.real + ended * after_turned.real
        by_y = (before + after) * 1j + begun * before_turned.imag + ended * after_turned.imag
        return left, by_x / -2, by_y / -2

    way = abs(travel)
    miss = precise * (way + abs(start) ** 2 + abs(end) ** 2)
    found = solve_pair(missing, (guess.real, guess.imag), miss, math.sqrt(way) + 1.0)
    return complex(*found) if found else None


def ramps(start: complex, end: complex, via: complex) -> list[Ramp]:
    """Two straight changes of velocity."""
    return [ramp_between(start, via), ramp_between(via, end)]


def bend(travel: complex, start: complex, end: complex, via: complex) -> Bend | None:
    """The bend that covers the travel; None if there is none, or none that differs from a straight line.

    The first guess takes the linear costate that points along the two straight changes of velocity at their middles,
    shorter where it is shortest: 1.5 to 0.3 times, the more so the more it turns, which is near for random problems.

    Args:
        travel: displacement to the goal.
        start: velocity at the start.
        end: velocity at the goal.
        via: the corner.
    """
    first, last = via - start, end - via
    duration, change = abs(first) + abs(last), abs(last - first)
    back = first.conjugate()
    turn, ahead = (back * last).imag, (back * last).real
    if abs(turn) <= STRAIGHT * change * change or start == end:
        return None
    scale = duration / 2 / (change * change)
    shortest = abs(turn) * scale * (1.5 - 0.375 * math.atan2(abs(turn), ahead))
    begin = (ahead - abs(first) ** 2) * scale - abs(first) / 2
    guess = math.asinh(begin / shortest), math.asinh((begin + duration) / shortest)
    return _bend_near(travel, start, end, math.copysign(1.0, turn), guess)


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
    for ratio in RATIOS:
        near, far = math.asinh((1 - 1 / ratio) / turn), math.log(ratio)
        for guess in (near, near + far), (-near - far, -near), (-far, far):
            if arc := _bend_near(travel, start, end, -math.copysign(1.0, across), guess):
                yield arc


def _bend_near(travel: complex, start: complex, end: complex, side: float, guess: tuple[float, float]) -> Bend | None:
    """Newton's method for both ends of the bend.

    In units of the shortest costate d, and turned with it, the velocity changes by a turn, the displacement is the
    start's velocity times the duration and a rest.
    """
    change = end - start

    def missing(u0: float, u1: float) -> Trial:
        if not -MOST < u0 < u1 < MOST:
            return NOWHERE
        s0, r0, s1, r1 = math.sinh(u0), math.cosh(u0), math.sinh(u1), math.cosh(u1)
        turned, time = u1 - u0, s1 - s0
        turn = complex(r0 - r1, side * turned)
        scale = change / turn
        shortest = abs(scale)
        rest = complex(r0 * time - (s1 * r1 - s0 * r0 + turned) / 2, side * (s1 * turned + turn.real))
        way = start * time + scale * rest
        back = complex(s0, -side)
        by_back, by_front = back / turn, complex(-s1, side) / turn
        by_u0 = scale * (time * back - rest * by_back) - start * r0 - way * by_back.real
        by_u1 = scale * (r1 * turn - rest * by_front) + start * r1 - way * by_front.real
        return travel - shortest * way, by_u0 * -shortest, by_u1 * -shortest

    ends = solve_pair(missing, guess, ROUNDING * (abs(travel) + abs(change) ** 2), 1.5)
    return bend_between(start, end, side, *ends) if ends and ends[0] < ends[1] else None


def bend_between(start: complex, end: complex, side: float, u0: float, u1: float) -> Bend:
    """The bend from u0 to u1, scaled and turned so that it leads from one velocity to the other."""
    turn = complex(2 * math.sinh((u0 - u1) / 2) * math.sinh((u0 + u1) / 2), side * (u1 - u0))
    scale = (end - start) / turn
    shortest = abs(scale)
    return Bend(shortest * (math.sinh(u1) - math.sinh(u0)), start, scale / shortest, side, shortest, u0)


def leads_farthest(arc: Bend, end: complex) -> bool:
    """Whether no shorter motion covers what a bend covers; where this is false, there may be one.

    How far a motion can lead in the direction of the costate, beyond what is left to cover, is convex in its duration:
    it grows by e . start + |c| where c, followed back from the end, has got to, and in the reverse by e . end + |c|.
    Where it does nothing but grow up to the bend's duration, it was too little before (maximum principle; what can be
    reached in a time is convex).

    Args:
        arc: the bend.
        end: velocity at its end.
    """
    begin = arc.shortest * math.sinh(arc.begin)
    nearest = max(begin, 0.0) or min(begin + arc.duration, 0.0)
    back = arc.direction.conjugate()
    fastest = max((arc.velocity * back).real, (end * back).real)
    return fastest + math.hypot(nearest, arc.shortest) >= 0.0


def keeps_limit(arc: Bend, end: complex) -> bool:
    """Whether the speed stays within the limit all through a bend.

    It does if the bend is too short to get beyond. Else the bend is halved by the angle of the costate. The velocity
    keeps to one side of its tangents at both ends of a part, so where they cross within the limit, all of the part is;
    other parts are halved again, until a velocity is above the limit.

    Args:
        arc: the bend.
        end: velocity at its end.
    """
    if abs(arc.velocity) + abs(end) + arc.duration <= 2.0:
        return True
    back, d, u0 = arc.direction.conjugate(), arc.shortest, arc.begin
    start, final = arc.velocity * back, end * back
    if arc.side < 0.0:
        start, final = start.conjugate(), final.conjugate()
    begin, from_shortest = math.sinh(u0), d * math.cosh(u0)
    parts = [(begin, start, begin + arc.duration / d, final)]
    while parts:
        low, before, high, after = parts.pop()
        short, long = math.hypot(1.0, low), math.hypot(1.0, high)
        middle = (low * long + high * short) / (short + long)
        along, across = from_shortest - d * math.hypot(1.0, middle), d * (math.asinh(middle) - u0)
        velocity = start + complex(along, across)
        if abs(velocity) > LIMIT:
            return False
        if high - low > SHORTEST_PART * short:
            if _crossing_speed(low, before, middle, velocity) > LIMIT:
                parts.append((low, before, middle, velocity))
            if _crossing_speed(middle, velocity, high, after) > LIMIT:
                parts.append((middle, velocity, high, after))
    return True


def _crossing_speed(low: float, before: complex, high: float, after: complex) -> float:
    """Speed where the tangents of a velocity cross, from the side of the acceleration; both ends given with s / d."""
    change = after - before
    way = (change.real + change.imag * high) / (high - low)
    return abs(before + way * complex(-low, 1.0))


def solve_pair(
    missing: Callable[[float, float], Trial], guess: tuple[float, float], tolerance: float, longest: float
) -> tuple[float, float] | None:
    """The two numbers for which nothing is missing: Newton's method, its steps halved while they do not help.

    Args:
        missing: what is missing with two numbers, infinite where they are not allowed, and its slopes.
        guess: the first two numbers.
        tolerance: what may be missing.
        longest: step allowed.

    Returns:
        The numbers; None if it does not converge.
    """
    (x, y), (left, by_x, by_y) = guess, missing(*guess)
    error = abs(left)
    for _ in range(TRIALS):
        if error <= tolerance:
            return x, y
        if not by_x:
            return None
        step, ratio = left / by_x, by_y / by_x
        if not (ratio.imag and math.isfinite(ratio.imag)):
            return None
        dy = -step.imag / ratio.imag
        dx = -step.real - ratio.real * dy
        length = abs(dx) + abs(dy)
        if length <= CONVERGED:
            return x + dx, y + dy
        factor = longest / length if length > longest else 1.0
        left, by_x, by_y = missing(x + factor * dx, y + factor * dy)
        while not abs(left) < error and factor > LEAST_STEP:
            factor /= 2
            left, by_x, by_y = missing(x + factor * dx, y + factor * dy)
        x, y, error = x + factor * dx, y + factor * dy, abs(left)
    return None
