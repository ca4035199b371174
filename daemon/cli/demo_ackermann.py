"""The Ackermann car's part of ``canhelm demo``."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from daemon.cli.demo_run import DemoRun
from daemon.cli.output import say, words

if TYPE_CHECKING:
    from rich.table import Table

    from daemon.demo_ackermann import CarResult
    from profiles.schema import Profile


def demo_ackermann(figure: str, robot: Profile, run: DemoRun) -> int:
    """Drive one step of the car or all of them; the exit code.

    Args:
        figure: a name, or that of the group.
        robot: profile of the car.
        run: how.
    """
    from daemon import demo_ackermann as demo

    steps = [step for step in demo.FIGURES if figure in (demo.GROUP, step.identity)]
    return run.drive([partial(demo.run, robot, step, run.seed, run.out, say) for step in steps], _table, _draw)


def _table(rows: list[dict[str, Any]]) -> Table:
    from rich.table import Table

    table = Table("figure", "quantity", "report's equations", "driven", title="Ackermann car, simulated")
    for row in rows:
        for key, value in row["achieved"].items():
            table.add_row(row["figure"], key, words(row["computed"][key]), words(value))
        table.add_section()
    return table


def _draw(result: CarResult, folder: Path) -> Path:
    from daemon.demo_ackermann_pictures import draw

    return draw(result, folder)
