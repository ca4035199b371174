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
from daemon.loops.planner_bend import bend, corner, ramps, top_speed
from daemon.loops.planner_cruise import cruise, half_ramp, half_turn, ramp_arcs, turn_arcs

PRECISE: Final = 1e-11
"""Largest miss of an accepted way, relative to 1 + its length."""
IN_LINE: Final = 1e-13
"""Sine of the angle below which two vectors lie on one line."""


def fastest_way(travel: Vector, start: Vector, end: Vector) -> tuple[str, Sequence[Arc]]:
    """The shape and the arcs of the fastest way.

    Args:
        travel: displacement to the goal.
        start: velocity now, |start| <= 1.
        end: velocity at the goal, |end| <= 1.
    """
    precise = PRECISE * (1 + math.hypot(*travel))
    for shape, arcs in _ways(travel, start, end):
        if arcs and misses(arcs, travel, end) <= precise:
            return shape, arcs
    return "stop and go", stop_and_go(travel, start, end)


def _ways(travel: Vector, start: Vector, end: Vector) -> Iterator[tuple[str, Sequence[Arc] | None]]:
    """The fastest first; not every one exists."""
    yield "line", in_line(travel, start, end)
    via = corner(travel, start, end)
    if via is None:
        return
    heading, too_fast = math.atan2(via[1], via[0]), math.hypot(*via) > 1
    if too_fast and (found := cruise(half_turn, travel, start, end, heading)):
        yield "turns", turn_arcs(start, end, *found)
    if (arc := bend(travel, start, end, via)) and top_speed(arc) <= 1 + PRECISE:
        yield "bend", [arc]
    if not too_fast:
        yield "ramps", ramps(start, end, via)
    elif found := cruise(half_ramp, travel, start, end, heading):
        yield "ramps", ramp_arcs(start, end, *found)


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
