"""Process data (CiA 301 7.2.2, 7.5.2.35 to 7.5.2.38): what is mapped, how it is packed, how it is written to a node."""

from __future__ import annotations

import struct
from collections.abc import Sequence

from drivers.canopen.objects import ObjectDef, ObjectTable

ON_SYNC = 1
"""Transmission type: received values count at the next SYNC; values are sent after each SYNC."""
AT_ONCE = 255
"""Transmission type: received values count at once."""

_RPDO_COMMUNICATION, _RPDO_MAPPING, _RPDO_COB_ID = 0x1400, 0x1600, 0x200
_TPDO_COMMUNICATION, _TPDO_MAPPING, _TPDO_COB_ID = 0x1800, 0x1A00, 0x180

Settings = list[tuple[ObjectDef, int]]
"""Objects and the values to write to them, in the order of writing."""


def rpdo_cob_id(number: int, node: int) -> int:
    """COB-ID of a node's receive PDO 1 to 4 in the predefined connection set (CiA 301 7.3.3)."""
    return _RPDO_COB_ID + 0x100 * (number - 1) + node


def tpdo_cob_id(number: int, node: int) -> int:
    """COB-ID of a node's transmit PDO 1 to 4 in the predefined connection set (CiA 301 7.3.3)."""
    return _TPDO_COB_ID + 0x100 * (number - 1) + node


def pdo_struct(mapping: Sequence[ObjectDef]) -> struct.Struct:
    """The packed form of a mapping. Raises ValueError where it is longer than 64 bits."""
    packed = struct.Struct("<" + "".join(entry.type.code for entry in mapping))
    if packed.size > 8:
        raise ValueError(f"a PDO holds 8 bytes, not {packed.size}")
    return packed


def rpdo_settings(
    table: ObjectTable, number: int, node: int, transmission: int, mapping: Sequence[ObjectDef] | None = None
) -> Settings:
    """What to write to give a node its own receive PDO.

    Args:
        table: the node's object dictionary.
        number: 1 to 4.
        node: node id, for the COB-ID.
        transmission: transmission type.
        mapping: objects to map, first one first; None leaves the mapping as it is.
    """
    cob_id = rpdo_cob_id(number, node)
    return _settings(table, _RPDO_COMMUNICATION, _RPDO_MAPPING, number, (cob_id, transmission), mapping)


def tpdo_settings(
    table: ObjectTable, number: int, node: int, transmission: int, mapping: Sequence[ObjectDef] | None = None
) -> Settings:
    """What to write to give a node its own transmit PDO; arguments as for :func:`rpdo_settings`."""
    cob_id = tpdo_cob_id(number, node)
    return _settings(table, _TPDO_COMMUNICATION, _TPDO_MAPPING, number, (cob_id, transmission), mapping)


def _settings(
    table: ObjectTable,
    communication: int,
    mapping_index: int,
    number: int,
    communication_values: tuple[int, int],
    mapping: Sequence[ObjectDef] | None,
) -> Settings:
    communication, mapping_index = communication + number - 1, mapping_index + number - 1
    by_address = table.by_address
    settings = [(by_address[communication, sub], value) for sub, value in enumerate(communication_values, 1)]
    if mapping is not None:
        count = by_address[mapping_index, 0]
        entries = [(by_address[mapping_index, sub], entry.mapping) for sub, entry in enumerate(mapping, 1)]
        settings += [(count, 0), *entries, (count, len(mapping))]
    return settings
