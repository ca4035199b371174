"""An accelerometer somewhere on the robot: it reads the change of its own velocity, along its own axes.

What pulls at everything alike, gravity on a slope, it does not feel: that is taken off.

Nothing is known here of centripetal and Euler terms: the velocity of the sensor's place on the floor is differenced
from step to step, which has them in it. A first-order filter stands for the sensor's bandwidth.
"""

from __future__ import annotations

from math import cos, radians, sin
from random import Random

from profiles.schema import AccelerometerConfig

BANDWIDTH_S = 0.012
"""Time constant of the filter that keeps what is faster than the control cycle from its samples (assumed)."""


class SimulatedAccelerometer:
    """Two axes in the robot's plane.

    Args:
        config: where it sits and what voltage it gives.
        noise_m_s2: standard deviation of one reading.
        seed: of the noise.

    Attributes:
        acceleration_m_s2: along its axes, without noise.
        gain: multiplies what it reads, to impose an error.
    """

    def __init__(self, config: AccelerometerConfig, noise_m_s2: float, seed: int) -> None:
        self.acceleration_m_s2 = (0.0, 0.0)
        self.gain = 1.0
        self._x_m, self._y_m = config.x_m, config.y_m
        angle = radians(config.rotation_deg)
        self._cos, self._sin = cos(angle), sin(angle)
        self._mv_per_m_s2, self._zero_mv = config.sensitivity_mv_per_m_s2, config.zero_mv
        self._noise_m_s2 = noise_m_s2
        self._random = Random(seed)
        self._last_vx = self._last_vy = 0.0

    def follow(
        self, vx: float, vy: float, yaw_rate: float, c: float, s: float, dt_s: float, pull: tuple[float, float]
    ) -> None:
        """Take over the robot's motion after one step.

        Args:
            vx, vy: velocity of the robot's centre on the floor.
            yaw_rate: of the robot.
            c, s: cosine and sine of its yaw angle.
            dt_s: length of the step.
            pull: acceleration by gravity along the floor.
        """
        x, y = self._x_m * c - self._y_m * s, self._x_m * s + self._y_m * c
        vx, vy = vx - yaw_rate * y, vy + yaw_rate * x
        ax, ay = (vx - self._last_vx) / dt_s - pull[0], (vy - self._last_vy) / dt_s - pull[1]
        self._last_vx, self._last_vy = vx, vy
        along_x, along_y = self._along_axes(ax, ay, c, s)
        share = dt_s / (BANDWIDTH_S + dt_s)
        old_x, old_y = self.acceleration_m_s2
        self.acceleration_m_s2 = (old_x + share * (along_x - old_x), old_y + share * (along_y - old_y))

    def rest(self, c: float, s: float, pull: tuple[float, float]) -> None:
        """The robot has come to rest; arguments as of :meth:`follow`."""
        self._last_vx = self._last_vy = 0.0
        self.acceleration_m_s2 = self._along_axes(-pull[0], -pull[1], c, s)

    def _along_axes(self, ax: float, ay: float, c: float, s: float) -> tuple[float, float]:
        ahead, left = ax * c + ay * s, ay * c - ax * s
        return ahead * self._cos + left * self._sin, left * self._cos - ahead * self._sin

    def voltage_mv(self, axis: int) -> float:
        """Voltage of axis 0 (x) or 1 (y), with noise."""
        reading = self.gain * self.acceleration_m_s2[axis] + self._random.gauss(0.0, self._noise_m_s2)
        return self._zero_mv + self._mv_per_m_s2 * reading
