"""Pictures of the campaigns: those of the thesis' appendix B, its bounds beside ours, the 40 runs over their way."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np

from daemon.campaigns.cases import LAWS, STEERING_RATE_DEG_S, Case, Outcome
from daemon.campaigns.following_runs import Run, ideal_run
from daemon.campaigns.tables import bounds_table, grid_table, steering_name

mpl.use("Agg")
from matplotlib import pyplot as plt

COLOURS = ("#0072B2", "#E69F00", "#009E73", "#CC79A7", "#56B4E9")
"""Okabe and Ito's palette, which colour-blind people can tell apart."""
KINDS = {"position_m": "position [m]", "heading_deg": "heading [°]", "bending_deg": "bending angle [°]"}


def draw_bounds(finished: Mapping[Case, Outcome], folder: Path) -> list[Path]:
    """The largest errors beside those of the thesis; and, of ideal runs, all 40 over their way."""
    pictures = [_draw_bars(finished, folder / "bounds.png")]
    runs = {case: ideal_run(case) for case in finished if _is_drawn(case)}
    return [*pictures, _draw_runs(runs, folder / "bounds-runs.png")] if runs else pictures


def draw_tuning(finished: Mapping[Case, Outcome], folder: Path) -> list[Path]:
    """The tests for c_p and c_v over their way (figures B.1 to B.7), and the 40 states for all pairs."""
    return [
        _draw_bending_tests(finished, folder / "tuning-cp.png"),
        _draw_look_aheads(finished, folder / "tuning-cv.png"),
        _draw_grid(finished, folder / "tuning-grid.png"),
    ]


def _is_drawn(case: Case) -> bool:
    return case.part == "thesis" and case.through == "ideal" and case.rate_deg_s == STEERING_RATE_DEG_S


def _saved(figure: Any, path: Path) -> Path:
    figure.savefig(path, dpi=90)
    plt.close(figure)
    return path


def _draw_bars(finished: Mapping[Case, Outcome], path: Path) -> Path:
    table = bounds_table(finished)
    columns = [key for key in table[0] if key not in ("path", "test")]
    figure, panels = plt.subplots(3, 1, figsize=(14, 11), sharex=True, layout="constrained")
    figure.suptitle("Largest errors from the initial errors of the thesis (section 6.2, Table B.1), driven backwards")
    places, width = np.arange(len(table)), 0.8 / len(columns)
    for axes, (kind, label) in zip(panels, KINDS.items(), strict=True):
        for number, (column, colour) in enumerate(zip(columns, COLOURS, strict=False)):
            values = [row[column][kind] for row in table]
            axes.bar(places + (number - (len(columns) - 1) / 2) * width, values, width, color=colour, label=column)
        axes.set_ylabel(label)
        axes.grid(visible=True, axis="y", alpha=0.3)
    panels[0].legend(fontsize="small", ncols=len(columns))
    panels[2].set_xticks(places, [f"{row['path']}\n{row['test']}" for row in table], rotation=60, fontsize="small")
    return _saved(figure, path)


def _draw_runs(runs: Mapping[Case, Run], path: Path) -> Path:
    figure, panels = plt.subplots(3, 2, figsize=(13, 10), sharex=True, sharey="row", layout="constrained")
    figure.suptitle(f"40 runs backwards from the thesis' initial errors, steering {STEERING_RATE_DEG_S:g}°/s")
    for column, law in enumerate(LAWS):
        for case, run in runs.items():
            if case.law == law:
                colour = COLOURS[case.path == "circle"]
                for axes, values in zip(panels[:, column], _shown(run), strict=True):
                    axes.plot(run.way_m, values, color=colour, linewidth=0.8)
        panels[0][column].set_title(f"{law} (blue: line, orange: circle)")
        panels[2][column].set_xlabel("way [m]")
    for axes, label in zip(panels[:, 0], KINDS.values(), strict=True):
        axes.set_ylabel(f"error of {label}")
    for axes in panels.flat:
        axes.grid(visible=True, alpha=0.3)
    return _saved(figure, path)


def _shown(run: Run) -> tuple[list[float], Any, Any]:
    return run.position_m, np.degrees(run.heading_rad), np.degrees(run.bending_rad)


def _draw_bending_tests(finished: Mapping[Case, Outcome], path: Path) -> Path:
    figure, panels = plt.subplots(2, 2, figsize=(13, 9), sharex=True, layout="constrained")
    figure.suptitle("Determination of c_p (figures B.1 to B.4): the bending angle to its target, backwards")
    for row, target in enumerate((50.0, 0.0)):
        for column, rate in enumerate((None, STEERING_RATE_DEG_S)):
            axes = panels[row][column]
            chosen = _redriven(finished, "c_p", rate, target)
            for case, run in chosen.items():
                bending = np.degrees(run.bending_rad) + target
                axes.plot(run.way_m, bending, **_line(case.bending_gain == 4.0), label=f"c_p = {case.bending_gain:g}")
            axes.axhline(target, color="black", linewidth=0.6)
            title = f"steering {steering_name(rate)}"
            axes.set(title=title, ylabel="bending angle [°]", xlim=(0, 1.0))
            axes.grid(visible=True, alpha=0.3)
            axes.legend(fontsize="x-small", ncols=2)
        panels[1][row].set_xlabel("way [m]")
    return _saved(figure, path)


def _draw_look_aheads(finished: Mapping[Case, Outcome], path: Path) -> Path:
    figure, panels = plt.subplots(3, 2, figsize=(13, 10), sharex=True, sharey="row", layout="constrained")
    figure.suptitle("Determination of c_v (figures B.5 to B.7): from half a metre beside the line, backwards")
    for column, rate in enumerate((None, STEERING_RATE_DEG_S)):
        chosen = _redriven(finished, "c_v", rate)
        for case, run in chosen.items():
            style, label = _line(case.look_ahead_m == 0.425), f"c_v = {case.look_ahead_m:g} m"
            shown = (run.position_m, np.degrees(run.bending_rad), np.degrees(run.steering_rad))
            for axes, values in zip(panels[:, column], shown, strict=True):
                axes.plot(run.way_m, values, **style, label=label)
        panels[0][column].set_title(f"steering {steering_name(rate)}")
        panels[0][column].legend(fontsize="x-small", ncols=2)
        panels[2][column].set_xlabel("way [m]")
    for axes, label in zip(panels[:, 0], ("position [m]", "bending angle [°]", "steering [°]"), strict=True):
        axes.set_ylabel(label)
    for axes in panels.flat:
        axes.grid(visible=True, alpha=0.3)
    return _saved(figure, path)


def _redriven(
    finished: Mapping[Case, Outcome], part: str, rate_deg_s: float | None, target_deg: float = 0.0
) -> dict[Case, Run]:
    """The runs of a part, over their way: the results file has their figures only."""
    wanted = (part, rate_deg_s, target_deg)
    return {case: ideal_run(case) for case in finished if (case.part, case.rate_deg_s, case.target_deg) == wanted}


def _line(is_published: bool) -> dict[str, Any]:
    """The thesis' choice stands out."""
    return {"color": "black", "linewidth": 2.0} if is_published else {"linewidth": 1.0}


def _draw_grid(finished: Mapping[Case, Outcome], path: Path) -> Path:
    figure, panels = plt.subplots(1, 2, figsize=(13, 5.5), sharey=True, layout="constrained")
    figure.suptitle("The 40 states with each c_p and c_v: mean way until settled [m], or how many never settle (red)")
    for axes, rate in zip(panels, (None, STEERING_RATE_DEG_S), strict=True):
        rows = [row for row in grid_table(finished) if row["steering"] == steering_name(rate)]
        gains = sorted({row["c_p"] for row in rows})
        aheads = sorted({row["c_v_m"] for row in rows})
        means = np.full((len(gains), len(aheads)), math.nan)
        for row in rows:
            place = (gains.index(row["c_p"]), aheads.index(row["c_v_m"]))
            if not row["failed"]:
                means[place] = row["mean_settle_m"]
            text, colour = (f"{row['failed']}", "red") if row["failed"] else (f"{means[place]:.2f}", "white")
            axes.text(place[1], place[0], text, ha="center", va="center", color=colour, fontsize="small")
        axes.imshow(means, aspect="auto", cmap="viridis", origin="lower")
        axes.set(title=f"steering {steering_name(rate)}", xlabel="c_v [m]", xticks=range(len(aheads)))
        axes.set(yticks=range(len(gains)), yticklabels=[f"{gain:g}" for gain in gains])
        axes.set_xticklabels([f"{ahead:g}" for ahead in aheads])
    panels[0].set_ylabel("c_p")
    return _saved(figure, path)
