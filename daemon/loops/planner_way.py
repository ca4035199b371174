"""A way in the plane in SI units, the fastest one or one that lasts as long as another motion."""

from __future__ import annotations

import math
from bisect import bisect_right
from dataclasses import dataclass
from typing import Final

from daemon.loops.planner_arcs import Chain, Place, Ramp, chain, ramp_between
from daemon.loops.planner_paths import fastest_way, stop_and_go

AT_ONCE: Final = 1e-9
"""Difference of two durations, relative to them, that counts as none."""
TRIALS: Final = 45
GENTLEST: Final = 1e-5
"""Smallest part of the acceleration that is tried to make a way last longer.

The unit of length grows as the acceleration shrinks, and a way may miss its goal by a share of that unit."""


@dataclass(slots=True)
class Way:
    """Arcs one after the other.

    Attributes:
        shape: what the arcs are together.
        speed: limit in force [m/s].
        acceleration: limit in force [m/s2].
        chain: the arcs, in units of the limits.
    """

    shape: str
    speed: float
    acceleration: float
    chain: Chain

    @property
    def duration(self) -> float:
        """[s]."""
        return self.chain.times[-1] * self.speed / self.acceleration

    def case(self, time: float) -> str:
        """Name of the arc in force."""
        index = self._index(time * self.acceleration / self.speed)
        return self.chain.arcs[index].case if index < len(self.chain.arcs) else "end"

    def at(self, time: float) -> Place:
        """Displacement [m] and velocity [m/s] at a time [s]; after the end the last velocity is held."""
        speed, acceleration, arcs = self.speed, self.acceleration, self.chain.arcs
        now = time * acceleration / speed
        index = self._index(now)
        displacement, velocity = self.chain.places[index]
        since = now - self.chain.times[index]
        if index < len(arcs):
            further, velocity = arcs[index].at(since)
        else:
            further = velocity * since
        return (displacement + further) * (speed * speed / acceleration), velocity * speed

    def _index(self, time: float) -> int:
        """Of the arc at a time in units of the limits."""
        return bisect_right(self.chain.times, time, 1) - 1


def fastest(travel: complex, start: complex, end: complex, speed: float, acceleration: float, near: float = 0.0) -> Way:
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
    goal, raw, final = travel / length, start / speed, end / speed
    if abs(raw) <= 1.0 and abs(final) <= 1.0:
        shape, arcs = fastest_way(goal, raw, final, near / length)
        return Way(shape, speed, acceleration, arcs)
    begin = _within(raw)
    slowing = ramp_between(raw, begin)
    braked, _ = slowing.at(slowing.duration)
    shape, onward = fastest_way(goal - braked, begin, _within(final), near / length)
    return Way(shape, speed, acceleration, chain(raw, [slowing, *onward.arcs]))


def braking(start: complex, speed: float, acceleration: float) -> Way:
    """The straight way to rest."""
    raw = start / speed
    return Way("stop", speed, acceleration, chain(raw, [ramp_between(raw, 0j)]))


def lasting(way: Way, travel: complex, start: complex, end: complex, duration: float) -> Way:
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


def _with_a_rest(way: Way, travel: complex, start: complex, end: complex, duration: float) -> Way:
    """Brake, rest, go: for a way that hardly has to change, which no acceleration makes last."""
    speed, acceleration = way.speed, way.acceleration
    raw = start / speed
    brake, *onward = stop_and_go(travel * acceleration / (speed * speed), raw, end / speed)
    unrested = math.fsum(arc.duration for arc in (brake, *onward))
    rest = Ramp(max(0.0, duration * acceleration / speed - unrested), 0j)
    return Way("stop and go", speed, acceleration, chain(raw, [brake, rest, *onward]))


def _within(velocity: complex) -> complex:
    """The velocity, in units of the limit, shortened to the limit."""
    length = abs(velocity)
    return velocity / length if length > 1 else velocity
