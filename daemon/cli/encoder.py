"""``canhelm encoder``: where the heading 0 of a wheel pair is."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import App, Parameter

from daemon.cli.options import DEFAULT, Options, agreed
from daemon.cli.output import say, show, words
from daemon.cli.own_profile import own_profile

if TYPE_CHECKING:
    from rich.table import Table

app = App(name="encoder", help="Encoders of wheel pairs: what they say, and where heading 0 is.")

COLUMNS = ("name", "node", "heading_deg", "position_counts", "zero_counts", "offset_counts", "calibrated")
Pair = Annotated[str, Parameter(help="Name of the pair's encoder: front or rear.")]


@app.command
def status(pair: Pair = "all", /, *, options: Options = DEFAULT) -> None:
    """Heading, counts and zero of encoders.

    Example: `canhelm encoder status`
    """
    with options.client() as client:
        show(client.call("encoder.status", pair=pair)["encoders"], _table, options.json)


@app.command
def zero(
    pair: Pair,
    /,
    *,
    store: Literal["device", "profile"] = "device",
    yes: Annotated[bool, Parameter(negative=())] = False,
    force: Annotated[bool, Parameter(negative=())] = False,
    options: Options = DEFAULT,
) -> None:
    """The pair stands straight now: make this heading 0. It asks first, and keeps the old value in the side file.

    Refused while anything is enabled or the pair moves. A preset in the device is saved, and checked after its restart.

    Example: `canhelm encoder zero front --yes`

    Args:
        store: Where the zero is kept: in the encoder, or in the profile's side file.
        yes: Do not ask.
        force: Also where the pair stands more than 30 degrees from its old zero.
    """
    from profiles.side_file import write_values

    with options.client() as client:
        loaded = own_profile(client.status())
        if not (yes or agreed(f"does the {pair} pair stand straight ahead?")):
            say("nothing was changed")
            return
        found = client.call("encoder.zero", pair=pair, store=store, force=force)
    show(found, json=options.json)
    old = found["zero_before_counts" if store == "profile" else "position_before_counts"]
    values: dict[tuple[str, ...], int] = {("encoders", pair, "zero_before_counts"): old}
    if store == "profile":
        values["encoders", pair, "zero_counts"] = found["zero_counts"]
    side = write_values(loaded.path, values)
    say(f"{old} counts are kept as zero_before_counts in {side}")
    if store == "profile":
        say("the new zero counts when the daemon is started anew")


def _table(rows: Sequence[dict[str, Any]]) -> Table:
    from rich.table import Table

    table = Table(*COLUMNS, box=None, header_style="bold", pad_edge=False)
    for row in rows:
        table.add_row(*(words(row[column], digits=6) for column in COLUMNS))
    return table
