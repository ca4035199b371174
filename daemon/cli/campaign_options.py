"""What the campaigns have in common on the command line: where they write, who works, how far they are."""

from __future__ import annotations

import time
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter
from cyclopts.validators import Number

from daemon.cli.output import console, say

if TYPE_CHECKING:
    from rich.progress import Progress

Workers = Annotated[int | None, Parameter(validator=Number(gte=1), help="Processes; one a core without it.")]
Out = Annotated[Path, Parameter(help="Folder for results and pictures; a campaign that was ended goes on there.")]


def worked_by(count: int) -> str:
    """So many workers, in words."""
    return "1 worker" if count == 1 else f"{count} workers"


def work_off(what: str, there: int, total: int, out: Path, where: str, kept: Iterable[int]) -> None:
    """Work off what is missing of a campaign, and tell how far it is, on a terminal with a bar.

    Args:
        what: is done (``runs``).
        there, total: how many were in the results before, and how many there will be.
        out: where they are.
        where: who works (``2 workers``).
        kept: does the work: yields how many more results are in their file, each time that there are more.
    """
    if there:
        say(f"{there} of {total} {what} are there already")
    begin, done = time.perf_counter(), there
    try:
        with progress_bar() as progress:
            bar = progress.add_task(what, total=total, completed=there)
            for count in kept:
                done += count
                progress.advance(bar, count)
    except KeyboardInterrupt:
        say(f"{done} of {total} {what} are kept in {out}; the same command goes on")
        raise
    if done > there:
        took = time.perf_counter() - begin
        say(f"{done - there} {what} in {took:.1f} s with {where}: {(done - there) / took:.3g} a second")


def progress_bar() -> Progress:
    """A bar on a terminal; nothing elsewhere."""
    from rich import progress

    columns = (progress.BarColumn(), progress.MofNCompleteColumn(), progress.TimeRemainingColumn())
    on = console(stderr=True)
    return progress.Progress(
        "[progress.description]{task.description}", *columns, console=on, disable=not on.is_terminal
    )
