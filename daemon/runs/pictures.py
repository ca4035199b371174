"""The picture of a run: track, headings, speeds, how the wheels keep to them, currents, and limits."""

from __future__ import annotations

import itertools
import math
import textwrap
from collections.abc import Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import matplotlib as mpl
import msgspec

from daemon.runs.signs import currents_at_limit, read_signs
from daemon.runs.store import PROFILE, TERMS, Run, read_yaml
from daemon.runs.table import Table, read_table

mpl.use("Agg")
from matplotlib import pyplot as plt

COLOURS = ("#0072B2", "#E69F00", "#009E73", "#CC79A7", "#56B4E9", "#D55E00")
"""Okabe and Ito's palette, which colour-blind people can tell apart."""
STYLES = ("-", "--")
COLUMNS = 2
SLIP = "slip along {}"
ERRORS = {
    "distance [m]": (("path.error_m", "path.error_limit_m"),),
    "angle [°]": (
        ("path.heading_error_deg", "path.heading_error_limit_deg"),
        ("path.bending_error_deg", "path.bending_error_limit_deg"),
    ),
}
"""Errors and their limits, by what they are drawn in."""


class _Terms(msgspec.Struct):
    """As much of a law's terms as is drawn."""

    slip: Any = None
    guidance: _Terms | None = None


class _Step(msgspec.Struct):
    """One line of them."""

    time_s: float
    terms: _Terms


def draw(run: Run, path: Path) -> list[str]:
    """Draw a run.

    Args:
        run: which one.
        path: of the picture; its ending chooses the format.

    Returns:
        What stands out, as it is written into the picture.

    Raises:
        ConfigError: the run has no rows.
        OSError: the picture cannot be written.
        ValueError: the ending means no format.
    """
    table, profile = read_table(run), read_yaml(run.folder / PROFILE)
    signs = read_signs(table, profile)
    shown = list(panels(run, table, profile))
    rows = math.ceil(len(shown) / COLUMNS)
    figure, grid = plt.subplots(rows, COLUMNS, figsize=(14, 4 * rows), layout="constrained", squeeze=False)
    figure.suptitle(_title(run, signs))
    for axes, panel in itertools.zip_longest(grid.flat, shown, fillvalue=_nothing):
        panel(axes)
    try:
        figure.savefig(path, dpi=90)
    finally:
        plt.close(figure)
    return signs


def panels(run: Run, table: Table, profile: Mapping[str, Any]) -> Iterator[partial[None]]:
    """What the robot has, in the order of the picture; a quantity that nothing has told is left out."""
    yield partial(_track, table=table)
    headings, currents = _told(table.of("heading_deg")), _told(table.of("current_a"))
    measured = any(map(any, currents.values()))
    if headings:
        yield partial(
            _lines, table=table, columns=headings, title="steering headings, by their encoders", label="heading [°]"
        )
    if _told(table.of("speed_m_s")):
        yield partial(_speeds, table=table)
        deviations, title = _deviations(table), "measured minus commanded speed"
        yield partial(_lines, table=table, columns=deviations, title=title, label="rim speed [m/s]")
    yield from _errors(table)
    if measured:
        title = "motor currents (positive: pushes forward)"
        yield partial(_lines, table=table, columns=currents, title=title, label="current [A]")
    yield partial(_active, table=table, times={**table.limits(), **currents_at_limit(table, profile), **_slips(run)})


def _errors(table: Table) -> Iterator[partial[None]]:
    """Of a motion along a path: distance from it, and angles; each line says at which value the motion ends."""
    for label, pairs in ERRORS.items():
        columns = {
            _limited(error.removeprefix("path."), table.numbers.get(limit, [])): table.numbers[error]
            for error, limit in pairs
            if error in table.numbers
        }
        if told := _told(columns):
            yield partial(_lines, table=table, columns=told, title="errors beside the path", label=label)


def _limited(name: str, limits: list[float]) -> str:
    known = [limit for limit in limits if not math.isnan(limit)]
    return f"{name} (the motion ends at {min(known):.3g})" if known else name


def _told(columns: Mapping[str, list[float]]) -> dict[str, list[float]]:
    return {name: column for name, column in columns.items() if not all(map(math.isnan, column))}


def _nothing(axes: Any) -> None:
    axes.axis("off")


def _title(run: Run, signs: list[str]) -> str:
    facts = run.facts
    ended = f"{run.ending}: {facts['message']}" if facts.get("message") else run.ending
    lines = [
        f"run {run.number} of {run.robot}: {facts.get('motion') or facts.get('kind')}, {run.when}, {ended}",
        *signs,
    ]
    return "\n".join(part for line in lines for part in textwrap.wrap(line, 130))


def _track(axes: Any, table: Table) -> None:
    x, y = table.numbers["x_m"], table.numbers["y_m"]
    axes.plot(x, y, color="black")
    axes.plot(x[:1], y[:1], "o", color="black", label="begin")
    axes.plot(x[-1:], y[-1:], "x", color="red", markersize=10, label="end")
    axes.set(title="track, by odometry", xlabel="x [m]", ylabel="y [m]")
    axes.axis("equal")
    _finish(axes)


def _speeds(axes: Any, table: Table) -> None:
    _lines(axes, table, table.of("speed_m_s"), "wheel speeds (dotted: commanded)", "rim speed [m/s]")
    for number, column in enumerate(table.of("commanded_m_s").values()):
        axes.plot(table.time_s, column, ":", color=_colour(number), linewidth=1)


def _deviations(table: Table) -> dict[str, list[float]]:
    commanded = table.of("commanded_m_s")
    return {
        name: [is_ - asked for is_, asked in zip(column, commanded[name], strict=True)]
        for name, column in table.of("speed_m_s").items()
    }


def _lines(axes: Any, table: Table, columns: Mapping[str, list[float]], title: str, label: str) -> None:
    """Every other line is dashed: where two lie upon each other, both are seen."""
    for number, (name, column) in enumerate(columns.items()):
        axes.plot(table.time_s, column, STYLES[number % len(STYLES)], color=_colour(number), label=name)
    axes.set(title=title, xlabel="time [s]", ylabel=label)
    _finish(axes)


def _active(axes: Any, table: Table, times: Mapping[str, list[float]]) -> None:
    for row, when in enumerate(times.values()):
        axes.plot(when, [row] * len(when), "|", color=_colour(row), markersize=14)
    axes.set_yticks(range(len(times)), list(times))
    axes.set_xlim(table.time_s[0], table.time_s[-1] or 1.0)
    axes.set_ylim(-0.5, max(len(times), 1) - 0.5)
    axes.set(title="active limits and slip" if times else "no limit was active, no slip detected", xlabel="time [s]")
    axes.grid(visible=True, alpha=0.3)


def _slips(run: Run) -> dict[str, list[float]]:
    """When the law detected slip, along each axis of the robot [s]; laws that detect none have no such term."""
    times: dict[str, list[float]] = {}
    for step in _steps(run):
        told = (step.terms.guidance or step.terms).slip
        for axis, slips in zip("xy", told if isinstance(told, list) else (), strict=False):
            if slips:
                times.setdefault(SLIP.format(axis), []).append(step.time_s)
    return times


def _steps(run: Run) -> Iterator[_Step]:
    try:
        lines = (run.folder / TERMS).read_bytes().splitlines()
    except OSError:
        return
    for line in lines:
        try:
            yield msgspec.json.decode(line, type=_Step)
        except (msgspec.DecodeError, RecursionError):
            continue  # the last line of a daemon that was killed


def _finish(axes: Any) -> None:
    axes.grid(visible=True, alpha=0.3)
    if axes.get_legend_handles_labels()[0]:
        axes.legend(fontsize="small")


def _colour(number: int) -> str:
    return COLOURS[number % len(COLOURS)]
