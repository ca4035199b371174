"""The semi-trailer's part of ``canhelm demo``."""

from __future__ import annotations

from collections.abc import Callable, Coroutine
from pathlib import Path
from typing import TYPE_CHECKING, Any

from daemon.cli.output import say, show

if TYPE_CHECKING:
    from rich.table import Table

    from daemon.demo_semitrailer import SemitrailerResult
    from profiles.schema import Profile

Runner = Callable[[Coroutine[Any, Any, Any]], Any]


def demo_semitrailer(
    figure: str,
    robot: Profile,
    seed: int,
    out: Path | None,
    json: bool | None,
    runner: Runner,
    can_draw: Callable[[], bool],
) -> int:
    """Drive one figure of the semi-trailer or all of them; the exit code.

    Args:
        figure: a name, or that of the group.
        robot: profile of the vehicle.
        seed: of everything random.
        out: folder for pictures and candump logs, or None.
        json: how to print.
        runner: of the event loop, in real or virtual time.
        can_draw: whether pictures can be drawn.
    """
    from daemon import demo_semitrailer as demo

    chosen = [entry for entry in demo.figures() if figure in (demo.GROUP, entry.identity)]

    async def drive() -> list[SemitrailerResult]:
        return [await demo.drive(robot, entry, seed, out, say) for entry in chosen]

    results: list[SemitrailerResult] = runner(drive())
    show([result.numbers for result in results], _table, json)
    if out is not None and can_draw():
        from daemon.demo_semitrailer_pictures import draw

        for result in results:
            say(f"picture {draw(result, out)}")
    return 0


def _table(rows: list[dict[str, Any]]) -> Table:
    from rich.table import Table

    columns = ("end_error_m", "end_heading_error_deg", "largest_error_m", "settled_error_m", "largest_bending_deg")
    table = Table("figure", "move", *columns, "duration_s", title="Semi-trailer, simulated")
    for row in rows:
        achieved = row["achieved"]
        cells = [achieved[column] for column in (*columns, "duration_s")]
        table.add_row(row["figure"], row["move"], *("-" if cell is None else f"{cell:g}" for cell in cells))
    return table
