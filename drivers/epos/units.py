"""From SI at the wheel's rim to the drive's units at the motor, and back: made from the profile in this one place."""

from __future__ import annotations

import math
from dataclasses import dataclass

from profiles.schema import DriveConfig


@dataclass(frozen=True, slots=True)
class WheelUnits:
    """Factors of one drive with its gear, encoder and wheel.

    Attributes:
        rpm_per_m_s: motor speed for a rim speed; negative where the motor is mounted mirrored.
        m_per_qc: rim distance for one quad count, with the same sign.
    """

    rpm_per_m_s: float
    m_per_qc: float

    @classmethod
    def of(cls, config: DriveConfig) -> WheelUnits:
        """The factors of a profile's drive: motor turns = rim distance / (2 pi r) x gear x belt."""
        motor_turns_per_m = config.direction * config.total_ratio / (2.0 * math.pi * config.wheel_radius_m)
        return cls(60.0 * motor_turns_per_m, 1.0 / (motor_turns_per_m * config.qc_per_motor_turn))

    def ramp_rpm_s(self, acceleration_m_s2: float) -> int:
        """A ramp of the drive, always positive, at least 1."""
        return max(1, round(acceleration_m_s2 * abs(self.rpm_per_m_s)))
