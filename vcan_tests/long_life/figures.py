"""Whether memory, tasks, descriptors and logs of a long life stay as they were: a verdict, a table and a picture."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any, Final

import matplotlib as mpl
import numpy as np

from vcan_tests.long_life.samples import Sample

mpl.use("Agg")
from matplotlib import pyplot as plt

JUDGED_H: Final = 1.0
"""What has to be left of a life after its warm-up before its growth says anything."""
PARTS: Final = 10
"""Of the time judged. The least of each counts: what is under way at one look has gone at another, a leak has not."""
GROWTH: Final = {
    "memory_kib": (256.0, 4096.0),
    "heap_kib": (64.0, 256.0),
    "objects": (20.0, 60.0),
    "blocks": (100.0, 400.0),
}
"""Most in an hour, which sees about 45 faults, so that what one of each leaves behind shows; and what is none in all:
resident memory comes and goes by Python's arenas of 1 MiB, and what is new does not always fit where the old was."""


def judged(samples: Sequence[Sample]) -> Sequence[Sample]:
    """Those after the warm-up: the record and the runs have let old files go, and nothing happens for the first time.

    Whatever else keeps only the newest (a minute of cycles, events, frames, caches of functions) is full by then.
    """
    full = max(_first_fall([one.log_bytes for one in samples]), _first_fall([one.run_bytes for one in samples]))
    return [one for one in samples[full:] if one.kinds == samples[-1].kinds]


def _first_fall(values: Sequence[int]) -> int:
    """Index of the first value that is less than the one before; beyond the last where there is none."""
    return next((index for index, (old, new) in enumerate(pairwise(values), 1) if new < old), len(values))


def growth_per_h(samples: Sequence[Sample], field: str) -> tuple[float, float] | None:
    """Growth in the time judged, and its bound [1/h]; None where too little is left of a life after its warm-up.

    It is the slope of the least-squares line through the least value of each part.
    """
    full = judged(samples)
    judged_h = (full[-1].time_s - full[0].time_s) / 3600.0 if full else 0.0
    if judged_h < JUDGED_H or len(full) < PARTS:
        return None
    parts = np.array_split(np.array([(one.time_s / 3600.0, getattr(one, field)) for one in full]), PARTS)
    growth_h = np.polyfit([part[:, 0].mean() for part in parts], [part[:, 1].min() for part in parts], 1)[0]
    bound_h, none = GROWTH[field]
    return float(growth_h), max(bound_h, none / judged_h)


def complaints(samples: Sequence[Sample], log_limit: int, run_limit: int) -> list[str]:
    """What is not flat.

    Tasks and descriptors have to be as many as in the first sample, logs within their limits, growth within its bounds.
    """
    first = samples[0]
    found = []
    for field in ("tasks", "descriptors"):
        odd = next((one for one in samples if getattr(one, field) != getattr(first, field)), None)
        if odd is not None:
            found.append(f"{getattr(odd, field)} {field} at {odd.time_s:g} s, {getattr(first, field)} at the beginning")
    for field, limit in (("log_bytes", log_limit), ("run_bytes", run_limit)):
        most = max(getattr(one, field) for one in samples)
        if most > limit:
            found.append(f"{field} come to {most}, at most {limit} are allowed")
    for field in GROWTH:
        growth = growth_per_h(samples, field)
        if growth is not None and growth[0] > growth[1]:
            found.append(f"{field} grows by {growth[0]:.0f} an hour, at most {growth[1]:.0f} are allowed")
    return found


def table(samples: Sequence[Sample]) -> list[dict[str, Any]]:
    """Rows of the first sample of each hour, and the last one."""
    rows = {int(sample.time_s // 3600.0): sample for sample in reversed(samples)}
    return [_row(sample) for sample in (*(rows[hour] for hour in sorted(rows)), samples[-1])]


def _row(sample: Sample) -> dict[str, Any]:
    return {
        "hours": f"{sample.time_s / 3600.0:.2f}",
        "MiB": f"{sample.memory_kib / 1024:.1f}",
        "heap": f"{sample.heap_kib / 1024:.2f}",
        "objects": sample.objects,
        "blocks": sample.blocks,
        "tasks": sample.tasks,
        "files": sample.descriptors,
        "record MB": f"{sample.log_bytes / 1e6:.1f}",
        "runs MB": f"{sample.run_bytes / 1e6:.1f}",
        "faults": sample.faults,
    }


def draw(samples: Sequence[Sample], path: Path) -> None:
    """All of it over the hours."""
    hours = [sample.time_s / 3600.0 for sample in samples]
    panels = (
        ("resident memory [MiB]", [sample.memory_kib / 1024 for sample in samples]),
        ("heap [MiB]", [sample.heap_kib / 1024 for sample in samples]),
        ("objects", [sample.objects for sample in samples]),
        ("blocks of memory", [sample.blocks for sample in samples]),
        ("tasks", [sample.tasks for sample in samples]),
        ("descriptors", [sample.descriptors for sample in samples]),
        ("record and runs [MB]", [(sample.log_bytes + sample.run_bytes) / 1e6 for sample in samples]),
        ("faults struck", [sample.faults for sample in samples]),
    )
    figure, rows = plt.subplots(len(panels), 1, figsize=(10, 14), sharex=True, layout="constrained")
    figure.suptitle("A simulated MAX2D among people, programs and faults: each point at rest, with no client")
    for axes, (label, values) in zip(rows, panels, strict=True):
        axes.plot(hours, values, ".-", color="#0072B2", markersize=3, linewidth=0.8)
        axes.set_ylabel(label)
        axes.set_ylim(bottom=0)
        axes.grid(visible=True, alpha=0.3)
    rows[-1].set_xlabel("virtual time [h]")
    figure.savefig(path, dpi=90)
    plt.close(figure)
