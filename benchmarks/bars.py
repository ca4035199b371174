"""The rows of a table as bars."""

from __future__ import annotations

from pathlib import Path

import matplotlib as mpl

from benchmarks.interleaving import Measured

mpl.use("Agg")
from matplotlib import pyplot as plt

OURS, OTHERS = "#0072B2", "#E69F00"
"""Of Okabe and Ito's palette, which colour-blind people can tell apart."""


def draw_bars(found: Measured, title: str, path: Path) -> Path:
    """The CPU of each row, the first one on top."""
    names = [row.name for row in found.rows]
    costs = [found.cost(row.key).cpu_us for row in found.rows]
    colours = [OURS if "canhelm" in name else OTHERS for name in names]
    figure, axes = plt.subplots(figsize=(9, 0.5 * len(names) + 1), layout="constrained")
    axes.bar_label(axes.barh(names, costs, color=colours), fmt="%.0f", padding=3)
    axes.invert_yaxis()
    axes.set_title(title)
    axes.margins(x=0.1)
    figure.savefig(path, dpi=90)
    plt.close(figure)
    return path
