"""The bending angle between truck and trailer from its noisy sensor and from how the vehicle moves.

Between two readings the angle changes as the kinematics say (thesis, eq. 2.14); the sensor takes the rest of the error
back with a time constant. So noise is averaged away without the lag that a filter of the sensor alone would have.
"""

from __future__ import annotations

import math
from typing import Final

from daemon.loops.articulated import Hitch

SETTLE_S: Final = 0.3
"""Time constant in which the sensor is believed; slipping tyres spoil less in it than the sensor has noise."""
JUMP_RAD: Final = math.radians(3.0)
"""The sensor's noise is smaller. Farther off it was set anew, or the vehicle was moved, and it is believed at once."""


class BendingObserver:
    """Follows one hitch.

    Args:
        hitch: between truck and trailer.
    """

    def __init__(self, hitch: Hitch) -> None:
        self._hitch = hitch
        self._bending_rad: float | None = None

    def update(self, sensed_rad: float, way_m: float, curvature: float, dt_s: float) -> float:
        """The angle now.

        Args:
            sensed_rad: by the sensor.
            way_m: of the truck's rear axle since the last call, negative backwards.
            curvature: of that way [1/m].
            dt_s: time since the last call.
        """
        last = self._bending_rad
        if last is None:
            last = sensed_rad
        expected = last + way_m * self._hitch.bending_rate(curvature, last)
        error = sensed_rad - expected
        believed = 1.0 if abs(error) > JUMP_RAD else -math.expm1(-dt_s / SETTLE_S)
        self._bending_rad = expected + believed * error
        return self._bending_rad
