"""The fastest way in the plane from one velocity to a place and another velocity.

Units as in planner_arcs. Three shapes are optimal: along a line, one bend, and two turns with a cruise between them.
Where the optimum would touch the speed limit without a cruise, straight changes of velocity stand in for it.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from typing import Final

from daemon.loops.planner_arcs import Arc, Ramp, Vector, ramp_between
from daemon.loops.planner_axis import fastest
from daemon.loops.planner_bend import bend, bends, corner, ramps, top_speed
from daemon.loops.planner_cruise import cruise, half_ramp, half_turn, ramp_arcs, turn_arcs

PRECISE: Final = 1e-11
"""Largest miss of an accepted way, relative to 1 + its length."""
LIKELY: Final = 1.1
"""A way that takes no more than this longer than a lower bound is taken for the fastest without a wider search."""
MAY_CRUISE: Final = 0.7
"""Speed of the corner above which a cruise at the speed limit is sought."""
CRUISES: Final = 0.999
"""Speed at the start above which its heading may be that of the cruise."""
SAME: Final = 1e-6
"""Distance of two corners that are one."""
IN_LINE: Final = 1e-13
"""Sine of the angle below which two vectors lie on one line."""


def fastest_way(travel: Vector, start: Vector, end: Vector, near: float = 0.0) -> tuple[str, Sequence[Arc]]:
    """The shape and the arcs of the fastest way.

    Args:
        travel: displacement to the goal.
        start: velocity now, |start| <= 1.
        end: velocity at the goal, |end| <= 1.
        near: a straight change of velocity that ends as near to the goal as this is taken as the way.
    """
    if straight := in_line(travel, start, end):
        return "line", straight
    direct = [ramp_between(start, end)]
    if misses(direct, travel, end) <= near:
        return "ramp", direct
    precise = PRECISE * (1 + math.hypot(*travel))
    best: tuple[str, Sequence[Arc]] = "stop and go", stop_and_go(travel, start, end)
    least, enough = duration(best[1]), LIKELY * least_time(travel, start, end)
    for shape, arcs in _ways(travel, start, end):
        if (time := duration(arcs)) < least and misses(arcs, travel, end) <= precise:
            least, best = time, (shape, arcs)
        if least <= enough:
            break
    return best


def _ways(travel: Vector, start: Vector, end: Vector) -> Iterator[tuple[str, Sequence[Arc]]]:
    """Ways that exist, the likely ones first."""
    middle = (start[0] + end[0]) / 2, (start[1] + end[1]) / 2
    root = math.sqrt(math.hypot(*travel)) or 1.0
    if math.hypot(*start) > CRUISES and (
        found := cruise(half_turn, travel, start, end, math.atan2(start[1], start[0]))
    ):
        yield "turns", turn_arcs(start, end, *found)
    known: list[Vector] = []
    for guess in (travel[0] / root, travel[1] / root), middle, (-middle[0], -middle[1]):
        via = corner(travel, start, end, guess)
        if via and all(math.dist(via, other) > SAME for other in known):
            known.append(via)
            yield from _ways_near(travel, start, end, via)
    for arc in bends(travel, start, end):
        if top_speed(arc) <= 1 + PRECISE:
            yield "bend", [arc]


def _ways_near(travel: Vector, start: Vector, end: Vector, via: Vector) -> Iterator[tuple[str, Sequence[Arc]]]:
    """Ways like two straight changes of velocity by a corner."""
    heading, speed = math.atan2(via[1], via[0]), math.hypot(*via)
    if speed > MAY_CRUISE and (found := cruise(half_turn, travel, start, end, heading)):
        yield "turns", turn_arcs(start, end, *found)
    if (arc := bend(travel, start, end, via)) and top_speed(arc) <= 1 + PRECISE:
        yield "bend", [arc]
    if speed <= 1:
        yield "ramps", ramps(start, end, via)
    elif found := cruise(half_ramp, travel, start, end, heading):
        yield "ramps", ramp_arcs(start, end, *found)


def least_time(travel: Vector, start: Vector, end: Vector) -> float:
    """A time that no way can be faster than: that of one axis alone, the longest of three directions."""
    change = end[0] - start[0], end[1] - start[1]
    length = math.hypot(*change)
    x, y = travel[0] - (start[0] + end[0]) / 2 * length, travel[1] - (start[1] + end[1]) / 2 * length
    least = length
    for vx, vy in travel, (x, y):
        size = math.hypot(vx, vy) or 1.0
        way, first, last = ((vx * ax + vy * ay) / size for ax, ay in (travel, start, end))
        least = max(least, fastest(way, first, last, 1.0, 1.0).duration)
    return least


def duration(arcs: Iterable[Arc]) -> float:
    return math.fsum(arc.duration for arc in arcs)


def misses(arcs: Iterable[Arc], travel: Vector, end: Vector) -> float:
    """How far the end of the arcs is from the displacement or from the velocity, whichever is farther."""
    x = y = 0.0
    vx, vy = end
    for arc in arcs:
        dx, dy, vx, vy = arc.at(arc.duration)
        x += dx
        y += dy
    return max(abs(x - travel[0]), abs(y - travel[1]), abs(vx - end[0]), abs(vy - end[1]))


def in_line(travel: Vector, start: Vector, end: Vector) -> list[Arc] | None:
    """Along one line, if the travel and both velocities lie on it."""
    x, y = max(travel, start, end, key=lambda vector: math.hypot(*vector))
    length = math.hypot(x, y)
    if length == 0.0:
        return [Ramp(0.0, start)]
    x, y = x / length, y / length
    if any(abs(x * v - y * u) > IN_LINE * math.hypot(u, v) for u, v in (travel, start, end)):
        return None
    return _on_line((x, y), *(x * u + y * v for u, v in (travel, start, end)))


def stop_and_go(travel: Vector, start: Vector, end: Vector) -> list[Arc]:
    """Brake, go straight to where a straight run-up begins, run up: slow, but it exists always."""
    brake, run_up = ramp_between(start, (0.0, 0.0)), ramp_between((0.0, 0.0), end)
    x = travel[0] - (start[0] * brake.duration + end[0] * run_up.duration) / 2
    y = travel[1] - (start[1] * brake.duration + end[1] * run_up.duration) / 2
    way = math.hypot(x, y)
    line = _on_line((x / way, y / way), way, 0.0, 0.0) if way else []
    return [brake, *line, run_up]


def _on_line(direction: Vector, travel: float, start: float, end: float) -> list[Arc]:
    x, y = direction
    arcs: list[Arc] = []
    speed = start
    for duration, rate in fastest(travel, start, end, 1.0, 1.0).pieces:
        arcs.append(Ramp(duration, (speed * x, speed * y), (rate * x, rate * y)))
        speed += rate * duration
    return arcs
