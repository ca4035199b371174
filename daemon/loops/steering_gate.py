"""The gate of a steered axle just before encoding: keeps its rate, its ramp and its stops, whatever a law asks for."""

from __future__ import annotations

import math
from typing import Final

from daemon.loops.geometry import clamp
from daemon.loops.limits import NOT_FINITE
from daemon.loops.motion_profile import ramp
from profiles.steered import SteeredAxle

STEERING_RATE: Final = "steering_rate_gate"
STEERING_RAMP: Final = "steering_ramp_gate"
STEERING_STOP: Final = "steering_stop"
_ROUNDING: Final = 1e-9


class SteeringGate:
    """Enforces limits on the speed of a steering drive, at the end of its arm.

    Args:
        axle: its limits.
        arm_m: of the drive.
    """

    def __init__(self, axle: SteeredAxle, arm_m: float) -> None:
        self._speed_m_s = math.radians(axle.rate_deg_s) * arm_m
        self._acceleration_m_s2 = math.radians(axle.acceleration_deg_s2) * arm_m
        self._stop_rad = math.radians(axle.stop_deg)

    def apply(
        self, speed_m_s: float, angle_rad: float, previous_m_s: float, dt: float
    ) -> tuple[float, tuple[str, ...]]:
        """The speed that may be sent, and the names of the limits that changed it.

        Args:
            speed_m_s: of the law; may be anything, NaN included.
            angle_rad: measured; from a stop on the axle turns back only, and stops at once.
            previous_m_s: sent last.
            dt: time since then [s].
        """
        if not math.isfinite(speed_m_s):
            return ramp(previous_m_s, 0.0, self._acceleration_m_s2, max(dt, 0.0)), (NOT_FINITE,)
        active: list[str] = []
        allowed = clamp(speed_m_s, self._speed_m_s)
        if abs(speed_m_s) > self._speed_m_s * (1 + _ROUNDING):
            active.append(STEERING_RATE)
        ramped = ramp(previous_m_s, allowed, self._acceleration_m_s2, max(dt, 0.0))
        if abs(ramped - allowed) > self._speed_m_s * _ROUNDING:
            active.append(STEERING_RAMP)
        if abs(angle_rad) >= self._stop_rad and ramped * angle_rad > 0:
            return 0.0, (*active, STEERING_STOP)
        return ramped, tuple(active)
