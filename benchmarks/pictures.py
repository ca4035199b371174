"""Pictures of the benchmark."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import matplotlib as mpl

from benchmarks.spread import histogram, log_edges, spread

mpl.use("Agg")
from matplotlib import pyplot as plt

COLOURS = ("#0072B2", "#E69F00", "#009E73", "#CC79A7", "#56B4E9", "#D55E00")
"""Okabe and Ito's palette, which colour-blind people can tell apart."""
BINS_PER_DECADE = 12


def panels(rows: int, columns: int, size: tuple[float, float], **options: Any) -> tuple[Any, list[Any]]:
    """A figure and its panels, row by row; ``size`` in inches."""
    figure, grid = plt.subplots(rows, columns, figsize=size, layout="constrained", squeeze=False, **options)
    for axes in grid.flat:
        axes.grid(visible=True, which="both", alpha=0.3)
    return figure, list(grid.flat)


def saved(figure: Any, path: Path) -> Path:
    """Write a picture and let go of it; its path."""
    figure.savefig(path, dpi=90)
    plt.close(figure)
    return path


def draw_histograms(values_us: Mapping[str, Sequence[float]], title: str, label: str, path: Path) -> Path:
    """Times one above the other on one logarithmic scale, with their medians and, of 100 or more, 99th percentiles.

    Args:
        values_us: the times by what they are of.
        title: of the picture.
        label: of the scale.
        path: of the picture.
    """
    least, most = min(map(min, values_us.values())), max(map(max, values_us.values()))
    edges = log_edges(max(least, 0.1), max(most, 1.1 * least, 0.2), BINS_PER_DECADE)
    figure, rows = panels(len(values_us), 1, (9, 1 + 1.8 * len(values_us)), sharex=True)
    figure.suptitle(title)
    for axes, colour, (words, values) in zip(rows, COLOURS, values_us.items(), strict=False):
        axes.stairs(histogram(values, edges), edges, fill=True, color=colour, alpha=0.7)
        found = spread(values)
        marks = {"p50": (found.p50, "-"), "p99": (found.p99, "--")}
        known = {name: (value, style) for name, (value, style) in marks.items() if value is not None}
        for value, style in known.values():
            axes.axvline(value, color="black", linestyle=style, linewidth=0.9)
        told = ", ".join(f"{name} {value:.0f} µs" for name, (value, _) in known.items())
        axes.set_title(f"{words}: {told}", fontsize="small", loc="left")
        axes.set_xscale("log")
    rows[-1].set_xlabel(f"{label} [µs]")
    return saved(figure, path)
