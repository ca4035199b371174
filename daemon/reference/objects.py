"""The page of all objects: what ``canhelm object list`` and ``show`` say, in one table a device."""

from __future__ import annotations

from daemon.reference.markdown import code, table
from drivers.canopen.objects import ObjectDef
from drivers.explain_codes import DICTIONARIES

HEAD = """# Objects

The object dictionaries of the devices that canhelm drives: index and sub-index, name, type, access through SDO, unit,
value after power-up, meaning. `canhelm object show NAME` tells the same in a terminal, `canhelm sdo read NODE NAME`
asks a device. Objects marked *later* are of firmware later than 2011h: `canhelm sdo read` tells whether a drive has
them.

"""
COLUMNS = ("object", "name", "type", "access", "unit", "default", "meaning")


def objects() -> str:
    """Every object of every device, as Markdown."""
    parts = [f"## {device}\n\n{table(COLUMNS, map(_row, known.objects))}" for device, known in DICTIONARIES.items()]
    return HEAD + "\n".join(parts)


def _row(entry: ObjectDef) -> tuple[str, ...]:
    kind, access = entry.type.name.lower(), entry.access.value
    return code(entry.address), code(entry.name), kind, access, entry.unit, _default(entry), _meaning(entry)


def _default(entry: ObjectDef) -> str:
    if entry.default is None:
        return ""
    return f"0x{entry.default:X} + node id" if entry.plus_node_id else str(entry.default)


def _meaning(entry: ObjectDef) -> str:
    limits = (("at least", entry.low), ("at most", entry.high))
    told = [f"{words} {limit}" for words, limit in limits if limit is not None]
    parts = ["*later*" if entry.firmware == "later" else "", entry.meaning, ", ".join(told).capitalize()]
    parts += [
        f"Trouble: {entry.cause} {entry.cure}" if entry.cause else "",
        f"({entry.source})" if entry.source else "",
    ]
    return " ".join(part if part[-1] in ".)*" else f"{part}." for part in parts if part)
