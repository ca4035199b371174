"""The fit of a sensor's angle to the true one: a polynomial correction and a hysteresis, whatever single readings say.

The model is: true = sensed + correction(sensed) + direction * hysteresis / 2, a play between axis and sensor letting it
say too little on the way up. The degree of the polynomial is that of the smallest Bayesian information criterion
(Schwarz 1978). Weights begin with Huber's and end with Tukey's (Huber & Ronchetti, Robust Statistics, 7.8), so that a
slip of the pen counts for nothing.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final, TypeAlias

import numpy as np

from canhelm.errors import ConfigError, UsageError
from daemon.calibration.readings import Reading
from profiles.sensors import AngleCalibration

Array: TypeAlias = "np.ndarray[Any, np.dtype[np.float64]]"

FEWEST: Final = 8
HIGHEST_DEGREE: Final = 6
READINGS_PER_TERM: Final = 3
HUBER: Final = 1.345
TUKEY: Final = 4.685
"""Residual, in standard deviations, from which a reading is left out."""
ITERATIONS: Final = 20
FINEST_DEG: Final = 1e-6
NORMAL: Final = 1.4826
"""Standard deviation of a normal distribution over its median absolute deviation."""


@dataclass(frozen=True, slots=True)
class Fit:
    """A calibration, and how good it is.

    Attributes:
        calibration: for the profile.
        offset_deg: correction where the sensor says 0.
        gain: true angle over the sensor's, of the straight line that fits best.
        nonlinearity_deg: largest distance of the curve from that line.
        worst_deg: largest residual of the readings that count.
        residual_deg: of each reading, the hysteresis taken out.
        left_out: numbers of the readings that do not count.
    """

    calibration: AngleCalibration
    offset_deg: float
    gain: float
    nonlinearity_deg: float
    worst_deg: float
    residual_deg: tuple[float, ...]
    left_out: tuple[int, ...]


def fit(readings: Sequence[Reading]) -> Fit:
    """Fit a correction to readings.

    Raises:
        UsageError: there are too few readings, or all of one angle.
        ConfigError: the sensor turns against the axis, or does not follow it.
    """
    sensed = np.array([reading.sensed_deg for reading in readings])
    true = np.array([reading.true_deg for reading in readings])
    direction = np.array([reading.direction for reading in readings], dtype=float)
    if len(readings) < FEWEST or np.ptp(sensed) < math.sqrt(FINEST_DEG):
        message = f"{len(readings)} readings over {np.ptp(sensed) if len(sensed) else 0:g} degrees make no calibration"
        raise UsageError(message, limit=f"at least {FEWEST} readings", remedy="take all passes, over the whole range")
    low, high = float(sensed.min()), float(sensed.max())
    place = 2 * (sensed - low) / (high - low) - 1
    degrees = [d for d in range(HIGHEST_DEGREE + 1) if READINGS_PER_TERM * (d + 2) <= len(readings)]
    fits = [_robust(np.column_stack([_powers(place, degree), direction / 2]), true - sensed) for degree in degrees]
    terms, residuals, scale, _ = min(fits, key=lambda found: found[3])
    counts = np.abs(residuals) <= TUKEY * scale
    calibration = AngleCalibration(
        from_deg=low,
        to_deg=high,
        correction_deg=tuple(map(float, terms[:-1])),
        hysteresis_deg=float(terms[-1]),
        residual_deg=float(np.sqrt(np.mean(residuals[counts] ** 2))),
        readings=len(readings),
    )
    _check_follows(calibration)
    gain, nonlinearity = _line(calibration)
    return Fit(
        calibration,
        calibration.correct(0.0),
        gain,
        nonlinearity,
        float(np.abs(residuals[counts]).max()),
        tuple(map(float, residuals)),
        tuple(int(number) for number in np.flatnonzero(~counts)),
    )


def _powers(place: Array, degree: int) -> Array:
    return np.vander(place, degree + 1, increasing=True)


def _robust(design: Array, values: Array) -> tuple[Array, Array, float, float]:
    """Terms, residuals, their standard deviation and the information criterion."""
    weights = np.ones_like(values)
    for round_ in range(ITERATIONS):
        terms = np.asarray(
            np.linalg.lstsq(design * weights[:, None], values * weights, rcond=None)[0], dtype=np.float64
        )
        residuals = values - design @ terms
        scale = max(FINEST_DEG, NORMAL * float(np.median(np.abs(residuals))))
        size = np.maximum(np.abs(residuals) / scale, FINEST_DEG)
        if round_ < ITERATIONS // 2:
            weights = np.sqrt(np.minimum(1.0, HUBER / size))
        else:
            weights = np.where(size < TUKEY, 1 - (size / TUKEY) ** 2, 0.0)
    bounded = np.minimum(np.abs(residuals), TUKEY * scale)
    variance = max(FINEST_DEG**2, float(np.mean(bounded**2)))
    return terms, residuals, scale, len(values) * math.log(variance) + len(terms) * math.log(len(values))


def _curve(calibration: AngleCalibration) -> tuple[Array, Array]:
    sensed = np.linspace(calibration.from_deg, calibration.to_deg, 200)
    return sensed, np.array([calibration.correct(float(angle)) for angle in sensed])


def _check_follows(calibration: AngleCalibration) -> None:
    steps = np.diff(_curve(calibration)[1])
    if steps.max() < 0:
        raise ConfigError("the sensor counts against the axis", remedy="turn its direction: in the profile, begin anew")
    if steps.min() <= 0:
        message = "the sensor does not follow the axis everywhere: its angle belongs to more than one"
        raise ConfigError(message, remedy="check its mounting; look at the readings that stand apart in the picture")


def _line(calibration: AngleCalibration) -> tuple[float, float]:
    """Gain of the straight line through the curve, and its largest distance from it."""
    sensed, true = _curve(calibration)
    gain, offset = np.polyfit(sensed, true, 1)
    return float(gain), float(np.abs(true - gain * sensed - offset).max())
