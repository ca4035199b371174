"""``canhelm replay``: a candump log as the daemon reads it, and a fault's cycles through the loops again."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from canhelm.errors import UsageError
from daemon.cli.output import Json, say, show, wants_json
from daemon.runs.store import PROFILE, RECORDS
from drivers.bus.candump import LogFrame, parse_line

if TYPE_CHECKING:
    from rich.console import Group
    from rich.table import Table

    from profiles.schema import Profile

POSE = ("time_s", "x_m", "y_m", "yaw_deg")
DEVICE_COLUMNS = (".speed_m_s", ".heading_deg")
"""Columns that a terminal shows: these, and of each device those that end so."""
UNITS = {"_m_s": "m/s", "_deg": "°", "_m": "m", "_s": "s"}
"""By the ends of names, the longer of two that fit first."""


def replay(file: Path, /, *, profile: str | None = None, every: float = 0.1, json: Json = None) -> int:
    """Decode a candump log as the daemon of a robot would: odometry, speeds, currents, headings, what nodes reported.

    Of the `records.jsonl` of a fault it computes the commands again, from what was measured, and shows the first that
    differs; then it ends with 1.

    Example: `canhelm replay ~/.local/state/canhelm/max2d/runs/0001/frames.log --json`

    Args:
        file: A log as `candump -L`, `canhelm run --record` and runs have it, or the records of a fault.
        profile: The robot whose log it is; the default is max2d, and for a fault the profile beside it.
        every: Least time between two rows in seconds; 0 for one a SYNC.
    """
    from daemon.replay import replay as decode
    from daemon.runtime.clock import run_virtual
    from profiles.loader import load

    if not every >= 0.0:
        raise UsageError(f"--every {every:g} is no time", remedy="give seconds, 0 for every SYNC")
    records = _records(file) if _is_records(file) else None
    robot = load(profile or ("max2d" if records is None else _profile_beside(file))).profile
    if robot.bricks:
        raise UsageError(
            f"robot {robot.name} has a brick, of which a log of CAN says nothing",
            value=robot.name,
            remedy="name the robot whose log it is, by --profile; `canhelm plot` draws a run of this one",
        )
    if records is not None:
        return _compute_again(robot, records, json)
    replayed = run_virtual(decode(robot, frames_of(file), every))
    say(f"{replayed.frames} frames, of which the daemon reads {replayed.read}; {replayed.malformed} malformed")
    rows = sorted([*replayed.rows, *replayed.events], key=lambda row: float(row["time_s"]))
    show(rows, table, json)
    return 0


def _is_records(file: Path) -> bool:
    """Whether a file is for records of cycles: by its name, or as its first line begins as JSON does."""
    if file.name == RECORDS or not file.is_file():
        return file.name == RECORDS
    return _begins(file, b"{")


def _begins(file: Path, sign: bytes) -> bool:
    """Whether a file begins so; no where it cannot be read, as whoever reads it next tells why."""
    try:
        with file.open("rb") as content:
            return content.read(len(sign)) == sign
    except OSError:
        return False


def _records(file: Path) -> list[bytes]:
    try:
        return file.read_bytes().splitlines()
    except OSError as error:
        raise UsageError(f"cannot read {file}: {error.strerror}", remedy="name the file of a fault's run") from error


def _profile_beside(records: Path) -> str:
    """The profile that a fault's run keeps beside its records. Raises UsageError where there is none."""
    beside = records.with_name(PROFILE)
    if not beside.exists():
        remedy = "name the robot whose records they are, by --profile"
        raise UsageError(f"there is no {PROFILE} beside {records}", value=str(beside), remedy=remedy)
    return str(beside)


def _compute_again(robot: Profile, lines: list[bytes], json: Json) -> int:
    from daemon.recompute import METHODS, recompute
    from daemon.runtime.clock import run_virtual

    found = run_virtual(recompute(robot, lines))
    say(f"{found.cycles} cycles with a motion computed again")
    if found.left_out:
        kinds = ", ".join(f"{count} of {kind}" for kind, count in found.left_out.items())
        say(f"left out: {kinds}; only {', '.join(METHODS)} that begin in the recording can be computed")
    say("the first difference follows" if found.difference else "all commands are as they were recorded")
    told: dict[str, Any] = {"cycles": found.cycles, "left_out": found.left_out.total(), "left_out_of": found.left_out}
    if found.difference or wants_json(json):
        told["difference"] = found.difference
    show(told, json=json)
    return 1 if found.difference else 0


def frames_of(file: Path) -> Iterator[LogFrame]:
    """The frames of a log. Raises UsageError where it has none, or cannot be read."""
    found = others = 0
    try:
        with file.open(encoding="ascii", errors="replace") as lines:
            for line in lines:
                frame = parse_line(line.rstrip("\n"))
                if frame is None:
                    others += bool(line.strip())
                    continue
                found += 1
                yield frame
    except OSError as error:
        remedy = "name a candump log; a robot without CAN leaves none"
        raise UsageError(f"cannot read {file}: {error.strerror}", remedy=remedy) from error
    if not found:
        raise _no_log(file)
    if others:
        say(f"{others} lines of {file.name} are no classic frames and were left out")


def _no_log(file: Path) -> UsageError:
    from daemon.runs.mcap_bytes import MAGIC

    if file.is_file() and _begins(file, MAGIC):
        remedy = "a run keeps its frames.log, and `canhelm run --record FOLDER` makes logs"
        return UsageError(f"{file} is MCAP, and candump logs alone are read", value=str(file), remedy=remedy)
    remedy = "name one that `candump -L`, `canhelm record` or `canhelm run --record` made"
    return UsageError(f"{file} is no candump log: it has none of its frames", value=str(file), remedy=remedy)


def table(rows: list[dict[str, Any]]) -> Group:
    """What was read at each time, and below it what nodes reported."""
    from rich.console import Group

    readings = [row for row in rows if "event" not in row]
    reports = [row for row in rows if "event" in row]
    return Group(*([_readings(readings)] if readings else []), *([_reports(reports)] if reports else []))


def _readings(rows: list[dict[str, Any]]) -> Table:
    """Time, pose, speeds and headings; a heading has a line a word and one for the unit, to be narrow."""
    from rich.table import Table

    grid = Table(box=None, header_style="bold", padding=(0, 1, 0, 0))
    columns = [name for name in rows[0] if name in POSE or name.endswith(DEVICE_COLUMNS)]
    for name in columns:
        what, unit = _heading(name)
        grid.add_column("\n".join([*what.split("_"), unit]), justify="right", vertical="bottom")
    for row in rows:
        grid.add_row(*("-" if row.get(name) is None else f"{row[name]:.3f}" for name in columns))
    return grid


def _heading(column: str) -> tuple[str, str]:
    """What a column is of, and its unit (``rear_left.speed_m_s``: rear_left, m/s)."""
    what = column.partition(".")[0]
    ending = next(ending for ending in UNITS if column.endswith(ending))
    return what.removesuffix(ending), UNITS[ending]


def _reports(rows: list[dict[str, Any]]) -> Table:
    from rich.table import Table

    grid = Table("s", "reported", box=None, header_style="bold", padding=(0, 1, 0, 0))
    for row in rows:
        grid.add_row(f"{row['time_s']:.3f}", str(row["event"]))
    return grid
