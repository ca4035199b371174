"""The gate just before encoding: enforces the vehicle's limits on whatever a law asks for, and names those it applied.

It knows the limits and the interlock of the steering brakes, nothing of the laws.
"""

from __future__ import annotations

import math
from typing import Final

from daemon.loops.geometry import WHEELS_OF_PAIR, clamp
from daemon.loops.measurement import Command, Measurement
from profiles.schema import Geometry, Limits, PairedSteerGeometry

ROLLING_M_S: Final = 0.02
"""Measured rim speed above which an engaged steering brake is not released."""

NOT_FINITE: Final = "not_finite"
WHEEL_SPEED: Final = "wheel_speed"
WHEEL_ACCELERATION: Final = "wheel_acceleration"
STEERING_SPEED: Final = "steering_speed"
BRAKE_INTERLOCK: Final = "brake_interlock"
_ROUNDING: Final = 1e-9


class Gate:
    """Enforces limits on commands.

    Args:
        limits: of the vehicle.
        geometry: of the vehicle; without steering brakes wheels are free of interlocks.
        acceleration_m_s2: of the wheels; None: the vehicle's.
    """

    def __init__(self, limits: Limits, geometry: Geometry | None, acceleration_m_s2: float | None = None) -> None:
        self._wheel_speed_m_s = limits.wheel_speed_m_s
        self._steering_speed_m_s = limits.steering_rim_speed_m_s
        self._acceleration_m_s2 = limits.acceleration_m_s2 if acceleration_m_s2 is None else acceleration_m_s2
        self._paired = isinstance(geometry, PairedSteerGeometry)

    def apply(
        self, command: Command, measurement: Measurement, previous: Command, dt: float
    ) -> tuple[Command, tuple[str, ...]]:
        """The command that may be sent, and the names of the limits that changed it.

        Wheel speeds and wheel accelerations are limited for all wheels together, so that the direction of the motion
        stays. The interlock of the brakes comes last and stops wheels at once (the drives ramp down by themselves):
        while a steering brake is not certainly engaged the wheels of the other pair stand still and the pair's own
        turn in opposite directions, no faster than the steering limit, or stand while the brake is on its way. A
        brake is released only while the other one is certainly engaged and, from engaged, only with the wheels at
        rest.

        Args:
            command: of the law; speeds may be anything, NaN included.
            measurement: of this cycle.
            previous: the command that was sent last.
            dt: time since then [s].
        """
        active: list[str] = []
        speeds = list(command.wheel_speed_m_s)
        if not all(map(math.isfinite, speeds)):
            speeds = [speed if math.isfinite(speed) else 0.0 for speed in speeds]
            active.append(NOT_FINITE)
        speeds = self._limit_speed(speeds, active)
        speeds = self._limit_acceleration(speeds, previous.wheel_speed_m_s, dt, active)
        release = command.release_brake
        if self._paired and measurement.brake_engaged:
            speeds = self._interlock(speeds, measurement, active)
            release = self._limit_release(release, measurement, active)
        return Command(tuple(speeds), release), tuple(dict.fromkeys(active)) if active else ()

    def _limit_speed(self, speeds: list[float], active: list[str]) -> list[float]:
        fastest = max(map(abs, speeds), default=0.0)
        if fastest <= self._wheel_speed_m_s * (1 + _ROUNDING):
            return speeds
        active.append(WHEEL_SPEED)
        scale = self._wheel_speed_m_s / fastest
        return [clamp(speed * scale, self._wheel_speed_m_s) for speed in speeds]

    def _limit_acceleration(
        self, speeds: list[float], previous: tuple[float, ...], dt: float, active: list[str]
    ) -> list[float]:
        step = self._acceleration_m_s2 * dt if dt > 0 else 0.0
        changes = [new - old for new, old in zip(speeds, previous, strict=True)]
        largest = max(map(abs, changes), default=0.0)
        if largest <= step * (1 + _ROUNDING):
            return speeds
        active.append(WHEEL_ACCELERATION)
        part = step / largest
        return [old + part * change for old, change in zip(previous, changes, strict=True)]

    def _interlock(self, speeds: list[float], measurement: Measurement, active: list[str]) -> list[float]:
        if all(measurement.brake_engaged):
            return speeds
        loose = [pair for pair, engaged in enumerate(measurement.brake_engaged) if not engaged]
        allowed = [0.0] * len(speeds)
        if len(loose) == 1 and measurement.brake_released[loose[0]]:
            first, second = WHEELS_OF_PAIR[loose[0]]
            half = (speeds[first] - speeds[second]) / 2
            turning = clamp(half, self._steering_speed_m_s)
            if abs(half) > self._steering_speed_m_s * (1 + _ROUNDING):
                active.append(STEERING_SPEED)
            allowed[first], allowed[second] = turning, -turning
        if any(abs(new - old) > self._steering_speed_m_s * _ROUNDING for new, old in zip(allowed, speeds, strict=True)):
            active.append(BRAKE_INTERLOCK)
        return allowed

    def _limit_release(
        self, release: tuple[bool, ...], measurement: Measurement, active: list[str]
    ) -> tuple[bool, ...]:
        if not any(release):
            return release
        rolling = any(not abs(speed) <= ROLLING_M_S for speed in measurement.wheel_speed_m_s)
        engaged = measurement.brake_engaged
        granted = tuple(
            wanted
            and sum(release) == 1
            and all(engaged[other] for other in range(len(engaged)) if other != pair)
            and not (engaged[pair] and rolling)
            for pair, wanted in enumerate(release)
        )
        if granted != release:
            active.append(BRAKE_INTERLOCK)
        return granted
