"""Writes EDS and DCF files (CiA 306) of an object table: what a device has, and how one device is set."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from itertools import groupby

from drivers.canopen.eds_text import RECORD, VAR, Address
from drivers.canopen.objects import DataType, ObjectDef

BIT_RATES_KBIT = (10, 20, 50, 125, 250, 500, 800, 1000)
"""Bit rates that CiA 306 has a line for."""
TYPE_CODES = {
    DataType.I8: 0x2, DataType.I16: 0x3, DataType.I32: 0x4,
    DataType.U8: 0x5, DataType.U16: 0x6, DataType.U32: 0x7, DataType.U64: 0x1B,
    DataType.VISIBLE_STRING: 0x9, DataType.DOMAIN: 0xF,
}  # fmt: skip
"""Data types by their index (CiA 301 7.4.7.1)."""
_MANDATORY = (0x1000, 0x1001, 0x1018)


@dataclass(frozen=True, slots=True)
class DeviceKind:
    """What a file says about a kind of device.

    Attributes:
        bit_rates: that it can be set to, bit/s.
    """

    vendor: str
    vendor_number: int
    product: str
    product_number: int
    bit_rates: frozenset[int]
    receive_pdos: int
    transmit_pdos: int
    lss: bool = False

    def with_product(self, number: int) -> DeviceKind:
        """The same kind, of a certain hardware and firmware."""
        return replace(self, product_number=number)


@dataclass(frozen=True, slots=True)
class Commissioning:
    """Which node a DCF file is of."""

    node: int
    name: str
    bit_rate: int


def make_eds(objects: Iterable[ObjectDef], device: DeviceKind) -> str:
    """An EDS file: what a device of this kind has."""
    return _file(list(objects), device, None, {})


def make_dcf(
    objects: Iterable[ObjectDef], device: DeviceKind, commissioning: Commissioning, values: Mapping[Address, int]
) -> str:
    """A DCF file: how one device is set.

    Args:
        objects: the entries to write.
        device: its kind.
        commissioning: which node it is.
        values: by index and sub-index. An identifier that holds the node id is written as ``$NODEID+...``, so that the
            file fits another node, too.
    """
    return _file(list(objects), device, commissioning, values)


def _file(
    objects: list[ObjectDef], device: DeviceKind, commissioning: Commissioning | None, values: Mapping[Address, int]
) -> str:
    node = commissioning.node if commissioning else None
    sections = [_section("FileInfo", _file_info(device)), _section("DeviceInfo", _device_info(device))]
    if commissioning:
        sections.append(_section("DeviceComissioning", _commissioning(commissioning)))
    sections += [_section("DummyUsage", {f"Dummy{number:04d}": 0 for number in range(1, 8)})]
    sections += [_section("Comments", {"Lines": 0}), *_lists(objects)]
    for index, group in groupby(objects, key=lambda entry: entry.index):
        sections += _object(index, list(group), values, node)
    return "\n".join(sections)


def _section(name: str, values: Mapping[str, object]) -> str:
    return "\n".join([f"[{name}]", *(f"{key}={value}" for key, value in values.items()), ""])


def _file_info(device: DeviceKind) -> dict[str, object]:
    return {
        "FileVersion": 1,
        "FileRevision": 0,
        "EDSVersion": "4.0",
        "Description": device.product,
        "CreatedBy": "canhelm",
    }


def _device_info(device: DeviceKind) -> dict[str, object]:
    rates = {f"BaudRate_{kbit}": int(kbit * 1000 in device.bit_rates) for kbit in BIT_RATES_KBIT}
    return {
        "VendorName": device.vendor,
        "VendorNumber": f"0x{device.vendor_number:X}",
        "ProductName": device.product,
        "ProductNumber": f"0x{device.product_number:08X}",
        **rates,
        "SimpleBootUpMaster": 0,
        "SimpleBootUpSlave": 1,
        "Granularity": 8,
        "DynamicChannelsSupported": 0,
        "GroupMessaging": 0,
        "NrOfRXPDO": device.receive_pdos,
        "NrOfTXPDO": device.transmit_pdos,
        "LSS_Supported": int(device.lss),
    }


def _commissioning(commissioning: Commissioning) -> dict[str, object]:
    return {
        "NodeID": commissioning.node,
        "NodeName": commissioning.name,
        "Baudrate": commissioning.bit_rate // 1000,
        "CANopenManager": 0,
    }


def _lists(objects: list[ObjectDef]) -> list[str]:
    indices = sorted({entry.index for entry in objects})
    mandatory = [index for index in indices if index in _MANDATORY]
    maker = [index for index in indices if 0x2000 <= index < 0x6000]
    optional = [index for index in indices if index not in mandatory and index not in maker]
    return [
        _list("MandatoryObjects", mandatory),
        _list("OptionalObjects", optional),
        _list("ManufacturerObjects", maker),
    ]


def _list(name: str, indices: list[int]) -> str:
    numbered = {str(place): f"0x{index:04X}" for place, index in enumerate(indices, 1)}
    return _section(name, {"SupportedObjects": len(indices), **numbered})


def _object(index: int, entries: list[ObjectDef], values: Mapping[Address, int], node: int | None) -> list[str]:
    if [entry.sub for entry in entries] == [0]:
        return [_section(f"{index:04X}", _variable(entries[0], values, node))]
    name = entries[0].name.removesuffix("_highest_sub_index")
    if name == entries[0].name:
        name = f"object_{index:04X}"
    record = {"ParameterName": name, "ObjectType": f"0x{RECORD:X}", "SubNumber": len(entries)}
    subs = (_section(f"{index:04X}sub{entry.sub:X}", _variable(entry, values, node)) for entry in entries)
    return [_section(f"{index:04X}", record), *subs]


def _variable(entry: ObjectDef, values: Mapping[Address, int], node: int | None) -> dict[str, object]:
    fields: dict[str, object] = {
        "ParameterName": entry.name,
        "ObjectType": f"0x{VAR:X}",
        "DataType": f"0x{TYPE_CODES[entry.type]:04X}",
        "AccessType": entry.access.value,
        "PDOMapping": int(entry.pdo != ""),
    }
    limits = {"LowLimit": entry.low, "HighLimit": entry.high, "DefaultValue": _default(entry)}
    fields |= {key: value for key, value in limits.items() if value is not None}
    if (entry.index, entry.sub) in values:
        fields["ParameterValue"] = _value(entry, values[entry.index, entry.sub], node)
    return fields


def _default(entry: ObjectDef) -> object:
    return f"$NODEID+0x{entry.default:X}" if entry.plus_node_id else entry.default


def _value(entry: ObjectDef, value: int, node: int | None) -> object:
    if node is not None and "cob_id" in entry.name and value & 0x7F == node and value < 0x800:
        return f"$NODEID+0x{value - node:X}"
    return value
