"""``canhelm object``: the object dictionaries of the devices that canhelm knows. Works without a daemon."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import App, Parameter

from canhelm.errors import UsageError
from daemon.cli.output import Json, show
from drivers.canopen.objects import ObjectDef, ObjectTable
from drivers.encoder.objects import OBJECTS as ENCODER_OBJECTS
from drivers.epos.objects import OBJECTS as EPOS_OBJECTS
from drivers.explain_codes import find_object, object_details

if TYPE_CHECKING:
    from rich.table import Table

NodeType = Literal["epos", "encoder"]
TABLES: dict[NodeType, ObjectTable] = {"epos": EPOS_OBJECTS, "encoder": ENCODER_OBJECTS}

OneType = Annotated[NodeType | None, Parameter(name="--node-type", help="Objects of this kind of device alone.")]

app = App(name="object", help="The object dictionary.")


@app.command(name="list")
def object_list(pattern: str = "", /, *, node_type: OneType = None, json: Json = None) -> None:
    """List objects whose name, address or meaning holds a pattern; without one, all.

    Example: `canhelm object list current`, `canhelm object list 0x2078 --node-type epos`

    Args:
        pattern: Part of a name, an address or a meaning, capitals alike.
    """
    rows = [
        _row(entry, kind) for kind in _kinds(node_type) for entry in TABLES[kind].objects if _matches(entry, pattern)
    ]
    if not rows:
        raise UsageError(f"no object matches {pattern!r}", value=pattern, remedy="canhelm object list shows all")
    show(rows, _table, json)


@app.command(name="show")
def object_show(name: str, /, *, node_type: OneType = None, json: Json = None) -> None:
    """Show all about an object: type, access, unit, limits, default, meaning, cause and cure.

    Example: `canhelm object show target_velocity`, `canhelm object show 0x2078/1`

    Args:
        name: Its name, or its address as 0x6041 or 0x2078/1.
    """
    found = [(kind, find_object(TABLES[kind], name)) for kind in _kinds(node_type)]
    rows = [_record(entry, kind) for kind, entry in found if entry is not None]
    if not rows:
        raise UsageError(
            f"no object {name!r}", object=name, remedy="canhelm object list PATTERN looks for names and meanings"
        )
    show(rows, _records, json)


def _kinds(node_type: NodeType | None) -> tuple[NodeType, ...]:
    return (node_type,) if node_type else tuple(TABLES)


def _matches(entry: ObjectDef, pattern: str) -> bool:
    wanted = pattern.lower()
    texts = (entry.name, entry.name.replace("_", " "), entry.address.lower(), entry.meaning.lower())
    return any(wanted in text for text in texts)


def _row(entry: ObjectDef, node_type: NodeType) -> dict[str, str]:
    return {
        "object": entry.address,
        "name": entry.name,
        "node_type": node_type,
        "type": entry.type.name.lower(),
        "access": entry.access.value,
        "unit": entry.unit,
        "meaning": entry.meaning,
    }


def _record(entry: ObjectDef, node_type: NodeType) -> dict[str, str]:
    texts = {"cause": entry.cause, "cure": entry.cure, "firmware": entry.firmware, "source": entry.source}
    rest = object_details(entry) | {label: text for label, text in texts.items() if text}
    head = {"object": entry.address, "name": entry.name, "node_type": node_type, "meaning": entry.meaning}
    return head | rest


def _table(rows: Sequence[dict[str, str]]) -> Table:
    from rich.table import Table

    table = Table(box=None, header_style="bold", padding=(0, 2, 0, 0))
    for column in ("object", "name", "node_type", "type", "access", "unit"):
        table.add_column(column.replace("node_type", "of"), no_wrap=True)
    for row in rows:
        table.add_row(*(text for column, text in row.items() if column != "meaning"))
    return table


def _records(rows: Sequence[dict[str, str]]) -> Table:
    from rich.table import Table

    grid = Table.grid(padding=(0, 2))
    for row in rows:
        for label, text in row.items():
            grid.add_row(label.replace("_", " "), text)
        grid.add_row("", "")
    return grid
