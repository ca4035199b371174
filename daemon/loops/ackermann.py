"""A car with front-wheel steering and rear-wheel drive: the ENPM808X report's equations (section 4), put right.

The steering angle ``gamma`` is that of a wheel between the two front ones, positive to the left. The report drives by
a throttle that changes the speed of the outer rear wheel (:func:`drive`). When the steering angle changes, that speed
stays while the car's does not; :func:`wheel_speeds` starts from the speed of the rear axle, which has no such jumps.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

from daemon.loops.geometry import clamp
from daemon.loops.path import wrap
from daemon.loops.pid import Pid, PidGains

MAX_STEERING_RAD: Final = math.pi / 4
"""Equation 2.1."""


@dataclass(frozen=True, slots=True)
class AckermannGeometry:
    """The car.

    Attributes:
        wheelbase_m: L.
        track_m: W, between the wheels of an axle.
        mass_offset_m: a, of the centre of mass from the rear axle.
        wheel_radius_m: r_w.
        max_acceleration_rad_s2: alpha_max, of a wheel.
        max_wheel_speed_rad_s: none turns faster, and none backwards.
    """

    wheelbase_m: float
    track_m: float
    mass_offset_m: float
    wheel_radius_m: float
    max_acceleration_rad_s2: float
    max_wheel_speed_rad_s: float


@dataclass(frozen=True, slots=True)
class AckermannState:
    """Heading [rad] and speeds of the rear wheels [rad/s]."""

    heading_rad: float = 0.0
    left_rad_s: float = 0.0
    right_rad_s: float = 0.0


@dataclass(frozen=True, slots=True)
class AckermannStep:
    """What one tick does.

    Attributes:
        state: after it.
        throttle_rad_s: change of the outer wheel's speed that was used.
        axle_speed_m_s: of the rear axle's middle.
        mass_speed_m_s: of the centre of mass.
    """

    state: AckermannState
    throttle_rad_s: float
    axle_speed_m_s: float
    mass_speed_m_s: float


def turning_radius(geometry: AckermannGeometry, gamma_rad: float) -> float:
    """Distance of the rear axle's middle from the centre of the turn: R1 = L cot |gamma| (eq. 4.1, 4.4)."""
    return geometry.wheelbase_m / math.tan(abs(gamma_rad)) if gamma_rad else math.inf


def mass_radius(geometry: AckermannGeometry, gamma_rad: float) -> float:
    """Distance of the centre of mass from the centre of the turn, R (eq. 4.1)."""
    return math.hypot(geometry.mass_offset_m, turning_radius(geometry, gamma_rad))


def wheel_angles(geometry: AckermannGeometry, gamma_rad: float) -> tuple[float, float]:
    """Steering angles of the left and the right front wheel (eq. 4.2, 4.3, 4.12).

    Beyond a quarter turn where the centre of the turn lies between the wheels.
    """
    if not gamma_rad:
        return (0.0, 0.0)
    radius, half = turning_radius(geometry, gamma_rad), geometry.track_m / 2
    inner = math.atan2(geometry.wheelbase_m, radius - half)
    outer = math.atan2(geometry.wheelbase_m, radius + half)
    return (inner, outer) if gamma_rad > 0 else (-outer, -inner)


def wheel_speeds(geometry: AckermannGeometry, gamma_rad: float, axle_speed_m_s: float) -> tuple[float, float]:
    """Speeds of the left and the right rear wheel for a speed of the axle [rad/s] (eq. 4.9 to 4.11)."""
    spread = geometry.track_m / 2 * math.tan(gamma_rad) / geometry.wheelbase_m
    rolling = axle_speed_m_s / geometry.wheel_radius_m
    return (rolling * (1 - spread), rolling * (1 + spread))


def drive(
    geometry: AckermannGeometry, state: AckermannState, throttle_rad_s: float, gamma_rad: float, dt: float
) -> AckermannStep:
    """One tick of the report's car (eq. 4.5 to 4.19).

    Args:
        geometry: the car.
        state: before the tick.
        throttle_rad_s: change of the outer wheel's speed in this tick; limited to ``max_acceleration * dt`` (eq. 2.3).
        gamma_rad: steering angle; limited to 45 degrees.
        dt: length of the tick [s].
    """
    gamma = clamp(gamma_rad, MAX_STEERING_RAD)
    throttle = clamp(throttle_rad_s, geometry.max_acceleration_rad_s2 * dt)
    outer = _rolling(geometry, _outer_speed(state, gamma) + throttle)
    rim = geometry.wheel_radius_m * outer
    if not gamma:
        return AckermannStep(AckermannState(state.heading_rad, outer, outer), throttle, rim, rim)
    radius, half = turning_radius(geometry, gamma), geometry.track_m / 2
    yaw_rate = rim / (radius + half)
    inner = _rolling(geometry, yaw_rate * (radius - half) / geometry.wheel_radius_m)
    left, right = (inner, outer) if gamma > 0 else (outer, inner)
    heading = state.heading_rad + math.copysign(yaw_rate, gamma) * dt
    speeds = (yaw_rate * radius, yaw_rate * mass_radius(geometry, gamma))
    return AckermannStep(AckermannState(heading, left, right), throttle, *speeds)


def _outer_speed(state: AckermannState, gamma: float) -> float:
    if not gamma:
        return max(state.left_rad_s, state.right_rad_s)
    return state.right_rad_s if gamma > 0 else state.left_rad_s


def _rolling(geometry: AckermannGeometry, speed_rad_s: float) -> float:
    """A wheel's speed without reverse and within its limit."""
    return max(0.0, min(geometry.max_wheel_speed_rad_s, speed_rad_s))


class AckermannController:
    """The report's two regulators (section 2): heading to steering angle, speed to throttle."""

    def __init__(
        self, geometry: AckermannGeometry, heading: PidGains, speed: PidGains, dt: float, anti_windup: bool = True
    ) -> None:
        """Regulators at rest, for ticks of ``dt``."""
        self._dt = dt
        self._heading = Pid(heading, MAX_STEERING_RAD, anti_windup)
        self._speed = Pid(speed, geometry.max_acceleration_rad_s2 * dt, anti_windup)

    def step(self, heading_error_rad: float, speed_error_m_s: float) -> tuple[float, float]:
        """Steering angle [rad] and throttle [rad/s in this tick]; the heading's error is wrapped to half a turn."""
        return (self._heading.step(wrap(heading_error_rad), self._dt), self._speed.step(speed_error_m_s, self._dt))
