"""Pictures of the NXT robot's demo: its moves from above, and the report's call at both steps."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np

from daemon.demo_nxt import CALL_GOAL, CallResult, NxtResult
from daemon.loops.differential import wrap_angle

mpl.use("Agg")
from matplotlib import pyplot as plt

OPEN_LOOP, FEEDBACK = "#E69F00", "#0072B2"
"""Of Okabe and Ito's palette, which colour-blind people can tell apart."""
ARROW_CM = 3.0
ASIDE_CM = 2.0
"""How far aside of a line is shown, at a scale of its own."""
SHOWN_CM = 1500.0
"""How far from the start a track is followed."""


def draw_moves(results: Sequence[NxtResult], folder: Path) -> Path:
    """Draw each move from above into ``folder``; returns the PNG's path."""
    heights = [1.8 if _is_straight(result) else 3.6 for result in results]
    ratios = {"height_ratios": heights}
    figure, axes = plt.subplots(
        len(results), 1, figsize=(9, sum(heights)), layout="constrained", squeeze=False, gridspec_kw=ratios
    )
    figure.suptitle("The NXT report's moves, driven in simulation: open loop by tacho limits, and by feedback")
    for place, result in zip(axes[:, 0], results, strict=True):
        _move(place, result)
    return _save(figure, folder / "figure-nxt-moves.png")


def _move(axes: Any, result: NxtResult) -> None:
    for run, colour, name in ((result.open_loop, OPEN_LOOP, "open loop"), (result.feedback, FEEDBACK, "feedback")):
        track, miss = 100 * np.array(run.track), run.miss
        label = f"{name}: {miss['error_cm']:.1f} cm, {abs(miss['heading_error_deg']):.1f}° off"
        axes.plot(track[:, 0], track[:, 1], color=colour, label=label)
        _arrow(axes, track[-1, 0], track[-1, 1], run.track[-1][2], colour)
    end = result.figure.end
    axes.plot([100 * end.x_m], [100 * end.y_m], "x", color="black", markersize=9, label="wanted")
    _arrow(axes, 100 * end.x_m, 100 * end.y_m, end.yaw_rad, "black")
    axes.set(title=result.figure.words, xlabel="x [cm]", ylabel="y [cm]")
    axes.grid(visible=True, alpha=0.3)
    axes.margins(0.1)
    if _is_straight(result):
        axes.set_ylim(-ASIDE_CM, ASIDE_CM)
    else:
        axes.set_aspect("equal")
    axes.legend(fontsize="small", loc="center left", bbox_to_anchor=(1.02, 0.5))


def _is_straight(result: NxtResult) -> bool:
    return result.figure.end.y_m == 0.0


def _arrow(axes: Any, x: float, y: float, yaw: float, colour: str) -> None:
    tip = (x + ARROW_CM * math.cos(yaw), y + ARROW_CM * math.sin(yaw))
    axes.annotate("", xy=tip, xytext=(x, y), arrowprops={"arrowstyle": "->", "color": colour})


def draw_calls(results: Sequence[CallResult], folder: Path) -> list[Path]:
    """Draw the report's call, one picture a step, into ``folder``; returns the PNGs' paths."""
    return [_call(result, folder) for result in results]


def _call(result: CallResult, folder: Path) -> Path:
    figure, (above, over_time) = plt.subplots(1, 2, figsize=(12, 5), layout="constrained")
    numbers, run = result.numbers, result.run
    verdict = f"reached after {numbers['duration_s']:g} s" if run.reached else "never reached"
    figure.suptitle(f"The NXT report's call (10, 10, π/2) with ideal motors, dt {result.dt_s:g} s: {verdict}")
    rows = np.array([(pose.x_m, pose.y_m, wrap_angle(pose.yaw_rad)) for pose in run.track])
    near = rows[: int(np.argmax([*(np.hypot(rows[:, 0], rows[:, 1]) > SHOWN_CM), True]))]
    above.plot(near[:, 0], near[:, 1], ".-", markersize=3, linewidth=0.8, color=FEEDBACK)
    above.plot([CALL_GOAL.x_m], [CALL_GOAL.y_m], "x", color="black", markersize=9)
    _arrow(above, CALL_GOAL.x_m, CALL_GOAL.y_m, CALL_GOAL.yaw_rad, "black")
    title = "from above" if len(near) == len(rows) else f"from above, the first {len(near)} steps"
    above.set(title=title, xlabel="x [cm]", ylabel="y [cm]", aspect="equal")
    time = np.arange(len(rows)) * result.dt_s
    for column, name, colour in ((0, "x [cm]", FEEDBACK), (1, "y [cm]", OPEN_LOOP), (2, "heading [rad]", "#009E73")):
        over_time.plot(time, rows[:, column], color=colour, label=name)
    over_time.set(title="over time", xlabel="time [s]")
    if not run.reached:
        over_time.set_yscale("symlog", linthresh=10.0)
    over_time.legend(fontsize="small")
    for axes in (above, over_time):
        axes.grid(visible=True, alpha=0.3)
    return _save(figure, folder / f"figure-nxt-call-{result.dt_s:g}s.png")


def _save(figure: Any, path: Path) -> Path:
    figure.savefig(path, dpi=90)
    plt.close(figure)
    return path
