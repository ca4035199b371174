"""Pieces of a time-optimal motion in the plane, each in closed form.

Units: the speed limit V and the acceleration limit A are 1, hence times are in V / A and distances in V^2 / A. Vectors
are complex numbers, x + i y: a product turns and scales, and takes one operation where components take six. By
Pontryagin's maximum principle the costate of the velocity is linear in time, c(t) = -s e + m d n, with e a unit vector,
n its left normal, s the time since the costate was shortest, d that shortest length and m = +-1; the acceleration is
c / |c|.
Where the speed limit holds the velocity, it turns on the circle of the limit (Hartl, Sethi, Vickson, "A survey of the
maximum principles for optimal control problems with state constraints", SIAM Review 37, 1995, section 4).
Arcs, chains, ways and plans are not frozen: a new one would take more than twice as long to make. Nobody changes them.
"""

from __future__ import annotations

import cmath
from collections.abc import Iterable
from dataclasses import dataclass
from math import asinh, hypot

Place = tuple[complex, complex]
"""Displacement and velocity."""


@dataclass(slots=True)
class Ramp:
    """Constant acceleration, zero on a stretch of constant velocity."""

    duration: float
    velocity: complex
    acceleration: complex = 0j

    @property
    def case(self) -> str:
        return "ramp" if self.acceleration else "cruise"

    def at(self, time: float) -> Place:
        change = self.acceleration * time
        return (self.velocity + change / 2) * time, self.velocity + change


@dataclass(slots=True)
class Slide:
    """The velocity turns on the circle of the speed limit, at the full acceleration.

    Attributes:
        velocity: at the start.
        side: +1 turns counter-clockwise, -1 clockwise.
    """

    duration: float
    velocity: complex
    side: float

    @property
    def case(self) -> str:
        return "slide"

    def at(self, time: float) -> Place:
        velocity = self.velocity * cmath.rect(1.0, self.side * time)
        return (self.velocity - velocity) * 1j * self.side, velocity


@dataclass(slots=True)
class Bend:
    """Full acceleration whose direction turns from e over the side n to -e, as the linear costate does.

    Attributes:
        velocity: at the start.
        direction: e.
        side: m, +1 if the acceleration turns counter-clockwise, else -1.
        shortest: d, positive.
        begin: s at the start.
    """

    duration: float
    velocity: complex
    direction: complex
    side: float
    shortest: float
    begin: float

    @property
    def case(self) -> str:
        return "bend"

    def at(self, time: float) -> Place:
        side, d, s0 = self.side, self.shortest, self.begin
        s = s0 + time
        r0, r = hypot(s0, d), hypot(s, d)
        along, turned = r0 - r, d * (asinh(s / d) - asinh(s0 / d))
        x = r0 * time - (s * r - s0 * r0 + d * turned) * 0.5
        y = side * (s * turned + d * along)
        velocity, direction = self.velocity, self.direction
        return velocity * time + direction * (x + y * 1j), velocity + direction * (along + side * turned * 1j)


Arc = Ramp | Slide | Bend


@dataclass(slots=True)
class Chain:
    """Arcs one after the other.

    Attributes:
        arcs: none without a duration.
        places: at the start of each arc and at the end of the last.
        times: of the places.
    """

    arcs: list[Arc]
    places: list[Place]
    times: list[float]

    @property
    def duration(self) -> float:
        return self.times[-1]


def chain(start: complex, arcs: Iterable[Arc]) -> Chain:
    """The arcs with their places, from a velocity on."""
    way, velocity, time = 0j, start, 0.0
    lasting: list[Arc] = []
    places, times = [(way, velocity)], [time]
    for arc in arcs:
        duration = arc.duration
        if duration > 0.0:
            displacement, velocity = arc.at(duration)
            way += displacement
            time += duration
            lasting.append(arc)
            places.append((way, velocity))
            times.append(time)
    return Chain(lasting, places, times)


def ramp_between(start: complex, end: complex) -> Ramp:
    """The straight change of velocity at full acceleration; with the same velocity at both ends it takes no time."""
    change = end - start
    duration = abs(change)
    return Ramp(duration, start, change / duration if duration else 0j)
