"""Turns an axle that a motor of its own steers, closed on the encoder of its angle, also while the vehicle rolls.

Angles and rates are counter-clockwise positive.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

from daemon.loops.geometry import clamp
from daemon.loops.motion_profile import approach_speed, ramp
from profiles.steered import SteeredAxle

GAIN_1_S: Final = 10.0
"""Of the final approach; with three cycles of delay at 100 Hz inside 1/e, so that nothing overshoots."""
GAIN_CYCLES: Final = 0.1
"""Largest gain times cycle: the same distance from overshoot at slower cycles."""
FORGET_S: Final = 0.5
MAX_LAG_RAD: Final = math.radians(10)
"""An axle that is this far from where its commanded rate has taken it does not follow its drive."""

STEERING_LIMIT: Final = "steering_angle"
STEERING_RATE: Final = "steering_rate"


@dataclass(frozen=True, slots=True)
class SteeringStep:
    """One step.

    Attributes:
        rate_rad_s: to command.
        error_rad: permitted target minus angle.
        limits_active: ``steering_angle``, ``steering_rate``.
        failure: why the axle cannot be steered, or "".
    """

    rate_rad_s: float
    error_rad: float
    limits_active: tuple[str, ...]
    failure: str


class SteeredAxleLaw:
    """The position loop of one axle.

    Args:
        axle: its limits.
    """

    def __init__(self, axle: SteeredAxle) -> None:
        self._limit_rad = math.radians(axle.limit_deg)
        self._rate_rad_s = math.radians(axle.rate_deg_s)
        self._acceleration_rad_s2 = math.radians(axle.acceleration_deg_s2)
        self._commanded_rad_s = 0.0
        self._expected_rad = math.nan
        self._failure = ""

    def step(self, target_rad: float | None, angle_rad: float, dt: float) -> SteeringStep:
        """One cycle.

        Args:
            target_rad: where the axle shall point; None: come to rest wherever it is.
            angle_rad: of the axle, by its encoder.
            dt: time since the last step [s].
        """
        self._watch(angle_rad, dt)
        if target_rad is None or self._failure:
            self._commanded_rad_s = ramp(self._commanded_rad_s, 0.0, self._acceleration_rad_s2, dt)
            return SteeringStep(self._commanded_rad_s, 0.0, (), self._failure)
        permitted = clamp(target_rad, self._limit_rad)
        active = (STEERING_LIMIT,) if permitted != target_rad else ()
        error = permitted - angle_rad
        gain = min(GAIN_1_S, GAIN_CYCLES / dt)
        speed = approach_speed(abs(error), gain, self._acceleration_rad_s2 / 2)
        if speed > self._rate_rad_s:
            speed, active = self._rate_rad_s, (*active, STEERING_RATE)
        wanted = math.copysign(speed, error)
        self._commanded_rad_s = ramp(self._commanded_rad_s, wanted, self._acceleration_rad_s2, dt)
        return SteeringStep(self._commanded_rad_s, error, active, "")

    def _watch(self, angle_rad: float, dt: float) -> None:
        """Compare the angle with where the commanded rate should have taken it lately."""
        if not math.isfinite(angle_rad):
            self._failure = "the steering encoder gives no angle; check its cable and its node"
            return
        if math.isnan(self._expected_rad):
            self._expected_rad = angle_rad
        self._expected_rad += self._commanded_rad_s * dt
        self._expected_rad += (angle_rad - self._expected_rad) * min(1.0, dt / FORGET_S)
        if abs(self._expected_rad - angle_rad) > MAX_LAG_RAD:
            self._failure = "the steered axle does not follow its drive; check its encoder, its coupling and its stops"
