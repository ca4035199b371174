"""Pieces of a time-optimal motion in the plane, each in closed form.

Units: the speed limit V and the acceleration limit A are 1, hence times are in V / A and distances in V^2 / A. By
Pontryagin's maximum principle the costate of the velocity is linear in time, c(t) = -s e + m d n, with e a unit vector,
n its left normal, s the time since the costate was shortest, d that shortest length and m = +-1; the acceleration is
c / |c|.
Where the speed limit holds the velocity, it turns on the circle of the limit (Hartl, Sethi, Vickson, "A survey of the
maximum principles for optimal control problems with state constraints", SIAM Review 37, 1995, section 4).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

Vector = tuple[float, float]
Place = tuple[float, float, float, float]
"""Displacement x, y and velocity x, y."""


@dataclass(frozen=True, slots=True)
class Ramp:
    """Constant acceleration, zero on a stretch of constant velocity."""

    duration: float
    velocity: Vector
    acceleration: Vector = (0.0, 0.0)

    @property
    def case(self) -> str:
        return "ramp" if any(self.acceleration) else "cruise"

    def at(self, time: float) -> Place:
        vx, vy = self.velocity
        ax, ay = self.acceleration
        half = time / 2
        return (vx + ax * half) * time, (vy + ay * half) * time, vx + ax * time, vy + ay * time


@dataclass(frozen=True, slots=True)
class Slide:
    """The velocity turns on the circle of the speed limit, at the full acceleration.

    Attributes:
        heading: of the velocity at the start [rad].
        side: +1 turns counter-clockwise, -1 clockwise.
    """

    case: ClassVar = "slide"
    duration: float
    heading: float
    side: float

    def at(self, time: float) -> Place:
        angle = self.heading + self.side * time
        vx, vy = math.cos(angle), math.sin(angle)
        dx = self.side * (vy - math.sin(self.heading))
        return dx, self.side * (math.cos(self.heading) - vx), vx, vy


@dataclass(frozen=True, slots=True)
class Bend:
    """Full acceleration whose direction turns from e over the side n to -e, as the linear costate does.

    Attributes:
        velocity: at the start.
        direction: of e, as cosine and sine.
        side: m, +1 if the acceleration turns counter-clockwise, else -1.
        shortest: d, positive.
        begin: u at the start, where s = d sinh u.
    """

    case: ClassVar = "bend"
    duration: float
    velocity: Vector
    direction: Vector
    side: float
    shortest: float
    begin: float

    def at(self, time: float) -> Place:
        d, u0 = self.shortest, self.begin
        s0, r0 = d * math.sinh(u0), d * math.cosh(u0)
        s = s0 + time
        r, u = math.hypot(s, d), math.asinh(s / d)
        along = r0 - r
        across = self.side * d * (u - u0)
        x = r0 * time - (s * r - s0 * r0 + d * d * (u - u0)) / 2
        y = self.side * d * (s * (u - u0) + along)
        (c, n), (vx, vy) = self.direction, self.velocity
        return (
            vx * time + c * x - n * y,
            vy * time + n * x + c * y,
            vx + c * along - n * across,
            vy + n * along + c * across,
        )


Arc = Ramp | Slide | Bend


def ramp_between(start: Vector, end: Vector) -> Ramp:
    """The straight change of velocity at full acceleration; with the same velocity at both ends it takes no time."""
    dx, dy = end[0] - start[0], end[1] - start[1]
    duration = math.hypot(dx, dy)
    return Ramp(duration, start, (dx / duration, dy / duration) if duration else (0.0, 0.0))
