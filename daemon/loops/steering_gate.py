"""The gate of a steered axle just before encoding: keeps its rate, its ramp and its stops, whatever a law asks for."""

from __future__ import annotations

import math
from typing import Final

from daemon.loops.geometry import clamp
from daemon.loops.limits import NOT_FINITE
from daemon.loops.motion_profile import approach_speed, ramp
from daemon.loops.steered_axle import GAIN_1_S, GAIN_CYCLES
from profiles.steered import SteeredAxle

STEERING_RATE: Final = "steering_rate_gate"
STEERING_RAMP: Final = "steering_ramp_gate"
STEERING_STOP: Final = "steering_stop"
NEAR_RAD: Final = math.radians(0.2)
"""So near to its end an axle is held: without it would creep there for ever."""
_ROUNDING: Final = 1e-9


class SteeringGate:
    """Enforces limits on the speed of a steering drive, at the end of its arm.

    The axle comes to rest half way from the largest angle that commands may ask for to its stops, so that nobody pushes
    it against them. There it is held until somebody turns it back, or it is back within that angle: readings are noisy,
    and a gate that looked at the last one alone would let it start again and again.

    Args:
        axle: its limits.
        arm_m: of the drive.
    """

    def __init__(self, axle: SteeredAxle, arm_m: float) -> None:
        self._arm_m = arm_m
        self._speed_m_s = math.radians(axle.rate_deg_s) * arm_m
        self._acceleration_m_s2 = math.radians(axle.acceleration_deg_s2) * arm_m
        self._limit_rad = math.radians(axle.limit_deg)
        self._end_rad = math.radians((axle.limit_deg + axle.stop_deg) / 2.0)
        self._held = 0.0

    def apply(
        self, speed_m_s: float, angle_rad: float, previous_m_s: float, dt: float
    ) -> tuple[float, tuple[str, ...]]:
        """The speed that may be sent, and the names of the limits that changed it.

        Args:
            speed_m_s: of the law; may be anything, NaN included.
            angle_rad: measured.
            previous_m_s: sent last.
            dt: time since then [s].
        """
        if not math.isfinite(speed_m_s):
            return ramp(previous_m_s, 0.0, self._acceleration_m_s2, max(dt, 0.0)), (NOT_FINITE,)
        active: list[str] = []
        allowed = clamp(speed_m_s, self._speed_m_s)
        if abs(speed_m_s) > self._speed_m_s * (1 + _ROUNDING):
            active.append(STEERING_RATE)
        allowed, stops = self._before_the_end(allowed, angle_rad, dt)
        ramped = ramp(previous_m_s, allowed, self._acceleration_m_s2, max(dt, 0.0))
        if abs(ramped - allowed) > self._speed_m_s * _ROUNDING:
            active.append(STEERING_RAMP)
        if self._held or (abs(angle_rad) >= self._end_rad and ramped * angle_rad > 0.0):
            return 0.0, (*active, STEERING_STOP)
        return ramped, (*active, STEERING_STOP) if stops else tuple(active)

    def _before_the_end(self, speed_m_s: float, angle_rad: float, dt: float) -> tuple[float, bool]:
        """The speed with which the axle still comes to rest in time, and whether it is less than is asked for."""
        side = math.copysign(1.0, speed_m_s)
        way_m = (self._end_rad - side * angle_rad) * self._arm_m
        if speed_m_s * self._held <= 0.0 or side * angle_rad <= self._limit_rad:
            self._held = 0.0
        if way_m <= NEAR_RAD * self._arm_m and speed_m_s:
            self._held = side
        if self._held:
            return 0.0, True
        gain = min(GAIN_1_S, GAIN_CYCLES / dt) if dt > 0.0 else GAIN_1_S
        most_m_s = approach_speed(way_m, gain, self._acceleration_m_s2 / 2)
        return (side * most_m_s, True) if abs(speed_m_s) > most_m_s else (speed_m_s, False)
