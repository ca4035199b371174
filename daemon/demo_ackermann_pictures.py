"""Pictures of the Ackermann car's demo: heading, speed and steering over time, computed and driven, and the track."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np

from daemon.demo_ackermann import CarResult, CarTrack

mpl.use("Agg")
from matplotlib import pyplot as plt

COMPUTED, DRIVEN, WANTED = "#E69F00", "#0072B2", "#999999"
"""Of Okabe and Ito's palette, which colour-blind people can tell apart."""


def draw(result: CarResult, folder: Path) -> Path:
    """Draw one step into ``folder``; returns the PNG's path."""
    figure, axes = plt.subplots(2, 2, figsize=(12, 8), layout="constrained")
    numbers = result.numbers
    settled = [numbers[part]["settling_s"] for part in ("computed", "achieved")]
    told = ["never" if value is None else f"{value:.2f} s" for value in settled]
    figure.suptitle(
        f"Ackermann car, {result.step.words}\nsettled after {told[0]} by the report's equations, {told[1]} driven"
    )
    step = result.step
    _over_time(axes[0][0], result, "heading_rad", "heading [°]", np.degrees(step.heading_rad))
    _over_time(axes[0][1], result, "speed_m_s", "speed of the rear axle [m/s]", step.speed_m_s)
    _over_time(axes[1][0], result, "steering_rad", "steering angle [°]", None)
    _places(axes[1][1], result)
    path = folder / f"figure-{step.identity}.png"
    figure.savefig(path, dpi=90)
    plt.close(figure)
    return path


def _over_time(axes: Any, result: CarResult, name: str, label: str, wanted: float | None) -> None:
    for track, words, colour, style in _runs(result):
        values = np.array(getattr(track, name))
        shown = np.degrees(values) if name.endswith("_rad") else values
        axes.plot(track.time_s, shown, style, color=colour, label=words)
    if wanted is not None:
        axes.axhline(wanted, color=WANTED, linewidth=0.8, label="set-point")
    axes.set(xlabel="time since the step [s]", ylabel=label)
    axes.grid(visible=True, alpha=0.3)
    axes.legend(fontsize="small")


def _places(axes: Any, result: CarResult) -> None:
    for track, words, colour, style in _runs(result):
        places = np.array(track.place_m) - track.place_m[0]
        axes.plot(places[:, 0], places[:, 1], style, color=colour, label=words)
    axes.set(title="way of the rear axle's middle", xlabel="x [m]", ylabel="y [m]", aspect="equal")
    axes.grid(visible=True, alpha=0.3)
    axes.legend(fontsize="small")


def _runs(result: CarResult) -> tuple[tuple[CarTrack, str, str, str], ...]:
    return (
        (result.computed, "the report's equations", COMPUTED, "--"),
        (result.driven, "driven (simulation)", DRIVEN, "-"),
    )
