"""``canhelm replay``: a candump log as the daemon reads it, and a fault's cycles through the loops again."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from canhelm.errors import ConfigError, UsageError
from daemon.cli.output import Json, say, show, words
from daemon.runs.store import PROFILE, RECORDS
from drivers.bus.candump import LogFrame, parse_line

if TYPE_CHECKING:
    from rich.table import Table

    from profiles.schema import Profile

TERMINAL_COLUMNS = ("time_s", "x_m", "y_m", "yaw_deg")


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
    show(rows, _table, json)
    return 0


def _is_records(file: Path) -> bool:
    """Whether a file is for records of cycles: by its name, or as its first line begins as JSON does."""
    if file.name == RECORDS or not file.is_file():
        return file.name == RECORDS
    try:
        with file.open("rb") as content:
            return content.read(1) == b"{"
    except OSError:
        return False  # whoever reads it next tells why it cannot be


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
    from daemon.recompute import recompute
    from daemon.runtime.clock import run_virtual

    found = run_virtual(recompute(robot, lines))
    say(f"{found.cycles} cycles with a motion computed again; {found.left_out} others could not be")
    say("the first difference follows" if found.difference else "all commands are as they were recorded")
    show({"cycles": found.cycles, "left_out": found.left_out, "difference": found.difference}, json=json)
    return 1 if found.difference else 0


def frames_of(file: Path) -> Iterator[LogFrame]:
    """The frames of a log. Raises ConfigError where it has none, UsageError where it cannot be read."""
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
        raise ConfigError(f"{file} has no frame of candump's log format", remedy="make it by `candump -L`")
    if others:
        say(f"{others} lines of {file.name} are no classic frames and were left out")


def _table(rows: list[dict[str, Any]]) -> Table:
    from rich.table import Table

    readings = [row for row in rows if "event" not in row]
    names = [name for name in (readings[0] if readings else {}) if name.endswith((".speed_m_s", ".heading_deg"))]
    columns = [*(name for name in TERMINAL_COLUMNS if not readings or name in readings[0]), *names]
    grid = Table(*columns, "reported", box=None, header_style="bold")
    for row in rows:
        grid.add_row(*(words(row[name]) if name in row else "" for name in columns), str(row.get("event", "")))
    return grid
