"""Motions in the plane without a cruise: two straight changes of velocity, and the optimal bend near them.

Units as in planner_arcs.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Final

from daemon.loops.planner_arcs import Bend, Ramp, Vector, ramp_between

ROUNDING: Final = 1e-12
STRAIGHT: Final = 1e-9
"""Below this length of the shortest costate, relative to the duration, a bend is two straight changes of velocity."""
TRIALS: Final = 15
LEAST_STEP: Final = 1e-1
"""Part of a Newton step that is taken even where it does not help."""
RATIOS: Final = 1.2, 1.6, 3.0
"""Lengths of the costate at the end of a bend over that at its start, tried as guesses."""


def corner(travel: Vector, start: Vector, end: Vector, guess: Vector) -> Vector | None:
    """The velocity between two straight changes of velocity that cover the travel, however high it is.

    There is more than one where a fast goal is so near that it is passed and met again.
    """
    (px, py), (ax, ay), (bx, by) = travel, start, end

    def missing(x: float, y: float) -> Vector:
        first, last = math.hypot(x - ax, y - ay), math.hypot(bx - x, by - y)
        return px - ((ax + x) * first + (bx + x) * last) / 2, py - ((ay + y) * first + (by + y) * last) / 2

    way = math.hypot(px, py)
    return solve_pair(missing, guess, ROUNDING * (way + math.hypot(ax, ay, bx, by) ** 2), math.sqrt(way) + 1.0)


def ramps(start: Vector, end: Vector, via: Vector) -> list[Ramp]:
    """Two straight changes of velocity."""
    return [ramp_between(start, via), ramp_between(via, end)]


def bend(travel: Vector, start: Vector, end: Vector, via: Vector) -> Bend | None:
    """The bend that covers the travel; None if there is none, or none that differs from a straight line.

    The first guess takes the linear costate that points along the two straight changes of velocity at their middles.

    Args:
        travel: displacement to the goal.
        start: velocity at the start.
        end: velocity at the goal.
        via: the corner.
    """
    fx, fy, lx, ly = via[0] - start[0], via[1] - start[1], end[0] - via[0], end[1] - via[1]
    first, duration = math.hypot(fx, fy), math.hypot(fx, fy) + math.hypot(lx, ly)
    turn, change = fx * ly - fy * lx, math.hypot(lx - fx, ly - fy)
    if abs(turn) <= STRAIGHT * change * change or start == end:
        return None
    scale = duration / 2 / (change * change)
    shortest, begin = abs(turn) * scale, (fx * (lx - fx) + fy * (ly - fy)) * scale - first / 2
    side = math.copysign(1.0, turn)
    guess = math.asinh(begin / shortest), math.asinh((begin + duration) / shortest)
    return _bend_near(travel, start, end, side, guess)


def bends(travel: Vector, start: Vector, end: Vector) -> Iterator[Bend]:
    """Bends without a corner to begin from, as where little more than a straight change of velocity is left to do.

    What that change misses tells the side; the turn that makes up for it, 12 / length^2 of the miss, is tried as the
    first, the middle and the last part of a bend.
    """
    x, y = end[0] - start[0], end[1] - start[1]
    length = math.hypot(x, y)
    if not length:
        return
    missed = travel[0] - (start[0] + end[0]) / 2 * length, travel[1] - (start[1] + end[1]) / 2 * length
    across = (x * missed[1] - y * missed[0]) / length
    turn = min(1.0, 12 * abs(across) / (length * length)) or 1.0
    for ratio in RATIOS:
        near, far = math.asinh((1 - 1 / ratio) / turn), math.log(ratio)
        for guess in (near, near + far), (-near - far, -near), (-far, far):
            if arc := _bend_near(travel, start, end, -math.copysign(1.0, across), guess):
                yield arc


def _bend_near(travel: Vector, start: Vector, end: Vector, side: float, guess: Vector) -> Bend | None:
    (px, py), (vx, vy) = travel, start
    dx, dy = end[0] - vx, end[1] - vy
    change = math.hypot(dx, dy)

    def missing(u0: float, u1: float) -> Vector:
        """The travel less that of `bend_between`, without the bend: in units of its shortest costate d."""
        if not -MOST < u0 < u1 < MOST:
            return math.inf, math.inf
        s0, r0, s1, r1 = math.sinh(u0), math.cosh(u0), math.sinh(u1), math.cosh(u1)
        turned, time = u1 - u0, s1 - s0
        along, across = 2 * math.sinh((u0 - u1) / 2) * math.sinh((u0 + u1) / 2), side * turned
        square = along * along + across * across
        d = change / math.sqrt(square)
        x, y = r0 * time - (s1 * r1 - s0 * r0 + turned) / 2, side * (s1 * turned + along)
        c, n = (dx * along + dy * across) / square, (dy * along - dx * across) / square
        return px - d * (vx * time + c * x - n * y), py - d * (vy * time + n * x + c * y)

    ends = solve_pair(missing, guess, ROUNDING * (math.hypot(*travel) + change * change), 1.5)
    return bend_between(start, end, side, *ends) if ends else None


MOST: Final = 40.0
"""Highest |u| of a bend: there its costate is 1e17 times longer than at its shortest."""


def bend_between(start: Vector, end: Vector, side: float, u0: float, u1: float) -> Bend:
    """The bend from u0 to u1, scaled and turned so that it leads from one velocity to the other."""
    along = 2 * math.sinh((u0 - u1) / 2) * math.sinh((u0 + u1) / 2)
    across = side * (u1 - u0)
    length = along * along + across * across
    x, y = end[0] - start[0], end[1] - start[1]
    shortest = math.hypot(x, y) / math.sqrt(length)
    scale = 1.0 / (shortest * length)
    direction = (x * along + y * across) * scale, (y * along - x * across) * scale
    return Bend(shortest * (math.sinh(u1) - math.sinh(u0)), start, direction, side, shortest, u0)


def top_speed(arc: Bend) -> float:
    """The highest speed within a bend, or 1 where it is certainly no higher.

    The velocity keeps to one side of its tangents at both ends, so where they cross within the limit, all of it is.
    Else it is found where speed stops to rise between two samples, by bisection.
    """
    if _crossing_speed(arc) <= 1.0:
        return 1.0
    samples = [arc.duration * k / SAMPLES for k in range(SAMPLES + 1)]
    rises = [_speed_rises(arc, time) for time in samples]
    tops = [samples[0], samples[-1]]
    for low, high, rose, rises_still in zip(samples, samples[1:], rises, rises[1:], strict=False):
        if rose and not rises_still:
            for _ in range(20):
                middle = (low + high) / 2
                low, high = (middle, high) if _speed_rises(arc, middle) else (low, middle)
            tops.append(low)
    return max(math.hypot(*arc.at(time)[2:]) for time in tops)


def _crossing_speed(arc: Bend) -> float:
    """Speed where the tangents of the velocity at both ends of a bend cross."""
    _, _, ex, ey = arc.at(arc.duration)
    (vx, vy), (ax, ay), (bx, by) = arc.velocity, _costate(arc, 0.0), _costate(arc, arc.duration)
    turning = ax * by - ay * bx
    if turning == 0.0:
        return math.inf
    way = ((ex - vx) * by - (ey - vy) * bx) / turning
    return max(math.hypot(vx, vy), math.hypot(ex, ey), math.hypot(vx + way * ax, vy + way * ay))


def _costate(arc: Bend, time: float) -> Vector:
    """In the direction of the acceleration."""
    s = arc.shortest * math.sinh(arc.begin) + time
    (c, n), d = arc.direction, arc.side * arc.shortest
    return -s * c - d * n, d * c - s * n


SAMPLES: Final = 16


def _speed_rises(arc: Bend, time: float) -> bool:
    """Whether velocity and costate point the same way."""
    _, _, vx, vy = arc.at(time)
    x, y = _costate(arc, time)
    return vx * x + vy * y > 0


def solve_pair(
    missing: Callable[[float, float], Vector], guess: Vector, tolerance: float, longest: float
) -> Vector | None:
    """The two numbers for which nothing is missing: Newton's method, its steps halved while they do not help.

    Args:
        missing: what is missing with two numbers; infinite where they are not allowed.
        guess: the first two numbers.
        tolerance: what may be missing.
        longest: step allowed.

    Returns:
        The numbers; None if it does not converge.
    """
    (x, y), (rx, ry) = guess, missing(*guess)
    for _ in range(TRIALS):
        error = math.hypot(rx, ry)
        if error <= tolerance:
            return x, y
        h = 1e-7 * (1 + abs(x) + abs(y))
        (ax, ay), (bx, by) = missing(x + h, y), missing(x, y + h)
        xx, yx, xy, yy = (rx - ax) / h, (ry - ay) / h, (rx - bx) / h, (ry - by) / h
        determinant = xx * yy - xy * yx
        if determinant == 0.0 or not math.isfinite(determinant):
            return None
        dx, dy = (rx * yy - ry * xy) / determinant, (xx * ry - yx * rx) / determinant
        factor = min(1.0, longest / (math.hypot(dx, dy) or 1.0))
        rx, ry = missing(x + factor * dx, y + factor * dy)
        while not math.hypot(rx, ry) < error and factor > LEAST_STEP:
            factor /= 2
            rx, ry = missing(x + factor * dx, y + factor * dy)
        x, y = x + factor * dx, y + factor * dy
    return None
