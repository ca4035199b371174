"""The semi-trailer's part of ``canhelm demo``."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from daemon.cli.demo_run import DemoRun
from daemon.cli.output import say

if TYPE_CHECKING:
    from rich.table import Table

    from daemon.demo_semitrailer import SemitrailerResult
    from profiles.schema import Profile


def demo_semitrailer(figure: str, robot: Profile, run: DemoRun) -> int:
    """Drive one manoeuvre of the semi-trailer or all of them; the exit code.

    Args:
        figure: a name, or that of the group.
        robot: profile of the vehicle.
        run: how.
    """
    from daemon import demo_semitrailer as demo

    chosen = [entry for entry in demo.figures() if figure in (demo.GROUP, entry.identity)]
    return run.drive([partial(demo.drive, robot, entry, run.seed, run.out, say) for entry in chosen], _table, _draw)


def _table(rows: list[dict[str, Any]]) -> Table:
    from rich.table import Table

    columns = ("end_error_m", "end_heading_error_deg", "largest_error_m", "settled_error_m", "largest_bending_deg")
    table = Table("figure", "move", *columns, "duration_s", title="Semi-trailer, simulated")
    for row in rows:
        achieved = row["achieved"]
        cells = [achieved[column] for column in (*columns, "duration_s")]
        table.add_row(row["figure"], row["move"], *("-" if cell is None else f"{cell:g}" for cell in cells))
    return table


def _draw(result: SemitrailerResult, folder: Path) -> Path:
    from daemon.demo_semitrailer_pictures import draw

    return draw(result, folder)
