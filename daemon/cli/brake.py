"""``canhelm brake``."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import App, Parameter

from daemon.cli.options import DEFAULT, Brakes, Options
from daemon.cli.output import show, words

if TYPE_CHECKING:
    from rich.table import Table

app = App(name="brake", help="Engage, release and look at brakes.")


def _call(options: Options, method: str, pair: str, **params: Any) -> None:
    with options.client() as client:
        show(client.call(method, pair=pair, **params), _table, options.json)


def _table(data: Mapping[str, Any]) -> Table:
    from rich.table import Table

    brakes = data.get("brakes") or []
    columns = list(brakes[0]) if brakes else ["brakes"]
    grid = Table(*columns, box=None, header_style="bold", pad_edge=False)
    for brake in brakes:
        grid.add_row(*(words(brake.get(column)) for column in columns))
    return grid


@app.command
def engage(pair: Brakes = "all", /, *, options: Options = DEFAULT) -> None:
    """Engage brakes; on the MAX2D they lock the direction of a wheel pair.

    Example: `canhelm brake engage all`
    """
    _call(options, "brake.engage", pair)


@app.command
def release(
    pair: Brakes = "all", /, *, force: Annotated[bool, Parameter(negative=())] = False, options: Options = DEFAULT
) -> None:
    """Release brakes.

    Example: `canhelm brake release front`

    Parameters
    ----------
    force: bool
        Release a holding brake although its drive is disabled and would not hold the axis.
    """
    _call(options, "brake.release", pair, force=force)


@app.command
def status(pair: Brakes = "all", /, *, options: Options = DEFAULT) -> None:
    """State of brakes.

    Example: `canhelm brake status`
    """
    _call(options, "brake.status", pair)
