"""The MAX2D on a path, in ``canhelm demo``."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from daemon.cli.demo_run import DemoRun
from daemon.cli.output import say, words

if TYPE_CHECKING:
    from rich.table import Table

    from daemon.demo_max2d_path import PathResult
    from profiles.schema import Profile


def demo_max2d_path(robot: Profile, run: DemoRun) -> int:
    """Drive the path; the exit code.

    Args:
        robot: profile with paired steering.
        run: how.
    """
    from daemon.demo_max2d_path import drive

    return run.drive([partial(drive, robot, run.seed, run.out, say)], _table, _draw)


def _table(rows: list[dict[str, Any]]) -> Table:
    from rich.table import Table

    columns = ("kind", "length_m", "radius_m", "rear_deg", "front_deg")
    deviations = ("deviation_m", "driven_deviation_m", "true_deviation_m")
    table = Table("piece", *columns, "planned, m", "by odometry, m", "true, m", title="MAX2D on a path, simulated")
    for number, piece in enumerate(rows[0]["pieces"]):
        table.add_row(str(number), *(words(piece[key]) for key in (*columns, *deviations)))
    return table


def _draw(result: PathResult, folder: Path) -> Path:
    from daemon.demo_max2d_path_pictures import draw

    return draw(result, folder)
