"""Wheels that roll otherwise than the body above them can move: what is left of least squares over all wheels.

A wheel is a row (c, s, l): it rolls c dx + s dy + l dyaw where the body moves by (dx, dy, dyaw); rows of value 0 are
directions in which nothing moves. Taken are the differences between what the wheels rolled and what they were commanded
to: where the whole body is late or pushed, they are a motion of the body, and nothing is left of them.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

from daemon.loops.least_squares import Fit, Row
from daemon.loops.odometry import body_rows
from daemon.loops.plausibility import Contradiction
from profiles.schema import OmniGeometry, PairedSteerGeometry, Profile
from profiles.steered import CarGeometry

FORGETTING_S: Final = 1.0
"""Time constant in which what is left is forgotten; slip in a ramp is over sooner than it adds up."""
FREEDOMS: Final = 3
"""Of a body in the plane; so many wheels can roll as they like."""
LAG_S: Final = 0.08
"""Time by which wheels may be late against each other; on its narrowest curves and swerves no simulated robot's come to
half of it."""


def rows_of(profile: Profile, heading_rad: Sequence[float]) -> list[Row]:
    """Rows of all wheels in the order of the loops, then those in which nothing moves; none where all wheels are free.

    Args:
        profile: the robot.
        heading_rad: of its encoders.
    """
    vehicle = profile.vehicle
    if isinstance(vehicle, PairedSteerGeometry):
        return body_rows(vehicle, heading_rad)
    if isinstance(vehicle, CarGeometry):
        half, cos, sin = vehicle.track_m / 2, math.cos(heading_rad[0]), math.sin(heading_rad[0])
        return [(1.0, 0.0, -half), (1.0, 0.0, half), (0.0, 1.0, 0.0), (-sin, cos, vehicle.wheelbase_m * cos)]
    if isinstance(vehicle, OmniGeometry) and len(vehicle.wheels) > FREEDOMS:
        directions = [(math.radians(wheel.direction_deg), wheel.lever_m) for wheel in vehicle.wheels.values()]
        return [(math.cos(direction), math.sin(direction), lever) for direction, lever in directions]
    return []


def wheels_of(profile: Profile) -> int:
    """How many of the drives, the first ones in the order of the loops, turn wheels."""
    vehicle = profile.vehicle
    return len(vehicle.wheels) if isinstance(vehicle, PairedSteerGeometry | CarGeometry | OmniGeometry) else 0


def wheel_limit_m(profile: Profile) -> float:
    """How far a wheel may be off at rest: what the fastest one rolls in a cycle, in which readings may be apart."""
    given = profile.plausibility.wheel_off_m
    return profile.limits.wheel_speed_m_s / profile.network.cycle_hz if given is None else given


class WheelsAndBody:
    """Adds up what no motion of the body explains.

    Args:
        limit_m: how far a wheel may be off at rest.
    """

    def __init__(self, limit_m: float) -> None:
        self._limit_m = limit_m
        self._left_m: list[float] = []
        self._off_m: list[float] = []
        self._travel_m: Sequence[float] = ()
        self._fastest_m_s = 0.0

    def begin_anew(self) -> None:
        """Forget what was added up."""
        self._travel_m = ()

    def look(
        self, fit: Fit, travel_m: Sequence[float], commanded_m_s: Sequence[float], dt_s: float
    ) -> Contradiction | None:
        """The wheel that is farthest from its command, where some wheel is off by more than the limit; or None.

        Args:
            fit: of the body to its wheels.
            travel_m: what each wheel has rolled.
            commanded_m_s: rim speed of each that was commanded since the last look.
            dt_s: since then.
        """
        if not self._travel_m:
            self._travel_m, self._left_m = travel_m, [0.0] * len(travel_m)
            self._off_m, self._fastest_m_s = [0.0] * len(travel_m), 0.0
            return None
        before, self._travel_m = self._travel_m, travel_m
        off = [new - old - speed * dt_s for new, old, speed in zip(travel_m, before, commanded_m_s, strict=True)]
        dx, dy, dyaw = fit.unknowns(off)
        kept = math.exp(-dt_s / FORGETTING_S)
        self._left_m = [
            kept * left + value - (x * dx + y * dy + turn * dyaw)
            for left, value, (x, y, turn) in zip(self._left_m, off, fit.rows, strict=False)
        ]
        self._off_m = [kept * before + value for before, value in zip(self._off_m, off, strict=True)]
        left_m = max(map(abs, self._left_m))
        self._fastest_m_s = max(kept * self._fastest_m_s, max(map(abs, commanded_m_s)))
        limit_m = self._limit_m + LAG_S * self._fastest_m_s
        if left_m <= limit_m:
            return None
        worst = max(range(len(off)), key=lambda wheel: abs(self._off_m[wheel]))
        return Contradiction(worst, left_m, limit_m)
