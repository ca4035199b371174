"""The Ackermann car's part of ``canhelm demo``."""

from __future__ import annotations

from collections.abc import Callable, Coroutine
from pathlib import Path
from typing import TYPE_CHECKING, Any

from daemon.cli.output import say, show, words

if TYPE_CHECKING:
    from rich.table import Table

    from daemon.demo_ackermann import CarResult
    from profiles.schema import Profile

Runner = Callable[[Coroutine[Any, Any, Any]], Any]


def demo_ackermann(
    figure: str,
    robot: Profile,
    seed: int,
    out: Path | None,
    json: bool | None,
    runner: Runner,
    can_draw: Callable[[], bool],
) -> int:
    """Drive one step of the car or all of them; the exit code.

    Args:
        figure: a name, or that of the group.
        robot: profile of the car.
        seed: of everything random.
        out: folder for pictures and candump logs, or None.
        json: how to print.
        runner: of the event loop, in real or virtual time.
        can_draw: whether pictures can be drawn.
    """
    from daemon import demo_ackermann as demo

    chosen = [entry for entry in demo.FIGURES if figure in (demo.GROUP, entry.identity)]

    async def drive() -> list[CarResult]:
        return [await demo.run(robot, entry, seed, out, say) for entry in chosen]

    results: list[CarResult] = runner(drive())
    show([result.numbers for result in results], _table, json)
    if out is not None and can_draw():
        from daemon.demo_ackermann_pictures import draw

        for result in results:
            say(f"picture {draw(result, out)}")
    return 0


def _table(rows: list[dict[str, Any]]) -> Table:
    from rich.table import Table

    table = Table("figure", "quantity", "report's equations", "driven", title="Ackermann car, simulated")
    for row in rows:
        for key, value in row["achieved"].items():
            table.add_row(row["figure"], key, words(row["computed"][key]), words(value))
        table.add_section()
    return table
