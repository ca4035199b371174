"""Our object tables in the ``canopen`` library: a second opinion for tests."""

from __future__ import annotations

from collections import defaultdict

import canopen
from canopen.objectdictionary import ODRecord, ODVariable, datatypes

from drivers.canopen.objects import DataType, ObjectDef, ObjectTable

PEER_TYPES = {
    DataType.U8: datatypes.UNSIGNED8,
    DataType.U16: datatypes.UNSIGNED16,
    DataType.U32: datatypes.UNSIGNED32,
    DataType.U64: datatypes.UNSIGNED64,
    DataType.I8: datatypes.INTEGER8,
    DataType.I16: datatypes.INTEGER16,
    DataType.I32: datatypes.INTEGER32,
    DataType.VISIBLE_STRING: datatypes.VISIBLE_STRING,
    DataType.DOMAIN: datatypes.DOMAIN,
}


def peer_variable(entry: ObjectDef) -> ODVariable:
    """The same object in the ``canopen`` library."""
    variable = ODVariable(entry.name, entry.index, entry.sub)
    variable.data_type = PEER_TYPES[entry.type]
    return variable


def peer_dictionary(table: ObjectTable) -> canopen.ObjectDictionary:
    """The same object dictionary in the ``canopen`` library."""
    entries = defaultdict(list)
    for entry in table.objects:
        entries[entry.index].append(entry)
    dictionary = canopen.ObjectDictionary()  # type: ignore[no-untyped-call]
    for index, group in entries.items():
        if len(group) == 1 and group[0].sub == 0:
            dictionary.add_object(peer_variable(group[0]))
            continue
        record = ODRecord(f"{group[0].name}_{index:04x}", index)
        for entry in group:
            record.add_member(peer_variable(entry))
        dictionary.add_object(record)
    return dictionary
