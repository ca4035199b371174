"""Pictures of the semi-trailer's demo: its way on the floor with outlines, errors, angles, speed and active limits."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np

from daemon.demo_semitrailer import SemitrailerResult
from daemon.loops.path import Path as Way

mpl.use("Agg")
from matplotlib import pyplot as plt

COLOURS = ("#0072B2", "#E69F00", "#009E73", "#CC79A7", "#D55E00", "#56B4E9")
"""Okabe and Ito's palette, which colour-blind people can tell apart."""
OUTLINES = 6
POINT_M = 0.02
WIDTH_M = 0.18
OVERHANG_M = 0.06

Pose = tuple[float, float, float]


def draw(result: SemitrailerResult, folder: Path) -> Path:
    """Draw one figure into ``folder``; returns the PNG's path."""
    figure, axes = plt.subplots(2, 2, figsize=(13, 9), layout="constrained")
    numbers = result.numbers["achieved"]
    figure.suptitle(
        f"{result.manoeuvre.identity}: {result.manoeuvre.words}, driven in simulation\n"
        f"ends {1e3 * numbers['end_error_m']:.1f} mm and {numbers['end_heading_error_deg']:.1f}° off the path's end"
    )
    _floor(axes[0][0], result)
    _errors(axes[0][1], result)
    _angles(axes[1][0], result)
    _speed(axes[1][1], result)
    path = folder / f"{result.manoeuvre.identity}.png"
    figure.savefig(path, dpi=90)
    plt.close(figure)
    return path


def _floor(axes: Any, result: SemitrailerResult) -> None:
    axes.plot(*np.array(_points(result.path)).T, color="black", linewidth=4, alpha=0.2, label="path")
    trace = result.trace
    for poses, colour, name in ((trace.truck, COLOURS[0], "truck"), (trace.trailer, COLOURS[1], "trailer")):
        track = np.array(poses)
        axes.plot(track[:, 0], track[:, 1], color=colour, linewidth=1, label=f"axle of the {name}")
    truck_m, trailer_m = result.geometry.wheelbase_m, result.geometry.trailer.length_m
    for row in np.linspace(0, len(trace.truck) - 1, OUTLINES).astype(int):
        axes.plot(*_outline(trace.truck[row], -OVERHANG_M, truck_m + OVERHANG_M), color=COLOURS[0], alpha=0.6)
        axes.plot(*_outline(trace.trailer[row], -2 * OVERHANG_M, trailer_m), color=COLOURS[1], alpha=0.6)
    axes.set(title="on the floor", xlabel="x [m]", ylabel="y [m]", aspect="equal")
    axes.grid(visible=True, alpha=0.3)
    axes.legend(fontsize="small")


def _points(path: Way) -> list[tuple[float, float]]:
    return [
        piece.point(piece.length_m * step / steps)
        for piece in path.pieces
        for steps in (max(1, math.ceil(piece.length_m / POINT_M)),)
        for step in range(steps + 1)
    ]


def _outline(pose: Pose, back_m: float, front_m: float) -> tuple[list[float], list[float]]:
    """A rectangle about the line from behind an axle to before it."""
    x, y, yaw = pose
    cos, sin, half = math.cos(yaw), math.sin(yaw), WIDTH_M / 2
    corners = [(back_m, half), (front_m, half), (front_m, -half), (back_m, -half), (back_m, half)]
    return [x + u * cos - v * sin for u, v in corners], [y + u * sin + v * cos for u, v in corners]


def _errors(axes: Any, result: SemitrailerResult) -> None:
    trace = result.trace
    axes.plot(trace.way_m, np.array(trace.error_m) * 1e3, color=COLOURS[0])
    axes.set(title="beside the path (truth)", xlabel="way [m]", ylabel="position [mm]")
    axes.grid(visible=True, alpha=0.3)
    twin = axes.twinx()
    twin.plot(trace.way_m, np.degrees(trace.heading_error_rad), color=COLOURS[1], linewidth=1)
    twin.set_ylabel("heading [°]", color=COLOURS[1])


def _angles(axes: Any, result: SemitrailerResult) -> None:
    trace = result.trace
    axes.plot(trace.way_m, np.degrees(trace.steering_rad), color=COLOURS[2], linewidth=1, label="steering")
    axes.plot(trace.way_m, np.degrees(trace.bending_rad), color=COLOURS[3], label="bending")
    axes.set(title="angles", xlabel="way [m]", ylabel="[°]")
    axes.grid(visible=True, alpha=0.3)
    axes.legend(fontsize="small")


def _speed(axes: Any, result: SemitrailerResult) -> None:
    trace = result.trace
    axes.plot(trace.time_s, trace.speed_m_s, color="black", linewidth=1, label="commanded")
    names = sorted({name for limits in trace.limits for name in limits})
    times = np.array(trace.time_s)
    for row, name in enumerate(names):
        active = np.array([name in limits for limits in trace.limits])
        level = np.where(active, -0.3 - 0.03 * row, np.nan)
        axes.plot(times, level, linewidth=4, color=COLOURS[row % len(COLOURS)], label=name)
    axes.set(title="speed, and the limits that were active", xlabel="time [s]", ylabel="[m/s]")
    axes.grid(visible=True, alpha=0.3)
    axes.legend(fontsize="small")
