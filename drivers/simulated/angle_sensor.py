"""What a simulated angle sensor makes of its axis: offset, gain, non-linearity, play on the way back, and noise."""

from __future__ import annotations

import math
from collections.abc import Callable
from random import Random

from profiles.sensors import SensorDefects


class SimulatedAngleSensor:
    """One sensor.

    Args:
        defects: what it does wrong.
        seed: of its noise.

    Attributes:
        held_rad: where somebody holds its axis, as for a calibration; None: the vehicle turns it.
        broken: what it says instead of an angle; None: it is whole.
    """

    def __init__(self, defects: SensorDefects, seed: str = "") -> None:
        self._defects = defects
        self.held_rad: float | None = None
        self.broken: Callable[[float], float] | None = None
        self._play_rad = math.radians(defects.hysteresis_deg) / 2
        self._follower_rad = 0.0
        self._random = Random(seed)

    def sense(self, axis_rad: float) -> float:
        """The angle that it says [rad] when the vehicle has its axis at ``axis_rad``."""
        axis = axis_rad if self.held_rad is None else self.held_rad
        self._follower_rad = min(max(self._follower_rad, axis - self._play_rad), axis + self._play_rad)
        wave = math.radians(self._defects.nonlinearity_deg) * math.sin(2 * self._follower_rad)
        said = self._defects.gain * self._follower_rad + math.radians(self._defects.offset_deg) + wave
        if self.broken is not None:
            said = self.broken(said)
        noise_deg = self._defects.noise_deg
        return said + math.radians(self._random.gauss(0.0, noise_deg)) if noise_deg else said
