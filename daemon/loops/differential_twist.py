"""Drives a robot on two wheels at a speed and a yaw rate, both reached by ramps."""

from __future__ import annotations

import math

from daemon.loops.differential import DifferentialDrive
from daemon.loops.measurement import Command
from daemon.loops.motion_profile import ramp
from profiles.schema import Limits


class DifferentialTwistLaw:
    """The law of one motion, which begins at rest.

    Args:
        drive: the robot.
        limits: of the vehicle.

    Attributes:
        forward_m_s, yaw_rate_rad_s: commanded.
    """

    def __init__(self, drive: DifferentialDrive, limits: Limits) -> None:
        self.forward_m_s = 0.0
        self.yaw_rate_rad_s = 0.0
        self._drive = drive
        self._acceleration_m_s2 = limits.acceleration_m_s2
        self._yaw_acceleration_rad_s2 = math.radians(limits.yaw_acceleration_deg_s2)

    def step(self, forward_m_s: float, yaw_rate_rad_s: float, dt: float) -> Command:
        """One cycle: rim speeds of the right and the left wheel, one step nearer to what is wanted.

        Args:
            forward_m_s, yaw_rate_rad_s: to reach and hold.
            dt: time since the last step [s].
        """
        self.forward_m_s = ramp(self.forward_m_s, forward_m_s, self._acceleration_m_s2, dt)
        self.yaw_rate_rad_s = ramp(self.yaw_rate_rad_s, yaw_rate_rad_s, self._yaw_acceleration_rad_s2, dt)
        right, left = self._drive.wheel_speeds(self.forward_m_s, self.yaw_rate_rad_s)
        return Command((self._drive.wheel_radius_m * right, self._drive.wheel_radius_m * left))
