"""What the page has to know of devices beyond their state: the objects they have, and what a code means."""

from __future__ import annotations

from typing import Any

from canhelm.errors import UsageError
from drivers.canopen.objects import ObjectDef, ObjectTable
from drivers.encoder.objects import OBJECTS as ENCODER_OBJECTS
from drivers.epos.objects import OBJECTS as EPOS_OBJECTS
from drivers.explain import explain
from drivers.explain_codes import Reading

TABLES: dict[str, ObjectTable] = {"epos24_5": EPOS_OBJECTS, "cia406": ENCODER_OBJECTS}
"""Object dictionaries by what ``status`` calls the device."""


def device_objects(device: str) -> dict[str, Any]:
    """The objects of a kind of device, for ``station.objects``.

    Args:
        device: as ``status`` tells it of a node (``epos24_5``).

    Returns:
        ``objects``: of each its address, name, type, access, limits, unit, meaning, and cause and cure of trouble.

    Raises:
        UsageError: devices of this kind have no object dictionary.
    """
    table = TABLES.get(device)
    if table is None:
        known = ", ".join(TABLES)
        raise UsageError(f"{device} has no object dictionary", object="device", value=device, remedy=f"give {known}")
    return {"objects": [_told(entry) for entry in table.objects]}


def _told(entry: ObjectDef) -> dict[str, Any]:
    return {
        "object": entry.address,
        "index": entry.index,
        "subindex": entry.sub,
        "name": entry.name,
        "type": entry.type.name.lower(),
        "access": entry.access.value,
        "unit": entry.unit,
        "low": entry.low,
        "high": entry.high,
        "firmware": entry.firmware,
        "meaning": entry.meaning,
        "cause": entry.cause,
        "cure": entry.cure,
    }


def code_readings(code: str, kind: str) -> dict[str, Any]:
    """What a code means, for ``station.explain``.

    Args:
        code: as people write it (``0x1140``).
        kind: what it is: ``statusword``, ``emcy``, ``abort``, or another kind of ``canhelm explain``.

    Returns:
        ``readings``: of each its title, meaning, details by label, cause and cure.

    Raises:
        UsageError: it is no such code.
    """
    return {"readings": [_read(reading) for reading in explain(code, kind)]}


def _read(reading: Reading) -> dict[str, Any]:
    return {
        "title": reading.title,
        "meaning": reading.meaning,
        "details": reading.details,
        "cause": reading.cause,
        "cure": reading.cure,
    }
