"""What the campaigns have in common on the command line: where they write, who works, how far they are."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter
from cyclopts.validators import Number

from daemon.cli.output import console

if TYPE_CHECKING:
    from rich.progress import Progress

Workers = Annotated[int | None, Parameter(validator=Number(gte=1), help="Processes; one a core without it.")]
Out = Annotated[Path, Parameter(help="Folder for results and pictures; a campaign that was ended goes on there.")]


def progress_bar() -> Progress:
    """A bar on a terminal; nothing elsewhere."""
    from rich import progress

    columns = (progress.BarColumn(), progress.MofNCompleteColumn(), progress.TimeRemainingColumn())
    on = console(stderr=True)
    return progress.Progress(
        "[progress.description]{task.description}", *columns, console=on, disable=not on.is_terminal
    )
