"""Driving with both pairs locked: what the headings that the brakes hold make of the speed of the robot's centre."""

from __future__ import annotations

import math
from typing import Final

from daemon.loops.geometry import PerPair, PerWheel, solve_turning
from daemon.loops.paired_steer_target import turning_warnings
from profiles.schema import Limits, PairedSteerGeometry

BRAKE_SLIP_RAD: Final = math.radians(5.0)
"""A pair that turned more than this while its brake is engaged is not where it was locked."""


class LockedDrive:
    """The kinematics of one pair of locked headings.

    Args:
        geometry: the robot.
        limits: of the vehicle.
        heading_rad: where the rear and the front pair are locked.

    Attributes:
        heading_rad: as given.
        unit: the motion at 1 m/s.
        acceleration_m_s2: of the centre, so that the fastest wheel keeps the vehicle's limit too.
        warnings: what is permitted but will not be driven as computed.
    """

    def __init__(self, geometry: PairedSteerGeometry, limits: Limits, heading_rad: PerPair) -> None:
        self.heading_rad = heading_rad
        self.unit = solve_turning(geometry, *heading_rad, 1.0)
        fastest = max(1.0, *(abs(speed) for speed in self.unit.roll_speed_m_s))
        self.acceleration_m_s2 = limits.acceleration_m_s2 / fastest
        self.warnings = turning_warnings(geometry, self.unit)

    def wheel_speeds(self, speed_m_s: float) -> PerWheel:
        """Rim speeds of wheels 1 to 4 for a speed of the centre."""
        first, second, third, fourth = self.unit.roll_speed_m_s
        return (speed_m_s * first, speed_m_s * second, speed_m_s * third, speed_m_s * fourth)

    def slipped_pair(self, heading_rad: tuple[float, ...]) -> int | None:
        """The pair that turned through its brake, by the measured headings, or None."""
        for pair, locked in enumerate(self.heading_rad):
            if not abs(heading_rad[pair] - locked) <= BRAKE_SLIP_RAD:
                return pair
        return None
