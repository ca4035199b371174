"""``canhelm explain``."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from daemon.cli.output import Json, show
from drivers.explain import KINDS
from drivers.explain import explain as read_code

if TYPE_CHECKING:
    from rich.console import Group

Kind = Annotated[str | None, Parameter(name="--as", help=f"Read it as this alone: {', '.join(KINDS)}.")]


def explain(*code: str, as_: Kind = None, json: Json = None) -> None:
    """Say what a code means, with cause and cure: every reading of it, the most likely first.

    Example: `canhelm explain 0x0337`, `canhelm explain 6320h --as emcy`, `canhelm explain 181#3703000000000000`,
    `canhelm explain 10 01 41 60 00 01 AB F0`

    Args:
        code: A statusword, controlword, EMCY code, SDO abort code, NMT byte, error register, object (name or address),
            a frame as candump writes it, or the bytes of a frame of an EPOS's RS-232 line. Several words are one code.
    """
    readings = [asdict(reading) for reading in read_code(" ".join(code), as_)]
    for reading in readings:
        del reading["rank"]
    show(readings, _panels, json)


def _panels(readings: Sequence[dict[str, Any]]) -> Group:
    """One table a reading, its title above."""
    from rich.console import Group
    from rich.padding import Padding
    from rich.table import Table
    from rich.text import Text

    blocks: list[Text | Padding] = []
    for reading in readings:
        grid = Table.grid(padding=(0, 2))
        for label, words in _lines(reading):
            grid.add_row(Text(label, style="dim"), Text(words))
        blocks += [Text(reading["title"], style="bold"), Padding(grid, (0, 0, 1, 2))]
    return Group(*blocks)


def _lines(reading: dict[str, Any]) -> list[tuple[str, str]]:
    labels = ("meaning", "cause", "cure", "assumes", "source")
    lines = {label: str(reading[label]) for label in labels if reading[label]}
    meaning = lines.pop("meaning", "")
    return [("meaning", meaning), *reading["details"].items(), *lines.items()]
