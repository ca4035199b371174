"""Every reading of a code or an object: statusword, controlword, emergency, SDO abort, NMT byte, error register."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

from drivers.canopen.codes import ERROR_REGISTER_BITS, NMT_COMMANDS, NMT_STATES, SDO_ABORTS, emcy_class
from drivers.canopen.objects import BitDef, CodeDef, ObjectDef, ObjectTable, parse_address
from drivers.encoder.objects import OBJECTS as ENCODER_OBJECTS
from drivers.encoder.objects import POSITION_ERROR
from drivers.epos.codes import EMERGENCIES, GATEWAY_ABORTS
from drivers.epos.objects import OBJECTS as EPOS_OBJECTS
from drivers.epos.state_machine import CONTROLWORD_BITS, STATES, STATUSWORD_BITS, State, command_of, state_of
from drivers.epos.value_tables import VALUE_TABLES

DICTIONARIES: dict[str, ObjectTable] = {"EPOS 24/5": EPOS_OBJECTS, "CiA 406 encoder": ENCODER_OBJECTS}
"""Object dictionaries by the kind of device."""

ABORTS = SDO_ABORTS | GATEWAY_ABORTS

REACTIONS = {
    "D": "the power stage goes off at once, the axis coasts",
    "Q": "quick-stop ramp (0x6085), then the power stage goes off",
}


@dataclass(frozen=True, slots=True)
class Reading:
    """One way to read a code.

    Attributes:
        kind: one of statusword, controlword, emcy, abort, object, frame, nmt, register, serial.
        title: the code with its name.
        meaning: what it says.
        details: what its parts say, by label.
        cause, cure: why it comes up and what to do, where it tells of trouble.
        assumes: what this reading takes for granted (device, mapping).
        source: document and section.
        rank: 0 for the most likely reading.
    """

    kind: str
    title: str
    meaning: str
    details: dict[str, str] = field(default_factory=dict)
    cause: str = ""
    cure: str = ""
    assumes: str = ""
    source: str = ""
    rank: int = 0


# Numbers


def _statusword(value: int, _digits: int, forced: bool) -> Iterator[Reading]:
    if value > 0xFFFF:
        return
    state = state_of(value)
    if state is not None:
        words = STATES[state]
        rank = 70 if state is State.START else 15
        yield Reading(
            kind="statusword",
            title=f"statusword 0x{value:04X}: {words.name}",
            meaning=words.meaning,
            details=bit_words(value, STATUSWORD_BITS),
            cause=words.cause,
            cure=words.cure,
            assumes="EPOS 24/5, object 0x6041",
            source="maxon EPOS Firmware Specification 8.1, 14.1.49",
            rank=rank,
        )
    elif forced:
        yield Reading(
            kind="statusword",
            title=f"statusword 0x{value:04X}: no state",
            meaning="Its bits 0 to 6, 8 and 14 fit no state of the drive.",
            details=bit_words(value, STATUSWORD_BITS),
            cause="It is no statusword, or it comes from another kind of drive.",
            cure="Check the mapping of the PDO it came in, and read 0x6041 by SDO.",
        )


def _controlword(value: int, digits: int, forced: bool) -> Iterator[Reading]:
    if value > (0xFFFF if forced else 0x07FF):
        return
    reserved = value & 0xFE00
    yield Reading(
        kind="controlword",
        title=f"controlword 0x{value:04X}: {command_of(value).words}",
        meaning="The command of a word as the drive takes it from bits 0 to 3 and 7."
        + (" Reserved bits are set: unlikely to be a controlword." if reserved else ""),
        details=bit_words(value, CONTROLWORD_BITS),
        assumes="EPOS 24/5, object 0x6040",
        source="maxon EPOS Firmware Specification 8.1.3",
        rank=60 if reserved else 30,
    )


def _emcy(value: int, _digits: int, forced: bool) -> Iterator[Reading]:
    if value in EMERGENCIES and (value or forced):
        yield code_reading("emcy", f"EMCY 0x{value:04X}", EMERGENCIES[value], rank=10, assumes="EPOS 24/5")
    elif value == POSITION_ERROR or (forced and value <= 0xFFFF):
        yield unknown_emcy(value)


def unknown_emcy(code: int) -> Reading:
    """The reading of an emergency code outside the table of the EPOS, by its class."""
    return Reading(
        kind="emcy",
        title=f"EMCY 0x{code:04X}: {'position error' if code == POSITION_ERROR else emcy_class(code)}",
        meaning=f"An error of the class: {emcy_class(code)}. The EPOS 24/5 has no such code; encoders send 0x5000.",
        cause="An error that is special to the device, or of a kind that came with later firmware.",
        cure="Read error register (0x1001), history (0x1003) and, of an encoder, the alarms (0x6503).",
        assumes="any CANopen device",
        source="CiA 301 7.2.7.1",
        rank=10,
    )


def _abort(value: int, _digits: int, _forced: bool) -> Iterator[Reading]:
    if value in ABORTS:
        yield code_reading("abort", f"SDO abort 0x{value:08X}", ABORTS[value], rank=5)


def _nmt(value: int, digits: int, _forced: bool) -> Iterator[Reading]:
    rank = 25 if digits <= 2 else 45
    if value <= 0xFF and value & 0x7F in NMT_STATES:
        toggle = f", toggle bit {value >> 7}"
        yield code_reading("nmt", f"NMT state byte 0x{value:02X}{toggle}", NMT_STATES[value & 0x7F], rank=rank)
    if value in NMT_COMMANDS:
        yield code_reading("nmt", f"NMT command 0x{value:02X}", NMT_COMMANDS[value], rank=rank)


def _register(value: int, digits: int, _forced: bool) -> Iterator[Reading]:
    if value > 0xFF:
        return
    details = bit_words(value, ERROR_REGISTER_BITS)
    yield Reading(
        kind="register",
        title=f"error register 0x{value:02X}: {register_words(value)}",
        meaning="Kinds of errors that are present." if value else "No error is present.",
        details=details,
        cause="The emergency code tells which error it is." if value else "",
        cure="Read the error history (0x1003) and explain its code." if value else "",
        source="CiA 301 7.5.2.2; maxon EPOS Firmware Specification 14.1.2",
        rank=28 if digits <= 2 else 50,
    )


def register_words(value: int) -> str:
    """The bits of an error register in a line."""
    return ", ".join(bit_words(value, ERROR_REGISTER_BITS).values()) or "no error"


def _mapping_entry(value: int, _digits: int, _forced: bool) -> Iterator[Reading]:
    """A 32-bit mapping entry names an object, too."""
    for device, table in DICTIONARIES.items():
        entry = table.at(value >> 16, value >> 8 & 0xFF)
        if entry is not None and value > 0xFFFF and entry.mapping == value:
            title = f"mapping entry 0x{value:08X}: {entry.name}, {entry.type.bits} bits"
            yield object_reading(entry, device, title)


NUMBER_READERS: dict[str, Callable[[int, int, bool], Iterator[Reading]]] = {
    "statusword": _statusword,
    "controlword": _controlword,
    "emcy": _emcy,
    "abort": _abort,
    "nmt": _nmt,
    "register": _register,
    "object": _mapping_entry,
}
"""By kind: value, count of hexadecimal digits it was written with, whether this kind was asked for -> readings."""


# Objects


def object_readings(text: str) -> Iterator[Reading]:
    found = [(device, find_object(table, text)) for device, table in DICTIONARIES.items()]
    for device, entry in found:
        if entry is not None:
            yield object_reading(entry, device)
    address = parse_address(text)
    if address and not any(entry for _, entry in found) and 0x2000 <= address[0] <= 0x9FFF:
        yield _unlisted(*address)


def find_object(table: ObjectTable, text: str) -> ObjectDef | None:
    """The entry that a person means, forgiving blanks and capitals in names; an index alone means its first."""
    entry = table.find(text) or table.find(re.sub(r"[\s-]+", "_", text.strip().lower()))
    address = parse_address(text)
    if entry is None and address and "/" not in text and ":" not in text:
        entry = next((candidate for candidate in table.objects if candidate.index == address[0]), None)
    return entry


def object_reading(entry: ObjectDef, device: str, title: str = "") -> Reading:
    """An object of a dictionary in words."""
    return Reading(
        kind="object",
        title=title or f"object {entry.address}: {entry.name}",
        meaning=entry.meaning,
        details=object_details(entry),
        cause=entry.cause,
        cure=entry.cure,
        assumes=device + (", later firmware" if entry.firmware == "later" else ""),
        source=entry.source,
        rank=20,
    )


def object_details(entry: ObjectDef) -> dict[str, str]:
    """Type, access, unit, limits and default of an object, those that there are."""
    details = {"type": entry.type.name.lower(), "access": entry.access.value, "unit": entry.unit}
    if entry.low is not None or entry.high is not None:
        details["limits"] = f"{'' if entry.low is None else entry.low} .. {'' if entry.high is None else entry.high}"
    if entry.default is not None:
        details["default"] = value_words(entry, entry.default) + (" + node id" if entry.plus_node_id else "")
    details["pdo"] = entry.pdo
    if entry.name in VALUE_TABLES:
        details["values"] = "; ".join(f"{code}: {words}" for code, words in sorted(VALUE_TABLES[entry.name].items()))
    return {label: words for label, words in details.items() if words}


def value_words(entry: ObjectDef, value: int | str | bytes) -> str:
    """A value of an object for people: with its unit; identifiers, mappings and bit fields in hexadecimal."""
    if not isinstance(value, int):
        return value.hex(" ") if isinstance(value, bytes) else value
    if entry.name in VALUE_TABLES and value in VALUE_TABLES[entry.name]:
        return f"{value} ({VALUE_TABLES[entry.name][value]})"
    if value >= 0 and re.search(r"cob_id|mapping_entry|device_type|error_history|mask|polarity|_state$", entry.name):
        return f"0x{value:X}"
    return f"{value} {entry.unit}" if entry.unit not in ("", "code") else str(value)


def _unlisted(index: int, sub: int) -> Reading:
    area = "of the maker (0x2000 to 0x5FFF)" if index < 0x6000 else "of the device profile (0x6000 to 0x9FFF)"
    return Reading(
        kind="object",
        title=f"object 0x{index:04X}{f'/{sub}' if sub else ''}: in no dictionary",
        meaning=f"It looks like an object in the area {area}, but neither EPOS 24/5 nor encoder has it.",
        cause="It is another kind of code, or an object of another device.",
        cure="Compare with canhelm object list.",
        source="CiA 301 7.4.1",
        rank=80,
    )


# Words


def bit_words(value: int, bits: tuple[BitDef, ...]) -> dict[str, str]:
    """The bits of a word that are set, by ``bit N``, in words; where the mode decides, every meaning with its mode."""
    details: dict[str, str] = {}
    for bit in bits:
        if value >> bit.bit & 1:
            words = f"{bit.when_set} (mode {bit.modes})" if bit.modes else bit.when_set
            label = f"bit {bit.bit}"
            details[label] = f"{details[label]}; {words}" if label in details else words
    return details


def code_reading(kind: str, label: str, code: CodeDef, rank: int, assumes: str = "") -> Reading:
    """A code of a table in words."""
    details = {}
    if code.reaction:
        details["reaction"] = f"class {code.reaction}: {REACTIONS[code.reaction]}"
    if code.register is not None:
        details["error register"] = f"0x{code.register:02X}"
    return Reading(
        kind=kind,
        title=f"{label}: {code.name}",
        meaning=code.meaning,
        details=details,
        cause=code.cause,
        cure=code.cure,
        assumes=assumes,
        source=code.source,
        rank=rank,
    )
