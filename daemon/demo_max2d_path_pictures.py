"""The picture of the MAX2D on a path: the path, the pieces that were chosen, the true track, and the deviations."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np

from daemon.demo_max2d_path import FIGURE, PathResult
from daemon.loops.path import Piece

mpl.use("Agg")
from matplotlib import pyplot as plt

COLOURS = ("#0072B2", "#E69F00", "#009E73", "#CC79A7")
"""Okabe and Ito's palette, which colour-blind people can tell apart."""
BARS = (("deviation_m", "planned"), ("driven_deviation_m", "driven, by odometry"), ("true_deviation_m", "driven, true"))


def draw(result: PathResult, folder: Path) -> Path:
    """Draw it into ``folder``; returns the PNG's path."""
    figure, (map_axes, bar_axes) = plt.subplots(1, 2, figsize=(14, 7), layout="constrained")
    numbers = result.numbers
    planned_mm, true_mm = 1e3 * numbers["deviation_m"], 1e3 * numbers["true_deviation_m"]
    figure.suptitle(
        f"The MAX2D follows a path in {len(result.pieces)} pieces: planned within {planned_mm:.0f} mm,\n"
        f"driven by odometry alone within {true_mm:.0f} mm (simulation)"
    )
    _map(map_axes, result)
    _bars(bar_axes, result)
    path = folder / f"figure-{FIGURE}.png"
    figure.savefig(path, dpi=90)
    plt.close(figure)
    return path


def _map(axes: Any, result: PathResult) -> None:
    for piece in result.way.pieces:
        axes.plot(*_points(piece), color="lightgrey", linewidth=7, solid_capstyle="round")
    for number, driven in enumerate(result.pieces):
        colour = COLOURS[number % len(COLOURS)]
        axes.plot(*_points(driven.piece), "--", color=colour)
        axes.annotate(str(number), driven.piece.point(driven.piece.length_m / 2), color=colour, fontsize="large")
        _body(axes, driven.piece.point(0.0), driven.yaw_rad, colour)
    track = np.array(result.track.pose)
    axes.plot(track[:, 0], track[:, 1], color="black", linewidth=1.2, label="driven by the centre (simulation)")
    end = result.pieces[-1].end
    _body(axes, (end.x_m, end.y_m), end.yaw_rad, "black")
    axes.plot([], [], color="lightgrey", linewidth=7, label="path")
    axes.plot([], [], "--", color="black", label="chosen pieces; an arrow is the body where it steers")
    axes.set(xlabel="x [m]", ylabel="y [m]", aspect="equal")
    axes.grid(visible=True, alpha=0.3)
    axes.legend(fontsize="small", loc="upper left")


def _points(piece: Piece) -> Any:
    return np.array([piece.point(along) for along in np.linspace(0.0, piece.length_m, 60)]).T


def _body(axes: Any, place: tuple[float, float], yaw_rad: float, colour: str) -> None:
    axes.plot(*place, "o", color=colour, markersize=5)
    ahead = (place[0] + 0.15 * math.cos(yaw_rad), place[1] + 0.15 * math.sin(yaw_rad))
    axes.annotate("", ahead, place, arrowprops={"arrowstyle": "->", "color": colour})


def _bars(axes: Any, result: PathResult) -> None:
    pieces, width = result.numbers["pieces"], 0.27
    for column, (key, words) in enumerate(BARS):
        heights = [1e3 * piece[key] for piece in pieces]
        axes.bar(np.arange(len(pieces)) + (column - 1) * width, heights, width, color=COLOURS[column], label=words)
    labels = [f"{number} {piece['kind']}" for number, piece in enumerate(pieces)]
    axes.set(title="largest distance from the path", ylabel="[mm]", xticks=range(len(pieces)), xticklabels=labels)
    axes.tick_params(axis="x", rotation=45)
    axes.grid(visible=True, axis="y", alpha=0.3)
    axes.legend(fontsize="small")
