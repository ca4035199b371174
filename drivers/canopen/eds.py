"""EDS and DCF files (CiA 306) as object dictionaries of the library ``canopen``, and as tables of this program."""

from __future__ import annotations

import configparser
import io
import re
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from canopen.objectdictionary import ObjectDictionary, ODArray, ODRecord, ODVariable
from canopen.objectdictionary.eds import import_eds

from canhelm.errors import ConfigError
from drivers.canopen.dcf import TYPE_CODES
from drivers.canopen.eds_text import EdsText, read_eds_text
from drivers.canopen.objects import Access, DataType, ObjectDef, ObjectTable

_TYPES = {code: data_type for data_type, code in TYPE_CODES.items()}
_ACCESS = {"rwr": Access.RW, "rww": Access.RW} | {access.value: access for access in Access}


class LoadedEds(NamedTuple):
    """A file that was read.

    Attributes:
        dictionary: its objects; the values of a DCF file are in their ``value``.
        warnings: what was mended or left out, each with file and line.
    """

    dictionary: ObjectDictionary
    warnings: tuple[str, ...]


def load_eds(path: Path, node: int | None = None) -> LoadedEds:
    """Read an EDS or DCF file that may be slightly broken.

    Args:
        path: the file.
        node: what ``$NODEID`` stands for; None: the node id in the file.

    Raises:
        ConfigError: it cannot be read, or holds no object.
    """
    text = read_eds_text(path)
    try:
        dictionary = dictionary_of(text, node)
    except ConfigError as error:
        raise ConfigError(f"{path}: {error.message}", remedy=error.remedy) from None
    return LoadedEds(dictionary, text.warnings)


def dictionary_of(text: EdsText, node: int | None = None) -> ObjectDictionary:
    """The object dictionary of a mended file. Raises ConfigError for what mending has not foreseen."""
    try:
        dictionary: ObjectDictionary = import_eds(io.StringIO(text.text()), node)  # type: ignore[no-untyped-call]  # so in the library
    except (configparser.Error, ValueError, KeyError, TypeError) as error:
        raise ConfigError(
            f"the library canopen cannot read the file: {error}", remedy="report it with the file"
        ) from None
    return dictionary


def object_table(dictionary: ObjectDictionary, source: str) -> ObjectTable:
    """A table of this program from an object dictionary; names are made unique by their address."""
    entries = list(_variables(dictionary))
    names = Counter(_name(entry) for entry in entries)
    return ObjectTable(tuple(_definition(entry, names[_name(entry)] > 1, source) for entry in entries))


def _variables(dictionary: ObjectDictionary) -> Iterator[ODVariable]:
    for index in sorted(dictionary):
        entry = dictionary[index]
        if isinstance(entry, ODRecord | ODArray):
            yield from (entry.subindices[sub] for sub in sorted(entry.subindices))
        else:
            yield entry


def _name(entry: ODVariable) -> str:
    own = "_".join(re.findall(r"[a-z0-9]+", entry.name.lower())) or "object"
    if not isinstance(entry.parent, ODRecord | ODArray):
        return own
    parent = "_".join(re.findall(r"[a-z0-9]+", entry.parent.name.lower()))
    return own if own.startswith(parent) else f"{parent}_{own}"


def _definition(entry: ODVariable, ambiguous: bool, source: str) -> ObjectDef:
    name = f"{_name(entry)}_{entry.index:04x}_{entry.subindex}" if ambiguous else _name(entry)
    data_type = _TYPES.get(entry.data_type or 0, DataType.DOMAIN)
    return ObjectDef(
        entry.index,
        entry.subindex,
        name,
        data_type,
        _ACCESS[entry.access_type],
        entry.name,
        default=entry.default if isinstance(entry.default, int | str) else None,
        low=entry.min if data_type.bits else None,
        high=entry.max if data_type.bits else None,
        pdo="mappable" if entry.pdo_mappable else "",
        source=source,
    )
