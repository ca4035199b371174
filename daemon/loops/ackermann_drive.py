"""The law of a car: a heading by the ENPM808X report's regulators, or a steering angle, and a speed; never backwards.

The speed is that of the rear axle's middle. The rear wheels' speeds follow from it and from the measured steering angle
(:func:`daemon.loops.ackermann.wheel_speeds`), so that they fit the curve that the car is on while the steering turns.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

from daemon.loops.ackermann import AckermannController, AckermannGeometry, wheel_speeds
from daemon.loops.geometry import clamp
from daemon.loops.measurement import Command, Measurement
from daemon.loops.motion_profile import ARRIVED_M, ramp, speed_to_end
from daemon.loops.pid import PidGains
from daemon.loops.steered_axle import SteeredAxleLaw
from profiles.schema import Limits
from profiles.steered import CarGeometry, RegulatorGains

STEERED_RAD: Final = math.radians(0.3)
"""An arc begins when the steering is closer to its angle than this."""
LATERAL_ACCELERATION: Final = "lateral_acceleration"
WHEELS: Final = "wheels"
"""Speed or ramp of a rear wheel, or the vehicle's own speed."""


@dataclass(frozen=True, slots=True)
class CarTarget:
    """What the car shall do.

    Attributes:
        speed_m_s: of the rear axle's middle, not negative.
        heading_rad: to steer to; None where the steering angle is given.
        steering_rad: steering angle; None where the heading is given.
        distance_m: way at this steering angle, begun when it is reached; None: without an end.
    """

    speed_m_s: float
    heading_rad: float | None = None
    steering_rad: float | None = None
    distance_m: float | None = None


@dataclass(frozen=True, slots=True)
class CarRecord:
    """The terms of one step.

    Attributes:
        steering_target_rad: asked of the axle; None while it is left where it is.
        steering_rad: measured.
        heading_error_rad: target minus heading; 0 where there is none.
        speed_m_s: commanded, of the rear axle's middle.
        remaining_m: way still to command; None for a motion without an end.
        limits_active: limits that hold the command back.
        done: the way is covered, or without a target the car is commanded to rest.
        failure: why the motion was given up, or "".
    """

    steering_target_rad: float | None
    steering_rad: float
    heading_error_rad: float
    speed_m_s: float
    remaining_m: float | None
    limits_active: tuple[str, ...]
    done: bool
    failure: str


def car_kinematics(geometry: CarGeometry, limits: Limits, wheel_radius_m: float) -> AckermannGeometry:
    """The report's car for a profile's."""
    return AckermannGeometry(
        geometry.wheelbase_m,
        geometry.track_m,
        geometry.mass_offset_m,
        wheel_radius_m,
        limits.acceleration_m_s2 / wheel_radius_m,
        limits.wheel_speed_m_s / wheel_radius_m,
    )


class CarLaw:
    """Regulators, steering and speed of one motion.

    Args:
        geometry: the car.
        limits: of the vehicle.
        wheel_radius_m: of the rear wheels.
        wheel_acceleration_m_s2: of each of them.
        arm_m: at which the steering drive's speed counts.
        period_s: of the control cycle.
    """

    def __init__(
        self,
        geometry: CarGeometry,
        limits: Limits,
        wheel_radius_m: float,
        wheel_acceleration_m_s2: float,
        arm_m: float,
        period_s: float,
    ) -> None:
        self._car = car_kinematics(geometry, limits, wheel_radius_m)
        self._limits = limits
        self._arm_m = arm_m
        self._axle = SteeredAxleLaw(geometry.steering)
        heading, speed = _gains(geometry.heading_regulator, 1.0), _gains(geometry.speed_regulator, period_s)
        self._regulators = AckermannController(self._car, heading, speed, period_s)
        self._wheel_acceleration_m_s2 = wheel_acceleration_m_s2
        self._speed_m_s = 0.0
        self._wheels_m_s = (0.0, 0.0)
        self._driven_m = 0.0

    def step(
        self, measurement: Measurement, heading_rad: float, target: CarTarget | None, dt: float
    ) -> tuple[Command, CarRecord]:
        """One cycle.

        Args:
            measurement: of this cycle: left and right rear wheel and steering drive; steering angle first of headings.
            heading_rad: of the car.
            target: what to do; another one may come with each step, but no other distance. None comes to rest.
            dt: time since the last step [s], positive.
        """
        angle, active = measurement.heading_rad[0], list[str]()
        error = 0.0 if target is None or target.heading_rad is None else target.heading_rad - heading_rad
        steering, speed = self._wanted(measurement, target, error, dt)
        if steering is not None:
            steering = self._within_grip(steering, active)
        axle = self._axle.step(steering, angle, dt)
        self._speed_m_s = self._within_wheels(max(0.0, speed), angle, dt, active)
        self._driven_m += self._speed_m_s * dt
        self._wheels_m_s = left, right = self._wheels(angle, self._speed_m_s)
        remaining = None if target is None else self._remaining(target)
        record = CarRecord(
            steering_target_rad=steering,
            steering_rad=angle,
            heading_error_rad=math.remainder(error, math.tau),
            speed_m_s=self._speed_m_s,
            remaining_m=remaining,
            limits_active=(*active, *axle.limits_active),
            done=self._speed_m_s == 0 and (target is None or (remaining is not None and remaining < ARRIVED_M)),
            failure=axle.failure,
        )
        return Command((left, right, self._arm_m * axle.rate_rad_s)), record

    def _wanted(
        self, measurement: Measurement, target: CarTarget | None, error: float, dt: float
    ) -> tuple[float | None, float]:
        """Steering angle and speed before the limits that depend on each other."""
        angle = measurement.heading_rad[0]
        outer = max(self._wheels(angle, 1.0))
        acceleration = min(self._limits.acceleration_m_s2, self._wheel_acceleration_m_s2 / outer)
        if target is None:
            return None, ramp(self._speed_m_s, 0.0, acceleration, dt)
        if target.steering_rad is None:
            left, right, _ = measurement.wheel_speed_m_s
            gamma, throttle = self._regulators.step(error, target.speed_m_s - (left + right) / 2)
            return gamma, self._speed_m_s + self._car.wheel_radius_m * throttle
        remaining = self._remaining(target)
        if remaining is None:
            return target.steering_rad, ramp(self._speed_m_s, target.speed_m_s, acceleration, dt)
        standing = self._speed_m_s == 0 and self._driven_m == 0
        if standing and abs(angle - target.steering_rad) > STEERED_RAD:
            return target.steering_rad, 0.0
        return target.steering_rad, speed_to_end(self._speed_m_s, target.speed_m_s, acceleration, remaining, dt)

    def _remaining(self, target: CarTarget) -> float | None:
        return None if target.distance_m is None else target.distance_m - self._driven_m

    def _within_grip(self, steering: float, active: list[str]) -> float:
        """The steering angle, no larger than the lateral acceleration v^2 tan(gamma) / L allows at this speed."""
        square = self._speed_m_s * self._speed_m_s
        widest = math.atan2(self._limits.lateral_acceleration_m_s2 * self._car.wheelbase_m, square)
        if abs(steering) > widest:
            active.append(LATERAL_ACCELERATION)
        return clamp(steering, widest)

    def _wheels(self, angle: float, speed: float) -> tuple[float, float]:
        """Rim speeds of the left and the right rear wheel; none turns backwards."""
        left, right = wheel_speeds(self._car, angle, speed)
        return max(0.0, self._car.wheel_radius_m * left), max(0.0, self._car.wheel_radius_m * right)

    def _within_wheels(self, speed: float, angle: float, dt: float, active: list[str]) -> float:
        """The speed at which each wheel keeps its limit and its ramp on this curve; the outer one's ramp first."""
        per_axle = self._wheels(angle, 1.0)
        low, high = 0.0, min(self._limits.speed_m_s, self._limits.wheel_speed_m_s / max(per_axle))
        step = self._wheel_acceleration_m_s2 * dt
        for share, last in sorted(zip(per_axle, self._wheels_m_s, strict=True)):
            if share > 0:
                slowest, fastest = (last - step) / share, (last + step) / share
                low, high = min(max(low, slowest), fastest), max(min(high, fastest), slowest)
        if speed > high:
            active.append(WHEELS)
        return max(0.0, low, min(speed, high))


def _gains(gains: RegulatorGains, scale: float) -> PidGains:
    return PidGains(scale * gains.proportional, scale * gains.integral, scale * gains.derivative)
