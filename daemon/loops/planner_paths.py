"""The fastest way in the plane from one velocity to a place and another velocity.

Units and vectors as in planner_arcs. Three shapes are optimal: along a line, one bend, and two turns with a cruise
between them. Where the optimum would touch the speed limit without a cruise, straight changes of velocity stand in for
it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Final

from daemon.loops.planner_arcs import Arc, Bend, Chain, Ramp, chain, ramp_between
from daemon.loops.planner_axis import fastest, least_duration
from daemon.loops.planner_bend import bend, bends, corner, keeps_limit, leads_farthest, ramps
from daemon.loops.planner_cruise import cruise, half_ramp, half_turn, ramp_arcs, turn_arcs

Shaped = tuple[str, Sequence[Arc], bool]
"""Name of a shape, its arcs, and whether no way is faster."""

PRECISE: Final = 1e-11
"""Largest miss of an accepted way, relative to 1 + its length."""
LIKELY: Final = 1.1
"""A way that takes no more than this longer than a lower bound is taken for the fastest without a wider search."""
MAY_CRUISE: Final = 0.7
"""Speed of the corner above which a cruise at the speed limit is sought."""
LIKELY_CRUISE: Final = 1.05
"""Speed of the corner above which a cruise is more likely than a bend within the speed limit."""
FAR: Final = 1.8
"""Travel from which on there is nearly always room for a cruise."""
CRUISES: Final = 0.999
"""Speed at the start above which its heading may be that of the cruise."""
ROUGH: Final = 0.3
"""Last step to a corner, relative to its speed, from which the search for a smooth way begins."""
SAME: Final = 1e-2
"""Distance of two corners that are one."""
IN_LINE: Final = 1e-13
"""Sine of the angle below which two vectors lie on one line."""


def fastest_way(travel: complex, start: complex, end: complex, near: float = 0.0) -> tuple[str, Chain]:
    """The shape and the arcs of the fastest way.

    Args:
        travel: displacement to the goal.
        start: velocity now, |start| <= 1.
        end: velocity at the goal, |end| <= 1.
        near: a straight change of velocity that ends as near to the goal as this is taken as the way.
    """
    if straight := in_line(travel, start, end):
        return "line", chain(start, straight)
    if abs((start + end) / 2 * abs(end - start) - travel) <= near:
        return "ramp", chain(start, [ramp_between(start, end)])
    precise = PRECISE * (1.0 + abs(travel))
    best: tuple[str, Chain] | None = None
    for shape, arcs, surely in _ways(travel, start, end):
        way = chain(start, arcs)
        if (best is None or way.duration < best[1].duration) and misses(way, travel, end) <= precise:
            best = shape, way
            if surely or any(way.duration <= LIKELY * least for least in _least_times(travel, start, end)):
                return best
    slow = chain(start, stop_and_go(travel, start, end))
    return best if best and best[1].duration <= slow.duration else ("stop and go", slow)


def _ways(travel: complex, start: complex, end: complex) -> Iterator[Shaped]:
    """Ways that may exist, the likely ones first."""
    size, begun = abs(travel), abs(start)
    if size > FAR:
        toward = travel / size
        left = travel - ((start + toward) * abs(toward - start) + (toward + end) * abs(toward - end)) / 2
        yield from _turns(travel, start, end, left)
    if begun > CRUISES:
        yield from _turns(travel, start, end, start)
    known: list[complex] = []
    middle, ended = (start + end) / 2, abs(end)
    peak = math.sqrt(size + (begun * begun + ended * ended) * 0.5)
    toward = travel - peak * middle
    for guess in toward * (peak / (abs(toward) or 1.0)), travel * (peak / (size or 1.0)), middle, -middle:
        via = corner(travel, start, end, guess, ROUGH * peak)
        if via is None or (known and min(abs(via - other) for other in known) <= SAME):
            continue
        known.append(via)
        speed = abs(via)
        if speed > LIKELY_CRUISE:
            yield from _turns(travel, start, end, via)
        if arc := bend(travel, start, end, via):
            yield from _bend(arc, travel, end)
        if MAY_CRUISE < speed <= LIKELY_CRUISE:
            yield from _turns(travel, start, end, via)
        yield from _ways_by(travel, start, end, via, not arc)
    for arc in bends(travel, start, end):
        yield from _bend(arc, travel, end)


def _ways_by(travel: complex, start: complex, end: complex, via: complex, unbent: bool) -> Iterator[Shaped]:
    """Straight changes of velocity by the exact corner, or with a cruise; the bend near it, if there was none yet."""
    exact = corner(travel, start, end, via)
    if exact is not None and unbent and (arc := bend(travel, start, end, exact)):
        yield from _bend(arc, travel, end)
    if exact is not None and abs(exact) <= 1:
        yield "ramps", ramps(start, end, exact), False
    elif via and (found := cruise(half_ramp, travel, start, end, via / abs(via))):
        yield "ramps", ramp_arcs(travel, start, end, found), False


def _bend(arc: Bend, travel: complex, end: complex) -> list[Shaped]:
    """The bend, if it keeps the speed limit."""
    return [("bend", [arc], leads_farthest(arc, travel, end))] if keeps_limit(arc, end) else []


def _turns(travel: complex, start: complex, end: complex, heading: complex) -> list[Shaped]:
    """Two turns with a cruise near a heading; they lead along it as far as any motion of their duration can.

    So one that is shorter could not have a velocity along it at any time: held for what is left, it would lead farther.
    """
    found = cruise(half_turn, travel, start, end, heading / abs(heading)) if heading else None
    if found and (arcs := turn_arcs(travel, start, end, found)):
        heading, _, _ = found
        return [("turns", arcs, (travel * heading.conjugate()).real > 0.0)]
    return []


def _least_times(travel: complex, start: complex, end: complex) -> Iterator[float]:
    """Times that no way can be faster than: those of one axis alone in two directions, and that of the velocity."""
    missed = travel - (start + end) / 2 * abs(end - start)
    for direction in travel, missed:
        back = direction.conjugate() / (abs(direction) or 1.0)
        yield least_duration((travel * back).real, (start * back).real, (end * back).real, 1.0, 1.0)
    yield abs(end - start)


def misses(way: Chain, travel: complex, end: complex) -> float:
    """How far the end of the way is from the displacement or from the velocity, whichever is farther."""
    displacement, velocity = way.places[-1]
    return max(abs(displacement - travel), abs(velocity - end))


def in_line(travel: complex, start: complex, end: complex) -> list[Arc] | None:
    """Along one line, if the travel and both velocities lie on it."""
    if abs((travel.conjugate() * start).imag) > IN_LINE * abs(travel) * abs(start):
        return None
    longest = max(travel, start, end, key=abs)
    if not longest:
        return [Ramp(0.0, start)]
    direction = longest / abs(longest)
    back = direction.conjugate()
    way, first, last = travel * back, start * back, end * back
    if any(abs(along.imag) > IN_LINE * abs(along) for along in (way, first, last)):
        return None
    return _on_line(direction, way.real, first.real, last.real)


def stop_and_go(travel: complex, start: complex, end: complex) -> list[Arc]:
    """Brake, go straight to where a straight run-up begins, run up: slow, but it exists always."""
    brake, run_up = ramp_between(start, 0j), ramp_between(0j, end)
    left = travel - (start * brake.duration + end * run_up.duration) / 2
    way = abs(left)
    line = _on_line(left / way, way, 0.0, 0.0) if way else []
    return [brake, *line, run_up]


def _on_line(direction: complex, travel: float, start: float, end: float) -> list[Arc]:
    arcs: list[Arc] = []
    speed = start
    for duration, rate in fastest(travel, start, end, 1.0, 1.0).pieces:
        arcs.append(Ramp(duration, speed * direction, rate * direction))
        speed += rate * duration
    return arcs
