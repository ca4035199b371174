"""A semi-trailer that rolls without slip, derived from the velocities of its points and integrated numerically.

It shares no formula with the loops: the front wheels' direction gives the truck's yaw rate, the hitch's velocity across
the trailer the trailer's.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

from daemon.loops.articulated import ArticulatedVehicle, Hitch
from daemon.loops.odometry import Pose
from daemon.loops.path import Piece

SEMITRAILER: Final = ArticulatedVehicle(0.215, (Hitch(-0.013, 0.615),), math.radians(32))
LINE_BACKWARDS: Final = Piece(0.0, 0.0, math.pi, math.inf, 0.0, backward=True)
CIRCLE_BACKWARDS: Final = Piece(0.0, -1.0, math.pi, math.inf, -1.0, backward=True)
"""A circle of 1 m about the origin, clockwise: its centre is to the left of the heading."""

State = tuple[float, float, float, float]
"""Truck's rear axle x, y; headings of truck and trailer."""


def forwards(piece: Piece) -> Piece:
    """The same line or circle, driven the other way."""
    return Piece(piece.x_m, piece.y_m, piece.direction_rad - math.pi, math.inf, -piece.curvature)


@dataclass(frozen=True)
class Errors:
    """Initial errors [m, rad]: to the left on a line and to the outside on a circle, headings to the left."""

    position_m: float = 0.0
    heading_rad: float = 0.0
    bending_rad: float = 0.0


class SemitrailerPlant:
    """The vehicle between commands: constant speed, steering that slews to what was commanded last.

    Attributes:
        state: now.
        steering_rad: of the front wheels, now.
    """

    def __init__(self, state: State, steering_rad: float, rate_rad_s: float | None = None) -> None:
        self.state, self.steering_rad, self._rate = state, steering_rad, rate_rad_s

    @property
    def truck(self) -> Pose:
        """Pose of the truck's rear axle."""
        return Pose(*self.state[:3])

    @property
    def trailer(self) -> Pose:
        """Pose of the trailer's axle."""
        x, y, truck, trailer = self.state
        hitch = SEMITRAILER.hitches[0]
        return Pose(
            x - hitch.offset_m * math.cos(truck) - hitch.length_m * math.cos(trailer),
            y - hitch.offset_m * math.sin(truck) - hitch.length_m * math.sin(trailer),
            trailer,
        )

    @property
    def bending_rad(self) -> float:
        """Heading of the trailer minus that of the truck."""
        return self.state[3] - self.state[2]

    def advance(self, speed: float, command_rad: float, dt: float, steps: int = 1) -> None:
        """Drive for ``dt`` with a steering command, each part in ``steps`` Runge-Kutta steps."""
        if self._rate is None:
            self.steering_rad = command_rad
            return self._integrate(speed, 0.0, dt, steps)
        way = command_rad - self.steering_rad
        slewing = min(dt, abs(way) / self._rate)
        self._integrate(speed, math.copysign(self._rate, way), slewing, steps)
        if slewing < dt:
            self.steering_rad = command_rad
            self._integrate(speed, 0.0, dt - slewing, steps)
        return None

    def _integrate(self, speed: float, rate: float, dt: float, steps: int) -> None:
        h = dt / steps
        for _ in range(steps):
            s, a = self.state, self.steering_rad
            k1 = _velocity(s, speed, a)
            k2 = _velocity(_moved(s, k1, h / 2), speed, a + rate * h / 2)
            k3 = _velocity(_moved(s, k2, h / 2), speed, a + rate * h / 2)
            k4 = _velocity(_moved(s, k3, h), speed, a + rate * h)
            x, y, t, u = (h / 6 * (p + 2 * q + 2 * r + w) for p, q, r, w in zip(k1, k2, k3, k4, strict=True))
            self.state = (s[0] + x, s[1] + y, s[2] + t, s[3] + u)
            self.steering_rad = a + rate * h


def _moved(s: State, k: State, h: float) -> State:
    return (s[0] + h * k[0], s[1] + h * k[1], s[2] + h * k[2], s[3] + h * k[3])


def _velocity(s: State, speed: float, steering: float) -> State:
    truck, trailer = s[2], s[3]
    hitch = SEMITRAILER.hitches[0]
    vx, vy = speed * math.cos(truck), speed * math.sin(truck)
    yaw_rate = speed * math.tan(steering) / SEMITRAILER.wheelbase_m
    hitch_x, hitch_y = (
        vx + hitch.offset_m * yaw_rate * math.sin(truck),
        vy - hitch.offset_m * yaw_rate * math.cos(truck),
    )
    across = hitch_y * math.cos(trailer) - hitch_x * math.sin(trailer)
    return (vx, vy, yaw_rate, across / hitch.length_m)


def placed(piece: Piece, errors: Errors, rate_rad_s: float | None = None) -> SemitrailerPlant:
    """The vehicle at the beginning of a piece, with these errors; steering as the bending angle needs it to stay."""
    outside = -errors.position_m if piece.heading_curvature > 0 else errors.position_m
    heading = piece.heading(0.0)
    x, y = piece.x_m - outside * math.sin(heading), piece.y_m + outside * math.cos(heading)
    hitch = SEMITRAILER.hitches[0]
    bending = hitch.bending_for(piece.heading_curvature) + errors.bending_rad
    reference = heading + errors.heading_rad
    truck = reference - bending if piece.backward else reference
    if piece.backward:
        x += hitch.length_m * math.cos(reference) + hitch.offset_m * math.cos(truck)
        y += hitch.length_m * math.sin(reference) + hitch.offset_m * math.sin(truck)
    steering = SEMITRAILER.steering(hitch.holding_curvature(bending))
    return SemitrailerPlant((x, y, truck, truck + bending), steering, rate_rad_s)
