"""How fast and how far the parts of a vehicle can go: the limits of the checks, from its profile."""

from __future__ import annotations

import math
from typing import Final

from daemon.loops.geometry import PAIR_NAMES, TURN_SIGN, WHEELS_OF_PAIR
from daemon.loops.plausibility import SteeredBy
from profiles.schema import PairedSteerGeometry, Profile
from profiles.steered import CarGeometry, SemitrailerGeometry

JUMP_MARGIN_DEG: Final = 1.0
"""Two readings may differ by this besides turning; the noise of a poor sensor (0.1 deg) is ten times smaller."""
JUMP_COUNTS: Final = 2
"""Rounding of two readings, at most."""
READING_CYCLES: Final = 2
"""Cycles between a reading of an encoder and of what turns it, at most."""


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


def steered_axes(profile: Profile) -> tuple[SteeredBy, ...]:
    """The axes that drives turn, in the order of the loops.

    A pair turns by the mean of what its two wheels roll in opposite directions, over the arm from its axis to them.
    """
    vehicle = profile.vehicle
    if isinstance(vehicle, PairedSteerGeometry) and vehicle.contact_offset_m:
        per_metre = 0.5 / vehicle.contact_offset_m
        ways = [[(wheel, TURN_SIGN[wheel] * per_metre) for wheel in WHEELS_OF_PAIR[pair]] for pair in range(2)]
        return tuple(SteeredBy(pair, tuple(ways[pair]), pair) for pair in range(len(PAIR_NAMES)))
    if isinstance(vehicle, CarGeometry | SemitrailerGeometry):
        arm_m = profile.drives[vehicle.steering.drive].wheel_radius_m
        return (SteeredBy(0, ((len(vehicle.wheels), 1.0 / arm_m),)),)
    return ()


def turning_limits_rad(profile: Profile, names: tuple[str, ...]) -> tuple[float, ...]:
    """What each encoder and the wheels that turn its axis may differ by: readings up to two cycles apart, and a jump's.

    Args:
        profile: the robot.
        names: of the encoders, in the order of the loops.
    """
    given = profile.plausibility.encoder_off_deg
    if given is not None:
        return (math.radians(given),) * len(names)
    cycles_s = READING_CYCLES / profile.network.cycle_hz
    margins = jump_margins_rad(profile, names)
    return tuple(margin + rate * cycles_s for margin, rate in zip(margins, encoder_rates_rad_s(profile), strict=True))
