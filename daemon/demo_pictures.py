"""Pictures of a demo: where the robot went, where its wheels pointed, how fast they turned, how they slipped."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np

from daemon.demo import FigureResult
from daemon.loops.geometry import contact_points
from profiles.schema import PairedSteerGeometry

mpl.use("Agg")
from matplotlib import pyplot as plt

WHEELS = ("1 rear right", "2 rear left", "3 front left", "4 front right")
COLOURS = ("#0072B2", "#E69F00", "#009E73", "#CC79A7")
"""Okabe and Ito's palette, which colour-blind people can tell apart."""
OUTLINES = 5
WHEEL_LENGTH_M = 0.2


def draw(result: FigureResult, geometry: PairedSteerGeometry, folder: Path) -> Path:
    """Draw one figure into ``folder``; returns the PNG's path."""
    figure, axes = plt.subplots(2, 2, figsize=(13, 9), layout="constrained")
    identity, achieved = result.figure.identity, result.numbers["achieved"]
    figure.suptitle(
        f"Figure {identity} of the MAX2D thesis: {result.figure.move}, {result.figure.speed_m_s:g} m/s, "
        f"driven in simulation; steering error {achieved['steering_error_deg']:.2f}°"
    )
    _trajectory(axes[0][0], result, geometry)
    _headings(axes[0][1], result)
    _speeds(axes[1][0], result)
    _slip(axes[1][1], result)
    path = folder / f"figure-{identity}.png"
    figure.savefig(path, dpi=90)
    plt.close(figure)
    return path


def _trajectory(axes: Any, result: FigureResult, geometry: PairedSteerGeometry) -> None:
    poses = np.array(result.track.pose)
    axes.plot(poses[:, 0], poses[:, 1], color="black", label="driven by the centre")
    way = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(poses[:, :2], axis=0).T))])
    for share in np.linspace(0.0, 1.0, OUTLINES):
        row = min(int(np.searchsorted(way, share * way[-1])), len(poses) - 1)
        _outline(axes, poses[row], result.track.heading_rad[row], geometry)
    _reference(axes, result)
    axes.set(title="trajectory", xlabel="x [m]", ylabel="y [m]", aspect="equal")
    axes.grid(visible=True, alpha=0.3)
    axes.legend(loc="center left", bbox_to_anchor=(1.02, 0.5), fontsize="small")


def _outline(axes: Any, pose: Any, heading_rad: tuple[float, ...], geometry: PairedSteerGeometry) -> None:
    x, y, yaw = pose
    turn = np.array([[math.cos(yaw), -math.sin(yaw)], [math.sin(yaw), math.cos(yaw)]])
    length, width = geometry.wheelbase_m / 2, geometry.pivot_track_m / 2
    corners = np.array([[-length, -width], [-length, width], [length, width], [length, -width], [-length, -width]])
    body = corners @ turn.T + (x, y)
    axes.plot(body[:, 0], body[:, 1], color="grey", linewidth=0.8)
    rear, front = heading_rad
    for wheel, centre in enumerate(contact_points(geometry, rear, front)):
        angle = (rear, rear, front, front)[wheel]
        along = np.array([math.cos(angle), math.sin(angle)]) * WHEEL_LENGTH_M / 2
        ends = np.array([np.array(centre) - along, np.array(centre) + along]) @ turn.T + (x, y)
        axes.plot(ends[:, 0], ends[:, 1], color=COLOURS[wheel], linewidth=2.5)


def _reference(axes: Any, result: FigureResult) -> None:
    if result.icr_m is None:
        commanded = result.numbers["commanded"]
        axes.plot([0, commanded["end_x_m"]], [0, commanded["end_y_m"]], "--", color="red", label="commanded")
        return
    start = _start_of_drive(result)
    yaw = start[2]
    icr_x = start[0] + math.cos(yaw) * result.icr_m[0] - math.sin(yaw) * result.icr_m[1]
    icr_y = start[1] + math.sin(yaw) * result.icr_m[0] + math.cos(yaw) * result.icr_m[1]
    circle = np.linspace(0, 2 * math.pi, 200)
    for radius, name, style in (
        (math.hypot(*result.icr_m), "commanded", "--"),
        (result.numbers["published"]["radius_m"], "published", ":"),
    ):
        label = f"{name}, R = {radius:.3f} m"
        axes.plot(icr_x + radius * np.cos(circle), icr_y + radius * np.sin(circle), style, color="red", label=label)
    driven = result.numbers["achieved"]["radius_m"]
    axes.plot([icr_x], [icr_y], "+", color="red", markersize=12, label=f"ICR, driven R = {driven:.3f} m")


def _start_of_drive(result: FigureResult) -> tuple[float, float, float]:
    """Pose at which all wheels begin to roll: the steering before it moves the body a little."""
    rolling = (index for index, row in enumerate(result.track.commanded_m_s) if all(abs(speed) > 0 for speed in row))
    return result.track.pose[next(rolling, 0)]


def _headings(axes: Any, result: FigureResult) -> None:
    time = result.track.time_s
    headings = np.degrees(np.array(result.track.heading_rad))
    for column, (name, colour) in enumerate((("rear", COLOURS[0]), ("front", COLOURS[2]))):
        axes.plot(time, headings[:, column], color=colour, label=f"{name}, by its encoder")
        target = (result.figure.rear_deg, result.figure.front_deg)[column]
        axes.axhline(target, color=colour, linestyle="--", linewidth=0.8)
    axes.set(title="steering headings (dashed: commanded)", xlabel="time [s]", ylabel="heading [°]")
    axes.grid(visible=True, alpha=0.3)
    axes.legend(fontsize="small")


def _speeds(axes: Any, result: FigureResult) -> None:
    time = result.track.time_s
    commanded, measured = np.array(result.track.commanded_m_s), np.array(result.track.measured_m_s)
    for wheel, name in enumerate(WHEELS):
        axes.plot(time, measured[:, wheel], color=COLOURS[wheel], label=name)
        axes.plot(time, commanded[:, wheel], color=COLOURS[wheel], linestyle="--", linewidth=0.8)
    axes.set(title="wheel speeds (dashed: commanded)", xlabel="time [s]", ylabel="rim speed [m/s]")
    axes.grid(visible=True, alpha=0.3)
    axes.legend(fontsize="small")


def _slip(axes: Any, result: FigureResult) -> None:
    angles = np.degrees(np.array(result.track.slip_angle_rad))
    for wheel, name in enumerate(WHEELS):
        axes.plot(result.track.time_s, angles[:, wheel], color=COLOURS[wheel], label=name)
    axes.set(title="slip angles of the tyres (simulation)", xlabel="time [s]", ylabel="slip angle [°]")
    axes.grid(visible=True, alpha=0.3)
    axes.legend(fontsize="small")
