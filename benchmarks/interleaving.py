"""Rows of a table measured in turn, so that a machine whose speed drifts slows all of them alike."""

from __future__ import annotations

import gc
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from statistics import median
from typing import Any, NamedTuple, Protocol

from benchmarks.section import Table

FEWEST_TURNS = 3
HOW_RATIOS = "medians of all turns, a ratio that of each turn's ratios, not of the medians"


class Row(Protocol):
    """One way to do the same work.

    Attributes:
        name: for people.
        key: in the JSON file.
    """

    name: str
    key: str

    def run(self, count: int) -> None:
        """Do it so many times."""

    def close(self) -> None:
        """End what it has opened."""


class Cost(NamedTuple):
    """Of one round.

    Attributes:
        cpu_us: processor time of the whole process, all threads.
        wall_us: time on the wall.
    """

    cpu_us: float
    wall_us: float


class Measured:
    """What the turns of all rows have cost.

    Args:
        rows: that were measured.
        turns: of each row, by its key; those of one number followed each other.
    """

    def __init__(self, rows: Sequence[Row], turns: Mapping[str, Sequence[Cost]]) -> None:
        self.rows = rows
        self._turns = turns

    def cost(self, key: str) -> Cost:
        """The median of a row."""
        return Cost(*map(median, zip(*self._turns[key], strict=True)))

    def ratio(self, key: str, other: str, without: str | None = None) -> float:
        """How many times as much CPU one row takes as another one: the median of the turns.

        Args:
            key: of the row.
            other: what it is compared with.
            without: of a row whose cost is taken off the first one's before.
        """
        less = self._turns[without] if without else [Cost(0.0, 0.0)] * len(self._turns[key])
        turns = zip(self._turns[key], self._turns[other], less, strict=True)
        return median((one.cpu_us - off.cpu_us) / two.cpu_us for one, two, off in turns)

    def table(self, title: str, floor: str, asyncio_floor: str) -> Table:
        """All rows beside the two floors."""
        rows = [
            (row.name, *self.cost(row.key), self.ratio(row.key, floor), self.ratio(row.key, asyncio_floor))
            for row in self.rows
        ]
        return Table(f"{title}; {HOW_RATIOS}", ("", "CPU [us]", "wall [us]", "x floor", "x asyncio floor"), rows)

    def figures(self) -> dict[str, Any]:
        """The medians of all rows, for the JSON file."""
        return {row.key: {"name": row.name, **self.cost(row.key)._asdict()} for row in self.rows}


def measure(rows: Sequence[Row], count: int, seconds: float, tell: Callable[[str], None]) -> Measured:
    """Run all rows in turn, and close them.

    Args:
        rows: what to compare. Each is warmed up first.
        count: rounds of a row before the next row has its turn.
        seconds: for all of them together, about; each has three turns at least.
        tell: hears how far it is.
    """
    turns: dict[str, list[Cost]] = {row.key: [] for row in rows}
    with ExitStack() as opened:
        for row in reversed(rows):
            opened.callback(row.close)
        for row in rows:
            row.run(count)
        end = time.monotonic() + seconds
        while len(turns[rows[0].key]) < FEWEST_TURNS or time.monotonic() < end:
            tell(f"turn {len(turns[rows[0].key]) + 1}")
            for row in rows:
                turns[row.key].append(_turn(row, count))
    return Measured(rows, turns)


def verdict(ratio: float, wanted: float) -> str:
    """Whether a ratio is at most what was wanted."""
    return "met" if ratio <= wanted else "missed"


def _turn(row: Row, count: int) -> Cost:
    gc.collect()
    cpu_s, wall_s = time.process_time(), time.perf_counter()
    row.run(count)
    cpu_s, wall_s = time.process_time() - cpu_s, time.perf_counter() - wall_s
    return Cost(cpu_s / count * 1e6, wall_s / count * 1e6)
