"""``canhelm replay``: a candump log as the daemon reads it."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from canhelm.errors import ConfigError, UsageError
from daemon.cli.output import Json, say, show, words
from drivers.bus.candump import LogFrame, parse_line

if TYPE_CHECKING:
    from rich.table import Table

TERMINAL_COLUMNS = ("time_s", "x_m", "y_m", "yaw_deg")


def replay(file: Path, /, *, profile: str = "max2d", every: float = 0.1, json: Json = None) -> None:
    """Decode a candump log as the daemon of a robot would: odometry, speeds, currents, headings, what nodes reported.

    Example: `canhelm replay ~/.local/state/canhelm/max2d/runs/0001/frames.log --json`

    Args:
        file: A log as `candump -L`, `canhelm run --record` and runs have it.
        profile: The robot whose log it is.
        every: Least time between two rows in seconds; 0 for one a SYNC.
    """
    from daemon.replay import replay as decode
    from daemon.runtime.clock import run_virtual
    from profiles.loader import load

    if not every >= 0.0:
        raise UsageError(f"--every {every:g} is no time", remedy="give seconds, 0 for every SYNC")
    robot = load(profile).profile
    if robot.bricks:
        raise UsageError(
            f"robot {robot.name} has a brick, of which a log of CAN says nothing",
            value=profile,
            remedy="name the robot whose log it is, by --profile; `canhelm plot` draws a run of this one",
        )
    replayed = run_virtual(decode(robot, _frames(file), every))
    say(f"{replayed.frames} frames, of which the daemon reads {replayed.read}; {replayed.malformed} malformed")
    rows = sorted([*replayed.rows, *replayed.events], key=lambda row: float(row["time_s"]))
    show(rows, _table, json)


def _frames(file: Path) -> Iterator[LogFrame]:
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
