"""Angles that a person read off a protractor, beside what the sensor said, and the passes in which they are taken."""

from __future__ import annotations

import csv
import math
from collections.abc import Iterator, Sequence
from dataclasses import astuple, dataclass, fields
from pathlib import Path
from typing import Final

from canhelm.errors import UsageError

FULL_TURN_DEG: Final = 360.0
ALIKE_DEG: Final = 3.0
"""Wheels below this angle have no centre of turning worth the name; the mean of both is their angle."""


@dataclass(frozen=True, slots=True)
class Reading:
    """One comparison.

    Attributes:
        run: number of the pass, from 1.
        direction: in which the axis was turned to get there: 1 counter-clockwise, -1 clockwise, 0 unknown.
        true_deg: by the protractor.
        sensed_deg: by the sensor, not corrected.
    """

    run: int
    direction: int
    true_deg: float
    sensed_deg: float


_WROTE: Final = "give a file that `canhelm calibrate` wrote"
COLUMNS: Final = tuple(field.name for field in fields(Reading))


@dataclass(frozen=True, slots=True)
class Station:
    """An angle to turn to, and from which side."""

    run: int
    direction: int
    about_deg: float


def stations(range_deg: float, step_deg: float) -> Iterator[Station]:
    """Three passes (thesis, section 5.2): from the middle to each side, then from side to side and back.

    Args:
        range_deg: to each side.
        step_deg: between two stations.
    """
    steps = max(1, round(range_deg / step_deg))
    angles = [range_deg * index / steps for index in range(-steps, steps + 1)]
    middle = angles[steps:]
    for run, way in ((1, [-angle for angle in middle]), (1, middle), (2, angles[::-1]), (3, angles)):
        sense = 1 if way[-1] > way[0] else -1
        yield from (Station(run, sense if number else 0, angle) for number, angle in enumerate(way))


def steering_angle(left_deg: float, right_deg: float) -> float:
    """Angle of the one wheel in the middle that stands for both.

    Its cotangent is the mean of theirs, all three having one centre of turning (Ackermann). Near straight ahead, and
    where both do not turn to one side, it is the mean (thesis, eq. 5.2).
    """
    if min(abs(left_deg), abs(right_deg)) < ALIKE_DEG or left_deg * right_deg < 0:
        return (left_deg + right_deg) / 2
    cotangent = (1 / math.tan(math.radians(left_deg)) + 1 / math.tan(math.radians(right_deg))) / 2
    return math.degrees(math.atan(1 / cotangent))


def write_readings(path: Path, readings: Sequence[Reading]) -> None:
    """Keep readings as CSV. Raises OSError."""
    with path.open("w", encoding="utf-8", newline="") as file:
        csv.writer(file, lineterminator="\n").writerows([COLUMNS, *map(astuple, readings)])


def read_readings(path: Path) -> list[Reading]:
    """Readings from a CSV file.

    Raises:
        UsageError: the file cannot be read, or a line is no reading; the message names file and line.
    """
    try:
        with path.open(encoding="utf-8", newline="") as file:
            rows = list(csv.reader(file))
    except OSError as error:
        raise UsageError(f"cannot read {path}: {error.strerror}", remedy=_WROTE) from None
    except (UnicodeDecodeError, csv.Error):
        raise UsageError(f"{path} is no text with readings", remedy=_WROTE) from None
    if not rows or tuple(rows[0]) != COLUMNS:
        raise UsageError(f"{path}:1 is not {','.join(COLUMNS)}", remedy=_WROTE)
    return [_reading(row, f"{path}:{number}") for number, row in enumerate(rows[1:], start=2)]


def _reading(row: list[str], where: str) -> Reading:
    try:
        run, direction, true, sensed = row
        reading = Reading(int(run), int(direction), float(true), float(sensed))
    except ValueError as error:
        raise UsageError(f"{where} is no reading: {error}", remedy="mend or remove the line") from None
    angles = reading.true_deg, reading.sensed_deg
    if reading.direction not in (-1, 0, 1) or not all(abs(angle) <= FULL_TURN_DEG for angle in angles):
        raise UsageError(f"{where} is no reading: {','.join(row)}", remedy="mend or remove the line")
    return reading
