"""The MAX2D on a path, in ``canhelm demo``."""

from __future__ import annotations

from collections.abc import Callable, Coroutine
from pathlib import Path
from typing import TYPE_CHECKING, Any

from daemon.cli.output import say, show, words

if TYPE_CHECKING:
    from rich.table import Table

    from daemon.demo_max2d_path import PathResult
    from profiles.schema import Profile

Runner = Callable[[Coroutine[Any, Any, Any]], Any]


def demo_max2d_path(
    robot: Profile, seed: int, out: Path | None, json: bool | None, runner: Runner, can_draw: Callable[[], bool]
) -> int:
    """Drive the path; the exit code.

    Args:
        robot: profile with paired steering.
        seed: of everything random.
        out: folder for the picture and the candump log, or None.
        json: how to print.
        runner: of the event loop, in real or virtual time.
        can_draw: whether pictures can be drawn.
    """
    from daemon.demo_max2d_path import drive

    result: PathResult = runner(drive(robot, seed, out, say))
    show([result.numbers], _table, json)
    if out is not None and can_draw():
        from daemon.demo_max2d_path_pictures import draw

        say(f"picture {draw(result, out)}")
    return 0


def _table(rows: list[dict[str, Any]]) -> Table:
    from rich.table import Table

    columns = ("kind", "length_m", "radius_m", "rear_deg", "front_deg")
    deviations = ("deviation_m", "driven_deviation_m", "true_deviation_m")
    table = Table("piece", *columns, "planned, m", "by odometry, m", "true, m", title="MAX2D on a path, simulated")
    for number, piece in enumerate(rows[0]["pieces"]):
        table.add_row(str(number), *(words(piece[key]) for key in (*columns, *deviations)))
    return table
