"""``canhelm runs``: what motions and faults have left; list, show, delete."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import App, Parameter

from canhelm.errors import UsageError
from daemon.cli.output import Json, say, show, wants_json
from daemon.cli.replay import frames_of
from daemon.runs import store
from daemon.runs.signs import read_signs
from daemon.runs.store import FAULT, LAST, OFF, PROFILE, Run
from daemon.runs.table import read_table

if TYPE_CHECKING:
    from rich.table import Table

runs = App(name="runs", help="Runs: each motion of a daemon leaves one. Without a further word: list them.")

Folder = Annotated[str | None, Parameter(name="--runs", help="Folder of runs, as given to `canhelm run --runs`.")]
Robot = Annotated[str | None, Parameter(help="Runs of this robot alone.")]
"""Types of the options that choose among runs."""
LOG = ".log"
"""The ending of what is a log of a bus and no run."""


@runs.default
def list_(*, folder: Folder = None, robot: Robot = None, json: Json = None) -> None:
    """The runs that are kept, oldest first: when, of which robot, which motion, how long, how it ended, and its size.

    Example: `canhelm runs`
    """
    found = find_runs(folder, robot)
    if not found:
        looked = ", ".join(map(str, store.searched(_folder(folder), os.environ)))
        whose = f" of {robot}" if robot else ""
        say(f"no runs{whose} in {looked}: each motion of `canhelm run` leaves one; --runs DIR looks elsewhere")
    show([summary(run) for run in found], lambda _: _table(found), json)


@runs.command(name="show")
def show_(name: str = LAST, /, *, folder: Folder = None, robot: Robot = None, json: Json = None) -> None:
    """One run: what was asked, how it ended, what stands out in its numbers, and where its files are.

    Example: `canhelm runs show last`

    Args:
        name: Number of a run, or last.
    """
    run = store.choose(find_runs(folder, robot), name)
    signs = read_signs(read_table(run), store.read_yaml(run.folder / PROFILE)) if run.facts.get("rows") else []
    files = sorted(path.name for path in run.folder.iterdir())
    ending = {"ended": run.facts.get("ended") if wants_json(json) else run.ending}
    shown = {"run": run.number, **run.facts, **ending, "size_bytes": run.size_bytes}
    show({**shown, "stands_out": signs, "folder": str(run.folder), "files": files}, json=json)


@runs.command
def delete(*names: str, folder: Folder = None, robot: Robot = None) -> None:
    """Delete runs for good.

    Example: `canhelm runs delete 3 4`

    Args:
        names: Numbers of runs, last, or all. last is the newest of all robots, or of that of --robot.
    """
    found = find_runs(folder, robot)
    if not names:
        raise UsageError("which runs?", remedy="give numbers of `canhelm runs`, last, or all")
    chosen = found if names == ("all",) else [store.choose(found, name) for name in names]
    for run in chosen:
        store.delete(run)
        say(f"run {run.number} of {run.robot} is deleted")


@runs.command
def export(
    name: str = LAST,
    /,
    *,
    mcap: Annotated[Path, Parameter(help="The file to write, which must not be there yet.")],
    folder: Folder = None,
    robot: Robot = None,
    json: Json = None,
) -> None:
    """Write a run as one MCAP file, which Foxglove, PlotJuggler and Rerun open; or the log of a bus.

    Example: `canhelm runs export last --mcap run.mcap`

    Args:
        name: Number of a run, or last; or a candump log, as `canhelm run --record` writes it.
    """
    from daemon.runs.mcap_file import write_log, write_mcap

    if name.endswith(LOG):
        show({"log": name, "file": str(mcap), "messages": write_log(frames_of(Path(name)), mcap)}, json=json)
        return
    run = store.choose(find_runs(folder, robot), name)
    show({"run": run.number, "file": str(mcap), "messages": write_mcap(run, mcap)}, json=json)


def find_runs(folder: str | None, robot: str | None) -> list[Run]:
    """The runs among which a person chooses, oldest first. Raises UsageError or ConfigError."""
    return store.read_runs(store.all_folders(_folder(folder), os.environ), robot)


def _folder(given: str | None) -> Path | None:
    return None if given in (None, OFF) else Path(given or "")


def summary(run: Run) -> dict[str, Any]:
    """One line of the list."""
    facts = run.facts
    return {
        "run": run.number,
        "begun": run.begun,
        "when": run.when,
        "robot": run.robot,
        "vehicle": facts.get("vehicle"),
        "kind": facts.get("kind", "motion"),
        "motion": facts.get("motion"),
        "duration_s": facts.get("duration_s"),
        "ended": facts.get("ended"),
        "message": facts.get("message", ""),
        "size_bytes": run.size_bytes,
    }


def _table(found: Sequence[Run]) -> Table:
    from rich.table import Table
    from rich.text import Text

    grid = Table("run", "when (UTC)", "robot", "vehicle", "motion", "s", "ended", "MB", box=None, header_style="bold")
    for run in found:
        row = summary(run)
        told = f"{run.ending}: {row['message']}" if row["message"] else run.ending
        duration = "-" if row["duration_s"] is None else f"{row['duration_s']:.1f}"
        when = run.when[:19].replace("T", " ")
        motion = f"fault in {row['motion'] or 'no motion'}" if row["kind"] == FAULT else str(row["motion"] or "-")
        cells = [str(run.number), when, run.robot, str(row["vehicle"] or "-"), motion]
        grid.add_row(*map(Text, [*cells, duration, told, f"{row['size_bytes'] / 1e6:.1f}"]))
    return grid
