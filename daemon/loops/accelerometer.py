"""The acceleration of a robot's centre from an accelerometer that sits elsewhere and looks elsewhere.

A point r of a rigid body that turns at the rate w has, in the body's frame, the acceleration

    a_point = a_centre + dw/dt (-r_y, r_x) - w^2 (r_x, r_y)

The second term is Euler's, the third the centripetal one. The sensor reads a_point along its own axes.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

Vector = tuple[float, float]

SMOOTHING_S: Final = 0.02
"""Of the yaw rate, whose slope is the yaw acceleration."""
LEVELLING_S: Final = 0.5
"""In which the reading at rest becomes the sensor's offset."""
LARGEST_M_S2: Final = 200.0
"""A reading beyond this, or none, is not used."""


@dataclass(frozen=True, slots=True)
class Mounting:
    """Where the sensor sits in the robot's frame.

    Attributes:
        x_m: forward of the centre.
        y_m: left of the centre.
        rotation_rad: from the robot's x axis to the sensor's, counter-clockwise.
    """

    x_m: float = 0.0
    y_m: float = 0.0
    rotation_rad: float = 0.0


@dataclass(frozen=True, slots=True)
class CentreAcceleration:
    """The terms of one reading, in the robot's frame [m/s2].

    Attributes:
        centre: acceleration of the robot's centre.
        point: acceleration of the sensor, its offset taken off.
        euler: part of ``point`` that the yaw acceleration makes.
        centripetal: part of ``point`` that the yaw rate makes.
        offset: reading at rest, along the sensor's axes.
        valid: False where the reading could not be used; the last good one is repeated.
    """

    centre: Vector
    point: Vector
    euler: Vector
    centripetal: Vector
    offset: Vector
    valid: bool


class Accelerometer:
    """Readings to accelerations of the centre, one a cycle.

    Args:
        mounting: of the sensor.
        smoothing_s: time constant with which the yaw rate is smoothed before its slope is taken.
    """

    def __init__(self, mounting: Mounting, smoothing_s: float = SMOOTHING_S) -> None:
        self._mounting = mounting
        self._smoothing_s = smoothing_s
        self._smooth_rate: float | None = None
        self._offset: Vector = (0.0, 0.0)
        self._last: Vector = (0.0, 0.0)

    def step(self, reading: Vector, yaw_rate: float, dt: float, at_rest: bool = False) -> CentreAcceleration:
        """One cycle.

        Args:
            reading: along the sensor's axes [m/s2].
            yaw_rate: of the robot [rad/s], from a gyroscope or the wheels.
            dt: time since the last step [s].
            at_rest: the robot certainly stands: what the sensor reads is its offset (tilt, temperature).
        """
        valid = math.hypot(*reading) <= LARGEST_M_S2 and math.isfinite(yaw_rate)
        if valid:
            self._last = reading
            if at_rest:
                self._level(reading, dt)
        yaw_acceleration = self._slope(yaw_rate, dt) if valid else 0.0
        rate = yaw_rate if valid else self._smooth_rate or 0.0
        (x, y), offset = self._last, self._offset
        point = rotated((x - offset[0], y - offset[1]), self._mounting.rotation_rad)
        euler, centripetal = turning_terms(self._mounting, rate, yaw_acceleration)
        centre = (point[0] - euler[0] - centripetal[0], point[1] - euler[1] - centripetal[1])
        return CentreAcceleration(centre, point, euler, centripetal, offset, valid)

    def _level(self, reading: Vector, dt: float) -> None:
        part = 1 - math.exp(-dt / LEVELLING_S)
        (x, y), (old_x, old_y) = reading, self._offset
        self._offset = (old_x + part * (x - old_x), old_y + part * (y - old_y))

    def _slope(self, yaw_rate: float, dt: float) -> float:
        """How fast the smoothed yaw rate changes."""
        if self._smooth_rate is None or not dt > 0:
            self._smooth_rate = yaw_rate
            return 0.0
        change = (yaw_rate - self._smooth_rate) * (1 - math.exp(-dt / self._smoothing_s))
        self._smooth_rate += change
        return change / dt


def rotated(vector: Vector, angle_rad: float) -> Vector:
    """The vector turned counter-clockwise: what has these components in a frame turned by the angle."""
    (x, y), cos, sin = vector, math.cos(angle_rad), math.sin(angle_rad)
    return (cos * x - sin * y, sin * x + cos * y)


def turning_terms(mounting: Mounting, yaw_rate: float, yaw_acceleration: float) -> tuple[Vector, Vector]:
    """Euler's and the centripetal term [m/s2] that turning [rad/s, rad/s2] adds at the sensor, in the robot's frame."""
    x, y = mounting.x_m, mounting.y_m
    square = yaw_rate * yaw_rate
    return (-yaw_acceleration * y, yaw_acceleration * x), (-square * x, -square * y)
