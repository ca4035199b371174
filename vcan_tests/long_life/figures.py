"""What a long life takes: memory, tasks, file descriptors and logs, and whether they stay as they were."""

from __future__ import annotations

import asyncio
import gc
import os
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import matplotlib as mpl
import numpy as np

mpl.use("Agg")
from matplotlib import pyplot as plt

WARM_UP_S: Final = 1800.0
"""Until then memory may grow: the last minute's record, caches and the allocator's pools fill."""
JUDGED_S: Final = 3600.0
"""A life has to last so long beyond it before the growth of its memory says anything."""
GROWTH_H: Final = {"memory_kib": 256.0, "objects": 500.0, "blocks": 2000.0}
"""Largest growth in an hour; what is left of one visit of hundreds shows. Resident memory may grow though all that was
used is given back: what is new does not fit where the old was."""
LOGS, RUNS = "record", "runs"
_PAGE_KIB: Final = os.sysconf("SC_PAGE_SIZE") // 1024


@dataclass(frozen=True, slots=True)
class Sample:
    """One look at a process whose robot rests and whose clients have gone.

    Attributes:
        time_s: virtual time.
        memory_kib: resident memory.
        objects: that the garbage collector knows, after a collection.
        blocks: of memory that Python uses; with those that no collector knows, as numbers and bytes.
        tasks: of the loop.
        descriptors: that are open.
        log_bytes: of the continuous record.
        run_bytes: of all runs.
        faults: that were struck so far.
    """

    time_s: float
    memory_kib: int
    objects: int
    blocks: int
    tasks: int
    descriptors: int
    log_bytes: int
    run_bytes: int
    faults: int


def take_sample(folder: Path, faults: int) -> Sample:
    """Look at this process, and at the folders of its logs and runs, now."""
    gc.collect()
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return Sample(
        round(asyncio.get_running_loop().time(), 3),
        pages * _PAGE_KIB,
        len(gc.get_objects()),
        sys.getallocatedblocks(),
        len(asyncio.all_tasks()),
        len(os.listdir("/proc/self/fd")),
        _size(folder / LOGS),
        _size(folder / RUNS),
        faults,
    )


def _size(folder: Path) -> int:
    return sum(path.stat().st_size for path in folder.rglob("*") if path.is_file())


def growth_per_h(samples: Sequence[Sample], field: str) -> float | None:
    """Slope of the least-squares line after the warm-up [1/h]; None where there is too little of it."""
    judged = [sample for sample in samples if sample.time_s >= WARM_UP_S]
    if not judged or judged[-1].time_s - judged[0].time_s < JUDGED_S:
        return None
    hours = [sample.time_s / 3600.0 for sample in judged]
    return float(np.polyfit(hours, [getattr(sample, field) for sample in judged], 1)[0])


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
    for field, bound in GROWTH_H.items():
        growth = growth_per_h(samples, field)
        if growth is not None and growth > bound:
            found.append(f"{field} grows by {growth:.0f} an hour, at most {bound:g} are allowed")
    return found


def table(samples: Sequence[Sample]) -> list[dict[str, Any]]:
    """Rows of the first sample of each hour, and the last one."""
    rows = {int(sample.time_s // 3600.0): sample for sample in reversed(samples)}
    return [_row(sample) for sample in (*(rows[hour] for hour in sorted(rows)), samples[-1])]


def _row(sample: Sample) -> dict[str, Any]:
    return {
        "hours": f"{sample.time_s / 3600.0:.2f}",
        "MiB": f"{sample.memory_kib / 1024:.1f}",
        "objects": sample.objects,
        "blocks": sample.blocks,
        "tasks": sample.tasks,
        "descriptors": sample.descriptors,
        "record MB": f"{sample.log_bytes / 1e6:.1f}",
        "runs MB": f"{sample.run_bytes / 1e6:.1f}",
        "faults": sample.faults,
    }


def draw(samples: Sequence[Sample], path: Path) -> None:
    """All of it over the hours."""
    hours = [sample.time_s / 3600.0 for sample in samples]
    panels = (
        ("resident memory [MiB]", [sample.memory_kib / 1024 for sample in samples]),
        ("objects", [sample.objects for sample in samples]),
        ("blocks of memory", [sample.blocks for sample in samples]),
        ("tasks", [sample.tasks for sample in samples]),
        ("descriptors", [sample.descriptors for sample in samples]),
        ("record and runs [MB]", [(sample.log_bytes + sample.run_bytes) / 1e6 for sample in samples]),
        ("faults struck", [sample.faults for sample in samples]),
    )
    figure, rows = plt.subplots(len(panels), 1, figsize=(10, 12.5), sharex=True, layout="constrained")
    figure.suptitle("A simulated MAX2D among people, programs and faults: each point at rest, with no client")
    for axes, (label, values) in zip(rows, panels, strict=True):
        axes.plot(hours, values, ".-", color="#0072B2", markersize=3, linewidth=0.8)
        axes.set_ylabel(label)
        axes.set_ylim(bottom=0)
        axes.grid(visible=True, alpha=0.3)
    rows[-1].set_xlabel("virtual time [h]")
    figure.savefig(path, dpi=90)
    plt.close(figure)
