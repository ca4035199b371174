"""The picture of a fault campaign: how long the robot took to rest, by kind of fault."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Final

import matplotlib as mpl

from daemon.campaigns.faults.outcome import MANOEUVRES, Outcome
from daemon.campaigns.faults.strikes import STRIKES

mpl.use("Agg")
from matplotlib import pyplot as plt

COLOURS: Final = dict(zip(MANOEUVRES, ("#CC79A7", "#0072B2", "#E69F00", "#009E73"), strict=True))
"""Okabe and Ito's palette, which colour-blind people can tell apart."""


def draw_rests(outcomes: Iterable[Outcome], folder: Path) -> Path:
    """A dot for each injection that stopped a robot in motion: from the fault until the last wheel stood."""
    stopped = [outcome for outcome in outcomes if outcome.rest_s is not None]
    names = [name for name in STRIKES if any(outcome.strike == name for outcome in stopped)]
    figure, axes = plt.subplots(figsize=(10, 1.5 + 0.25 * len(names)), layout="constrained")
    for manoeuvre, colour in COLOURS.items():
        dots = [(o.rest_s, names.index(o.strike)) for o in stopped if o.manoeuvre == manoeuvre]
        if dots:
            axes.plot(*zip(*dots, strict=True), "o", color=colour, alpha=0.4, markersize=4, label=manoeuvre)
    axes.set_yticks(range(len(names)), names)
    axes.invert_yaxis()
    axes.set_xlabel("from the fault until the last wheel stands [s]")
    axes.grid(visible=True, axis="x", alpha=0.3)
    if stopped:
        axes.legend(fontsize="small")
    path = folder / "faults.png"
    figure.savefig(path, dpi=90)
    plt.close(figure)
    return path
