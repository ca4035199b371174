"""Recording where a vehicle goes, and making a path file of it."""

from __future__ import annotations

import csv
import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, Literal, TextIO

from canhelm.errors import DaemonNotRunning, Refused, UsageError
from daemon.cli.motion import signals_interrupt
from daemon.cli.options import Options
from daemon.cli.output import say, say_warning, show
from daemon.loops.odometry import Pose
from daemon.loops.recorded_path import fit_record
from profiles.path_writing import path_lines

COLUMNS = ("time_s", "x_m", "y_m", "yaw_deg", "trailer_x_m", "trailer_y_m", "trailer_yaw_deg")
"""Of a record; the last three are empty for a vehicle without a trailer."""
LONGEST_RECORD = 1_000_000
FARTHEST_M = 1e6
"""Nobody has driven farther from where the daemon began."""


def record(options: Options, name: str, duration_s: float | None, rate_hz: float) -> int:
    """Write where the vehicle is, row by row, until the time is over or somebody interrupts; the exit code."""
    with options.client() as client, _opened(name, "x") as file:
        if "odometry" not in client.status()["vehicle"]:
            raise Refused("this vehicle does not know where it is", remedy="record one that has an odometry")
        rows = csv.writer(file)
        rows.writerow(COLUMNS)
        count, begin_s = 0, None
        try:
            with signals_interrupt():
                say("recording; Ctrl-C ends it")
                for kind, status in client.notifications(rate_hz):
                    if kind != "status":
                        continue
                    begin_s = status["time_s"] if begin_s is None else begin_s
                    rows.writerow(_row(status, begin_s))
                    count += 1
                    if duration_s is not None and status["time_s"] - begin_s >= duration_s:
                        break
        except KeyboardInterrupt:
            pass
        except DaemonNotRunning as error:
            what = f"{error.message}; {name} is kept with {count} rows"
            raise DaemonNotRunning(what, value=name, remedy=error.remedy) from None
    show({"record": name, "rows": count}, json=options.json)
    return 0


def _row(status: dict[str, Any], begin_s: float) -> list[Any]:
    vehicle = status["vehicle"]
    poses = (vehicle["odometry"], vehicle.get("trailer") or {})
    cells = (pose.get(key, "") for pose in poses for key in ("x_m", "y_m", "yaw_deg"))
    return [round(status["time_s"] - begin_s, 3), *cells]


def fit(name: str, out: str, tolerance_m: float, json: bool | None) -> int:
    """Make a path file of a record; the exit code.

    Args:
        name: of the record.
        out: the path file.
        tolerance_m: what the path may be off.
        json: how to print.

    Raises:
        UsageError: the record or the tolerance makes no sense, or a file cannot be opened.
    """
    if not 1e-4 <= tolerance_m <= 1.0:
        raise UsageError(f"a tolerance of {tolerance_m:g} m makes no sense", remedy="give 0.0001 to 1")
    path = fit_record(*_read(name), tolerance_m)
    if path is None:
        raise UsageError(f"{name}: the vehicle hardly moved", value=name, remedy="record while it drives")
    with _opened(out, "x") as file:
        file.writelines(f"{line}\n" for line in path_lines(path.spec(), f"Fitted to {Path(name).name}."))
    off_m = path.deviation_m
    if off_m > tolerance_m:
        say_warning(f"the record scatters by more than the tolerance: a pose lies {off_m:.4f} m beside the path")
    numbers = {
        "file": out,
        "pieces": len(path.pieces),
        "length_m": round(path.length_m, 3),
        "deviation_m": round(off_m, 5),
    }
    show(numbers, json=json)
    return 0


def _opened(name: str, mode: Literal["r", "x"]) -> TextIO:
    try:
        return Path(name).open(mode, newline="", encoding="utf-8")
    except FileExistsError:
        raise UsageError(f"{name} exists already", value=name, remedy="name a new file, or remove it first") from None
    except OSError as error:
        raise UsageError(f"{name}: {error.strerror}", value=name, remedy="name a file that can be opened") from None


def _read(name: str) -> tuple[list[Pose], list[Pose]]:
    """Poses of the truck, and of the unit that is the reference backwards."""
    trucks, trailers = [], []
    for number, row in enumerate(_rows(name), start=1):
        if number > LONGEST_RECORD:
            raise UsageError(f"{name}: more than {LONGEST_RECORD} rows", value=name, remedy="record it in parts")
        if number == 1 and tuple(row) == COLUMNS:
            continue
        try:
            truck = _pose(row[1:4])
            trucks.append(truck)
            trailers.append(_pose(row[4:7]) if row[4] else truck)
        except (ValueError, IndexError):
            what = f"{name}:{number}: is no row of a record"
            raise UsageError(what, value=name, remedy=f"its columns are {', '.join(COLUMNS)}") from None
    return trucks, trailers


def _rows(name: str) -> Iterator[list[str]]:
    with _opened(name, "r") as file:
        try:
            yield from csv.reader(file)
        except (UnicodeDecodeError, csv.Error):
            what = f"{name}: is no text, and no record"
            raise UsageError(what, value=name, remedy="give a file that `canhelm drive record` wrote") from None


def _pose(cells: Sequence[str]) -> Pose:
    x, y, yaw_deg = map(float, cells)
    if not (abs(x) <= FARTHEST_M and abs(y) <= FARTHEST_M and math.isfinite(yaw_deg)):
        raise ValueError(cells)
    return Pose(x, y, math.radians(yaw_deg))
