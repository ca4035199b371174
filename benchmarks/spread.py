"""How measured values are spread, and how they are counted into bins."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import asdict, dataclass


@dataclass(frozen=True)
class Spread:
    """How values are spread, in their unit.

    Attributes:
        count: of the values.
        p50: the least value that half of them do not exceed.
        p90, p99: likewise 90 and 99 of 100; None where there are too few for one to be beyond it: below 10 and 100.
        worst: the largest.
    """

    count: int
    p50: float
    p90: float | None
    p99: float | None
    worst: float

    def figures(self, unit: str) -> dict[str, float | None]:
        """For the JSON file, with the unit in the names."""
        return {name if name == "count" else f"{name}_{unit}": value for name, value in asdict(self).items()}

    @property
    def cells(self) -> tuple[float | None, ...]:
        """For a table: p50, p90, p99, worst, count."""
        return (self.p50, self.p90, self.p99, self.worst, self.count)


def cell_heads(unit: str) -> tuple[str, ...]:
    """The heads of such cells."""
    return (*(f"{what} [{unit}]" for what in ("p50", "p90", "p99", "worst")), "count")


def spread(values: Sequence[float]) -> Spread:
    """How values are spread, of which there is at least one."""
    ordered = sorted(values)

    def rank(percent: int) -> float:
        return ordered[math.ceil(percent * len(ordered) / 100) - 1]

    p90 = rank(90) if len(ordered) >= 10 else None
    p99 = rank(99) if len(ordered) >= 100 else None
    return Spread(len(ordered), rank(50), p90, p99, ordered[-1])


def log_edges(least: float, most: float, per_decade: int) -> list[float]:
    """Edges of bins that are equally wide on a logarithmic scale."""
    steps = round(per_decade * math.log10(most / least))
    return [least * (most / least) ** (step / steps) for step in range(steps + 1)]


def histogram(values: Sequence[float], edges: Sequence[float]) -> list[int]:
    """How many values lie in each bin from an edge up to the next; those beyond are in the first and last bin."""
    counts = [0] * (len(edges) - 1)
    for value in values:
        counts[min(max(bisect_right(edges, value) - 1, 0), len(counts) - 1)] += 1
    return counts
