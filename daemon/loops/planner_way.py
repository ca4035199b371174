"""A way in the plane in SI units, the fastest one or one that lasts as long as another motion."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from daemon.loops.planner_arcs import Arc, Place, Ramp, Vector, ramp_between
from daemon.loops.planner_paths import fastest_way, stop_and_go

AT_ONCE: Final = 1e-9
"""Difference of two durations, relative to them, that counts as none."""
TRIALS: Final = 45
GENTLEST: Final = 1e-12
"""Smallest part of the acceleration that is tried to make a way last longer."""


@dataclass(frozen=True, slots=True)
class Way:
    """Arcs one after the other.

    Attributes:
        shape: what the arcs are together.
        speed: limit in force [m/s].
        acceleration: limit in force [m/s2].
        arcs: in units of the limits.
        places: displacement and velocity at the start of each arc and at the end of the last, in the same units.
        times: of the places [s].
    """

    shape: str
    speed: float
    acceleration: float
    arcs: tuple[Arc, ...]
    places: tuple[Place, ...]
    times: tuple[float, ...]

    @property
    def duration(self) -> float:
        return self.times[-1]

    def case(self, time: float) -> str:
        """Name of the arc in force."""
        index = self._index(time)
        return self.arcs[index].case if index < len(self.arcs) else "end"

    def at(self, time: float) -> Place:
        """Displacement [m] and velocity [m/s] at a time [s]; after the end the last velocity is held."""
        index = self._index(time)
        x, y, vx, vy = self.places[index]
        unit = self.speed / self.acceleration
        since = (time - self.times[index]) / unit
        if index < len(self.arcs):
            dx, dy, vx, vy = self.arcs[index].at(since)
        else:
            dx, dy = vx * since, vy * since
        length = self.speed * unit
        return (x + dx) * length, (y + dy) * length, vx * self.speed, vy * self.speed

    def _index(self, time: float) -> int:
        last = len(self.arcs)
        for index in range(last):
            if time < self.times[index + 1]:
                return index
        return last


def fastest(travel: Vector, start: Vector, end: Vector, speed: float, acceleration: float, near: float = 0.0) -> Way:
    """The fastest way; a start above the speed limit is braked to it first, straight.

    Args:
        travel: displacement to the goal [m].
        start: velocity now [m/s].
        end: velocity at the goal [m/s], within the limit.
        speed: limit [m/s].
        acceleration: limit [m/s2].
        near: a straight change of velocity that ends as near to the goal as this [m] is taken as the way.
    """
    length = speed * speed / acceleration
    x, y = travel[0] / length, travel[1] / length
    begin, final = _within(start, speed), _within(end, speed)
    raw = start[0] / speed, start[1] / speed
    if begin == raw:
        shape, arcs = fastest_way((x, y), begin, final, near / length)
        return _way(shape, speed, acceleration, raw, arcs)
    slowing = ramp_between(raw, begin)
    dx, dy, _, _ = slowing.at(slowing.duration)
    shape, arcs = fastest_way((x - dx, y - dy), begin, final, near / length)
    return _way(shape, speed, acceleration, raw, [slowing, *arcs])


def braking(start: Vector, speed: float, acceleration: float) -> Way:
    """The straight way to rest."""
    raw = start[0] / speed, start[1] / speed
    return _way("stop", speed, acceleration, raw, [ramp_between(raw, (0.0, 0.0))])


def lasting(way: Way, travel: Vector, start: Vector, end: Vector, duration: float) -> Way:
    """The way with an acceleration so low that it lasts as long as asked for, or the next longer duration there is.

    Regula falsi on the logarithms of acceleration and duration; every third trial halves, as the duration may jump.

    Args:
        way: the fastest way.
        travel, start, end: of the way, as in `fastest`.
        duration: at least of the result [s].
    """
    if way.duration >= duration:
        return way
    quick, slow = way, way
    while slow.duration < duration:
        if slow.acceleration < way.acceleration * GENTLEST:
            return _with_a_rest(way, travel, start, end, duration)
        quick, slow = slow, fastest(travel, start, end, way.speed, slow.acceleration / 4)
    for trial in range(TRIALS):
        if slow.duration <= duration * (1 + AT_ONCE):
            break
        excess = math.log(slow.duration / duration) - AT_ONCE / 2
        part = 0.5 if trial % 3 == 2 else excess / math.log(slow.duration / (quick.duration or slow.duration / 2))
        between = slow.acceleration * (quick.acceleration / slow.acceleration) ** part
        middle = fastest(travel, start, end, way.speed, between)
        quick, slow = (quick, middle) if middle.duration >= duration else (middle, slow)
    return slow


def _with_a_rest(way: Way, travel: Vector, start: Vector, end: Vector, duration: float) -> Way:
    """Brake, rest, go: for a way that hardly has to change, which no acceleration makes last."""
    speed, acceleration = way.speed, way.acceleration
    length = speed * speed / acceleration
    raw = start[0] / speed, start[1] / speed
    brake, *onward = stop_and_go((travel[0] / length, travel[1] / length), raw, (end[0] / speed, end[1] / speed))
    unrested = math.fsum(arc.duration for arc in (brake, *onward))
    rest = Ramp(max(0.0, duration * acceleration / speed - unrested), (0.0, 0.0))
    return _way("stop and go", speed, acceleration, raw, [brake, rest, *onward])


def _within(velocity: Vector, speed: float) -> Vector:
    """The velocity in units of the limit, shortened to the limit."""
    x, y = velocity[0] / speed, velocity[1] / speed
    length = math.hypot(x, y)
    return (x / length, y / length) if length > 1 else (x, y)


def _way(shape: str, speed: float, acceleration: float, velocity: Vector, arcs: Sequence[Arc]) -> Way:
    lasting_arcs = tuple(arc for arc in arcs if arc.duration > 0)
    x = y = time = 0.0
    vx, vy = velocity
    places, times = [(x, y, vx, vy)], [time]
    for arc in lasting_arcs:
        dx, dy, vx, vy = arc.at(arc.duration)
        x, y, time = x + dx, y + dy, time + arc.duration
        places.append((x, y, vx, vy))
        times.append(time * speed / acceleration)
    return Way(shape, speed, acceleration, lasting_arcs, tuple(places), tuple(times))
