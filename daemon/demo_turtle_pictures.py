"""Pictures of the Turtle's demo: acceleration, safety factor, case and velocity as in its report; ice from above."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np

from daemon.demo_turtle import TurtleResult
from profiles.schema import FloorPatch

mpl.use("Agg")
from matplotlib import pyplot as plt
from matplotlib.patches import Rectangle

COLOURS = ("#0072B2", "#E69F00", "#009E73", "#CC79A7")
"""Okabe and Ito's palette, which colour-blind people can tell apart."""
HEADING_EVERY = 15
"""Cycles between two headings that are drawn."""


def draw(result: TurtleResult, folder: Path) -> Path:
    """Draw one figure into ``folder``; returns the PNG's path."""
    figure, axes = plt.subplots(5, 1, figsize=(9, 13), sharex=True, layout="constrained")
    achieved = result.numbers["achieved"]
    published = result.figure.traction is None
    source = f"Figure {result.figure.identity} of the Turtle's report" if published else result.figure.identity
    figure.suptitle(
        f"{source}: {result.figure.words}, driven in simulation\n{achieved['duration_s']:.2f} s, "
        f"ends at ({achieved['end_x_m']:.3f}, {achieved['end_y_m']:.3f}) m"
    )
    _error(axes[0], result)
    _acceleration(axes[1], result)
    _factor(axes[2], result)
    if result.figure.ice is None:
        _case(axes[3], result)
    else:
        place = axes[3].get_subplotspec()
        axes[3].remove()
        _way(figure.add_subplot(place), result, result.figure.ice)
    _velocity(axes[4], result)
    axes[4].set_xlabel("time [s]")
    path = folder / f"figure-{result.figure.identity}.png"
    figure.savefig(path, dpi=90)
    plt.close(figure)
    return path


def _error(axes: Any, result: TurtleResult) -> None:
    track = result.track
    if result.figure.ice is None:
        axes.plot(track.time_s, track.error, color=COLOURS[0])
        axes.set(title="imposed error + 1", ylabel="factor")
    else:
        axes.step(track.time_s, track.sliding, where="post", color=COLOURS[3], label="wheels that slide (simulation)")
        axes.step(track.time_s, np.array(track.slip) * 1.0, where="post", color=COLOURS[0], label="slip detected")
        axes.set(title="slip", ylabel="wheels")
        axes.legend(fontsize="small")
    axes.grid(visible=True, alpha=0.3)


def _acceleration(axes: Any, result: TurtleResult) -> None:
    track = result.track
    commanded, measured = np.array(track.acceleration), np.array(track.measured)
    for column, name in enumerate("xy"):
        axes.plot(track.time_s, measured[:, column], color=COLOURS[column], alpha=0.35, label=f"{name}, measured")
        axes.plot(track.time_s, commanded[:, column], color=COLOURS[column], label=f"{name}, commanded")
    axes.set(title="acceleration", ylabel="[m/s²]")
    axes.grid(visible=True, alpha=0.3)
    axes.legend(fontsize="small", ncols=2)


def _factor(axes: Any, result: TurtleResult) -> None:
    axes.step(result.track.time_s, result.track.safety_factor, where="post", color=COLOURS[2])
    axes.set(title="safety factor", ylim=(0.0, 1.05))
    axes.grid(visible=True, alpha=0.3)


def _case(axes: Any, result: TurtleResult) -> None:
    names = list(dict.fromkeys(result.track.case))
    axes.step(result.track.time_s, [names.index(case) for case in result.track.case], where="post", color=COLOURS[3])
    axes.set(title="case (x/y where there are two)", yticks=range(len(names)), yticklabels=names)
    axes.grid(visible=True, alpha=0.3)


def _way(axes: Any, result: TurtleResult, ice: FloorPatch) -> None:
    """From above: the ice, the line to the goal, and where the robot truly went, with its heading."""
    corner = ice.x_m - ice.length_m / 2, ice.y_m - ice.width_m / 2
    axes.add_patch(Rectangle(corner, ice.length_m, ice.width_m, color=COLOURS[0], alpha=0.15, label="ice"))
    x, y, yaw = np.array(result.track.pose).T
    axes.plot(
        *zip((0.0, 0.0), result.figure.goal_m, strict=True), "--", color="black", linewidth=1, label="to the goal"
    )
    axes.plot(x, y, color=COLOURS[1], label="true way")
    some = slice(None, None, HEADING_EVERY)
    axes.quiver(x[some], y[some], np.cos(yaw[some]), np.sin(yaw[some]), color=COLOURS[1], scale=40, width=0.003)
    axes.set(title="from above", xlabel="x [m]", ylabel="y [m]", aspect="equal")
    axes.grid(visible=True, alpha=0.3)
    axes.legend(fontsize="small")


def _velocity(axes: Any, result: TurtleResult) -> None:
    velocity = np.array(result.track.velocity)
    for column, name in enumerate("xy"):
        axes.plot(result.track.time_s, velocity[:, column], color=COLOURS[column], label=f"{name}, true")
    axes.set(title="velocity of the robot's centre", ylabel="[m/s]")
    axes.grid(visible=True, alpha=0.3)
    axes.legend(fontsize="small")
