"""The picture of a calibration: the true angle over the sensor's, the correction, and what is left."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import matplotlib as mpl
import numpy as np

from daemon.calibration.fit import Fit
from daemon.calibration.readings import Reading

mpl.use("Agg")
from matplotlib import pyplot as plt

DIRECTIONS = {1: ("#0072B2", "to the left"), -1: ("#E69F00", "to the right"), 0: ("#999999", "at the turning points")}


def draw(name: str, readings: Sequence[Reading], found: Fit, path: Path) -> None:
    """Draw one calibration into a PNG."""
    calibration = found.calibration
    curve = np.linspace(calibration.from_deg, calibration.to_deg, 300)
    true = np.array([calibration.correct(float(angle)) for angle in curve])
    figure, panels = plt.subplots(3, 1, figsize=(9, 11), sharex=True, layout="constrained")
    figure.suptitle(
        f"Calibration of {name}: offset {found.offset_deg:.2f}°, gain {found.gain:.4f}, non-linearity "
        f"{found.nonlinearity_deg:.2f}°,\nhysteresis {calibration.hysteresis_deg:.2f}°, residuals "
        f"{calibration.residual_deg:.3f}° (root mean square), {len(found.left_out)} readings left out"
    )
    panels[0].plot(curve, true, color="black", linewidth=1)
    panels[1].plot(curve, true - curve, color="black", linewidth=1)
    for direction, (colour, label) in DIRECTIONS.items():
        chosen = [number for number, reading in enumerate(readings) if reading.direction == direction]
        sensed = np.array([readings[number].sensed_deg for number in chosen])
        angles = np.array([readings[number].true_deg for number in chosen])
        panels[0].plot(sensed, angles, ".", color=colour, label=label)
        panels[1].plot(sensed, angles - sensed, ".", color=colour)
        panels[2].plot(sensed, [found.residual_deg[number] for number in chosen], ".", color=colour)
    for number in found.left_out:
        panels[2].plot(readings[number].sensed_deg, found.residual_deg[number], "x", color="red", markersize=9)
    panels[0].set(ylabel="true angle [°]")
    panels[0].legend(fontsize="small")
    panels[1].set(ylabel="correction [°]")
    panels[2].set(ylabel="residual [°] (red: left out)", xlabel="the sensor's angle [°]")
    for axes in panels:
        axes.grid(visible=True, alpha=0.3)
    figure.savefig(path, dpi=90)
    plt.close(figure)
