"""The rows of a run, by columns."""

from __future__ import annotations

import csv
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from canhelm.errors import ConfigError
from daemon.runs.store import CYCLES, Run

TEXTS = (".brake", "limits")
"""Ends of the names of columns that are words."""
SPEED = ".speed_m_s"


@dataclass(frozen=True, slots=True)
class Table:
    """What was measured and commanded in one run, a row a control cycle.

    Attributes:
        numbers: columns of numbers by their names (``rear_left.speed_m_s``); NaN where nothing was known.
        texts: columns of words.
    """

    numbers: Mapping[str, list[float]]
    texts: Mapping[str, list[str]]

    @property
    def time_s(self) -> list[float]:
        """Since the run's begin."""
        return self.numbers["time_s"]

    @property
    def wheels(self) -> list[str]:
        """Names of the drives, in the order of the profile's vehicle."""
        return [name.removesuffix(SPEED) for name in self.numbers if name.endswith(SPEED)]

    def of(self, what: str) -> dict[str, list[float]]:
        """All columns of one quantity (``heading_deg``) by the names of their devices."""
        end = f".{what}"
        return {name.removesuffix(end): column for name, column in self.numbers.items() if name.endswith(end)}

    def limits(self) -> dict[str, list[float]]:
        """When each limit was active, by its name [s]."""
        times: dict[str, list[float]] = {}
        for time_s, names in zip(self.time_s, self.texts["limits"], strict=True):
            for name in names.split():
                times.setdefault(name, []).append(time_s)
        return times


def read_table(run: Run) -> Table:
    """The rows of a run; a last one that was cut short is left out.

    Raises:
        ConfigError: there are none, or columns are missing that every run has.
    """
    path = run.folder / CYCLES
    try:
        with path.open(newline="", encoding="utf-8") as file:
            reader = csv.reader(file)
            head = next(reader, [])
            rows = [row for row in reader if len(row) == len(head)]
        columns = dict(zip(head, map(list, zip(*rows, strict=True)), strict=True)) if rows else {}
        texts = {name: column for name, column in columns.items() if name.endswith(TEXTS)}
        numbers = {name: list(map(_number, column)) for name, column in columns.items() if name not in texts}
    except (OSError, ValueError, csv.Error) as error:
        raise _no_rows(run, f"{path} cannot be read: {error}") from error
    if not rows:
        raise _no_rows(run, f"{path} has no rows")
    if missing := _needed(numbers) - columns.keys():
        raise _no_rows(run, f"{path} has no column {min(missing)}")
    return Table(numbers, texts)


def _needed(numbers: Iterable[str]) -> set[str]:
    """Columns that those of a run presuppose: what was measured of a wheel stands beside what it was told."""
    wheels = {name.rpartition(".")[0] for name in numbers if name.endswith((SPEED, ".current_a"))}
    return {"time_s", "limits", "x_m", "y_m", *(f"{wheel}.commanded_m_s" for wheel in wheels)}


def _number(text: str) -> float:
    return float(text) if text else math.nan


def _no_rows(run: Run, message: str) -> ConfigError:
    return ConfigError(message, remedy=f"the motion was over at once, or its disk was full: see {run.folder}")
