"""What a profile says of angle sensors: how a calibrated one is corrected, and what is wrong with a simulated one."""

from __future__ import annotations

from typing import Annotated

from msgspec import Meta

from profiles.parts import NotNegative, Part, Positive


class AngleCalibration(Part, frozen=True, kw_only=True):
    """The true angle over what the sensor says, as `canhelm calibrate` has measured it."""

    from_deg: float
    """Smallest angle of the sensor that was compared."""
    to_deg: float
    """Largest one; beyond both, the correction stays what it is there."""
    correction_deg: Annotated[tuple[float, ...], Meta(min_length=1)]
    """What is added to the sensor's angle: a polynomial over the range as -1 to 1, coefficients from power 0 up."""
    hysteresis_deg: float
    """Difference between both directions of turning; it is not corrected."""
    residual_deg: NotNegative
    """Root mean square of what is left."""
    readings: Annotated[int, Meta(ge=1)]
    """Number of angles that were compared."""

    def correct(self, sensed_deg: float) -> float:
        """The true angle [degrees] for what the sensor says."""
        half = (self.to_deg - self.from_deg) / 2
        place = (min(max(sensed_deg, self.from_deg), self.to_deg) - self.from_deg) / half - 1 if half else 0.0
        correction = 0.0
        for coefficient in reversed(self.correction_deg):
            correction = correction * place + coefficient
        return sensed_deg + correction


class SensorDefects(Part, frozen=True, kw_only=True):
    """What a simulated angle sensor does wrong: it says gain * angle + offset + a wave, late by half the hysteresis."""

    offset_deg: float = 0.0
    gain: Positive = 1.0
    nonlinearity_deg: float = 0.0
    """Amplitude of an error that goes through one wave in half a turn, as of a magnet off its centre."""
    hysteresis_deg: NotNegative = 0.0
    """Play between the axis and the sensor."""
    noise_deg: NotNegative = 0.0
    """Standard deviation of one reading."""
