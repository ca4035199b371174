"""``canhelm object``: the object dictionaries of the devices that canhelm knows. Works without a daemon."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import App, Parameter

from canhelm.errors import ConfigError, UsageError
from daemon.cli.output import Json, say, show
from drivers.canopen.dcf import make_eds
from drivers.canopen.objects import ObjectDef, ObjectTable, parse_address
from drivers.encoder.objects import OBJECTS as ENCODER_OBJECTS
from drivers.epos.objects import OBJECTS as EPOS_OBJECTS
from drivers.epos.parameters import EPOS_24_5
from drivers.explain_codes import find_object, object_details

if TYPE_CHECKING:
    from rich.table import Table

NodeType = Literal["epos", "encoder"]
TABLES: dict[NodeType, ObjectTable] = {"epos": EPOS_OBJECTS, "encoder": ENCODER_OBJECTS}

LATER_FIRMWARE = "later firmware only; `canhelm sdo read` tells whether a drive has it"

OneType = Annotated[NodeType | None, Parameter(name="--node-type", help="Objects of this kind of device alone.")]
EdsFile = Annotated[Path | None, Parameter(name="--eds", help="Objects of an EDS or DCF file instead.")]

app = App(name="object", help="The object dictionary.")


@app.command(name="list")
def object_list(pattern: str = "", /, *, node_type: OneType = None, eds: EdsFile = None, json: Json = None) -> None:
    """List objects whose name, address or meaning holds a pattern; without one, all.

    Example: `canhelm object list current`, `canhelm object list 0x2078 --node-type epos`

    Args:
        pattern: Part of a name, an address or a meaning, capitals alike.
    """
    tables = _tables(node_type, eds)
    rows = [_row(entry, kind) for kind, table in tables.items() for entry in table.objects if _matches(entry, pattern)]
    if not rows:
        raise UsageError(f"no object matches {pattern!r}", value=pattern, remedy="canhelm object list shows all")
    show(rows, _table, json)


@app.command(name="show")
def object_show(name: str, /, *, node_type: OneType = None, eds: EdsFile = None, json: Json = None) -> None:
    """Show all about an object: type, access, unit, limits, default, meaning, cause and cure.

    An index without a sub-index means all its entries.

    Example: `canhelm object show target_velocity`, `canhelm object show 0x2078`, `canhelm object show 0x2078/1`

    Args:
        name: Its name, or its address as 0x6041 or 0x2078/1.
    """
    tables = _tables(node_type, eds)
    rows = [_record(entry, kind) for kind, table in tables.items() for entry in _entries(table, name)]
    if not rows:
        near = " or ".join(dict.fromkeys(filter(None, (table.name_like(name) for table in tables.values()))))
        remedy = "`canhelm object list PATTERN` looks for names and meanings"
        raise UsageError(f"no object {name!r}", object=name, remedy=f"did you mean {near}?" if near else remedy)
    show(rows, _records, json)


@app.command
def export(file: Path, /, *, later: Annotated[bool, Parameter(negative=())] = False) -> None:
    """Write the object dictionary of the EPOS 24/5 as an EDS file (CiA 306), for other tools.

    Example: `canhelm object export epos24_5.eds`

    Args:
        file: File to write.
        later: With the objects of later firmware, which a drive may lack.
    """
    entries = [entry for entry in EPOS_OBJECTS.objects if later or entry.firmware == "2011h"]
    try:
        file.write_text(make_eds(entries, EPOS_24_5), encoding="utf-8")
    except OSError as error:
        raise ConfigError(f"{file} cannot be written ({error.strerror})", remedy="choose another place") from None
    say(f"{len(entries)} objects in {file}")


def _tables(node_type: NodeType | None, eds: Path | None) -> Mapping[str, ObjectTable]:
    """The tables to look in: those of this program, or that of a file, whose mistakes are told."""
    if eds is None:
        return {kind: table for kind, table in TABLES.items() if node_type in (None, kind)}
    from drivers.canopen.eds import load_eds, object_table  # here: the library canopen is slow to load

    loaded = load_eds(eds)
    for warning in loaded.warnings:
        say(warning)
    return {eds.stem: object_table(loaded.dictionary, eds.name)}


def _entries(table: ObjectTable, name: str) -> list[ObjectDef]:
    """The entry that a person means; all entries of an index that was given without a sub-index."""
    address = parse_address(name)
    if address and "/" not in name and ":" not in name:
        return [entry for entry in table.objects if entry.index == address[0]]
    found = find_object(table, name)
    return [found] if found else []


def _matches(entry: ObjectDef, pattern: str) -> bool:
    wanted = pattern.lower()
    texts = (entry.name, entry.name.replace("_", " "), entry.address.lower(), entry.meaning.lower())
    return any(wanted in text for text in texts)


def _row(entry: ObjectDef, node_type: str) -> dict[str, str]:
    return {
        "object": entry.address,
        "name": entry.name,
        "node_type": node_type,
        "type": entry.type.name.lower(),
        "access": entry.access.value,
        "unit": entry.unit,
        "firmware": entry.firmware,
        "meaning": entry.meaning,
    }


def _record(entry: ObjectDef, node_type: str) -> dict[str, str]:
    firmware = LATER_FIRMWARE if entry.firmware == "later" else entry.firmware
    texts = {"cause": entry.cause, "cure": entry.cure, "firmware": firmware, "source": entry.source}
    rest = object_details(entry) | {label: text for label, text in texts.items() if text}
    head = {"object": entry.address, "name": entry.name, "node_type": node_type, "meaning": entry.meaning}
    return head | rest


def _table(rows: Sequence[dict[str, str]]) -> Table:
    from rich.table import Table

    table = Table(box=None, header_style="bold", padding=(0, 2, 0, 0))
    for column in ("object", "name", "node_type", "type", "access", "unit", "firmware"):
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
