"""How fast and how far the parts of a vehicle can go: the limits of the checks, from its profile."""

from __future__ import annotations

import math
from typing import Final

from profiles.schema import PairedSteerGeometry, Profile
from profiles.steered import CarGeometry, SemitrailerGeometry

JUMP_MARGIN_DEG: Final = 1.0
"""Two readings may differ by this besides turning; the noise of a poor sensor (0.1 deg) is ten times smaller."""
JUMP_COUNTS: Final = 2
"""Rounding of two readings, at most."""


def encoder_rates_rad_s(profile: Profile) -> tuple[float, ...]:
    """Fastest turning of each encoder's axis, in the order of the vehicle's loops; none of a kind of one's own."""
    vehicle, limits = profile.vehicle, profile.limits
    if isinstance(vehicle, PairedSteerGeometry):
        rate = limits.steering_rim_speed_m_s / vehicle.contact_offset_m if vehicle.contact_offset_m else math.inf
        return (rate, rate)
    if isinstance(vehicle, CarGeometry):
        return (math.radians(vehicle.steering.rate_deg_s),)
    if isinstance(vehicle, SemitrailerGeometry):
        return (math.radians(vehicle.steering.rate_deg_s), _bending_rate_rad_s(vehicle, limits.speed_m_s))
    return ()


def _bending_rate_rad_s(vehicle: SemitrailerGeometry, speed_m_s: float) -> float:
    """Both bodies turn against each other as fast as they can: the largest sum of the terms of thesis eq. 2.14."""
    curvature = math.tan(math.radians(vehicle.steering.stop_deg)) / vehicle.wheelbase_m
    length = vehicle.trailer.length_m
    return speed_m_s * (curvature + (1.0 + abs(vehicle.hitch_offset_m) * curvature) / length)


def jump_margins_rad(profile: Profile, names: tuple[str, ...]) -> tuple[float, ...]:
    """What two readings of each encoder may differ by at rest."""
    given = profile.plausibility.encoder_jump_deg
    return tuple(
        math.radians(JUMP_MARGIN_DEG + JUMP_COUNTS * 360.0 / profile.encoders[name].counts_per_turn)
        if given is None
        else math.radians(given)
        for name in names
    )
