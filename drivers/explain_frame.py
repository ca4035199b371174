"""Every reading of a CAN frame: what its identifier stands for, which node, and what its bytes say."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial

from drivers.canopen.codes import NMT_COMMANDS, NMT_STATES
from drivers.canopen.objects import ObjectDef, ObjectTable
from drivers.encoder.objects import OBJECTS as ENCODER_OBJECTS
from drivers.epos.codec import RPDO1_MAPS, TPDO1_MAP, TPDO2_MAP
from drivers.epos.codes import EMERGENCIES
from drivers.epos.objects import OBJECTS as EPOS_OBJECTS
from drivers.epos.state_machine import STATES, Mode, command_of, state_of
from drivers.explain_codes import ABORTS, DICTIONARIES, Reading, code_reading, register_words, unknown_emcy, value_words
from drivers.explain_services import block_reader, lss_reading

_SdoReader = Callable[[str, bytes], Iterator[Reading]]
"""Title and the 8 bytes of an SDO frame -> readings."""

_FRAME = re.compile(r"(?P<id>[0-9A-F]{1,8})#((?P<remote>R[0-8]?)|(?P<data>([0-9A-F]{2}){0,8}))(\.\.\.|…)?", re.I | re.A)
"""``181#3703`` or ``701#R`` as candump writes them; dots for what was left out."""


@dataclass(frozen=True, slots=True)
class PdoMap:
    """What a PDO carries, and where this holds.

    Attributes:
        assumes: device and who set the mapping.
        objects: its objects in the order of their bytes.
    """

    assumes: str
    objects: tuple[ObjectDef, ...]

    @property
    def size(self) -> int:
        """Bytes of the PDO."""
        return sum(entry.type.bits for entry in self.objects) // 8


def _map(assumes: str, table: ObjectTable, *names: str) -> PdoMap:
    return PdoMap(assumes, tuple(table[name] for name in names))


_OURS = "EPOS 24/5 with canhelm's mapping"
_FACTORY = "EPOS 24/5 with the factory mapping"
_ENCODER = "CiA 406 encoder"

PDO_MAPS: dict[str, tuple[PdoMap, ...]] = {
    "TPDO1": (
        PdoMap(_OURS, TPDO1_MAP),
        _map(_ENCODER, ENCODER_OBJECTS, "position_value"),
        _map(_FACTORY, EPOS_OBJECTS, "velocity_actual_value", "position_actual_value"),
    ),
    "TPDO2": (
        PdoMap(_OURS, TPDO2_MAP),
        _map(_ENCODER, ENCODER_OBJECTS, "position_value"),
        _map(_FACTORY, EPOS_OBJECTS, "current_actual_value", "analog_input_1", "analog_input_2"),
        _map(_FACTORY + ", two objects counted", EPOS_OBJECTS, "current_actual_value", "analog_input_1"),
    ),
    "TPDO3": (_map("EPOS 24/5, fixed mapping", EPOS_OBJECTS, "statusword", "mode_of_operation_display"),),
    "RPDO1": (
        *(PdoMap(f"{_OURS} in {mode.words} mode", objects) for mode, objects in RPDO1_MAPS.items()),
        _map(_FACTORY, EPOS_OBJECTS, "velocity_mode_setting_value"),
    ),
    "RPDO2": (_map(_FACTORY, EPOS_OBJECTS, "controlword", "target_velocity"),),
    "RPDO3": (_map("EPOS 24/5, fixed mapping", EPOS_OBJECTS, "controlword", "mode_of_operation"),),
    "TPDO4": (_map("EPOS 24/5, later firmware", EPOS_OBJECTS, "statusword", "velocity_actual_value"),),
    "RPDO4": (_map("EPOS 24/5, later firmware", EPOS_OBJECTS, "controlword", "target_velocity"),),
}
"""Mappings by PDO, the likeliest first."""

_WORDS: dict[str, Callable[[int], str]] = {
    "statusword": lambda word: f"0x{word:04X} ({state.words if (state := state_of(word)) else 'no state'})",
    "controlword": lambda word: f"0x{word:04X} ({command_of(word).words})",
    "mode_of_operation": lambda mode: _mode_words(mode),
    "mode_of_operation_display": lambda mode: _mode_words(mode),
    "error_register": lambda value: f"0x{value:02X} ({register_words(value)})",
}


def _mode_words(mode: int) -> str:
    return f"{mode} ({Mode(mode).words})" if mode in set(Mode) else f"{mode} (no such mode)"


def frame_readings(text: str) -> Iterator[Reading]:
    """Readings of ``181#3703...``, ``701#R`` or a whole line of a candump log; nothing where the text is no frame."""
    match = _FRAME.fullmatch(text.split()[-1])
    if match is None:
        return
    can_id = int(match["id"], 16)
    if len(match["id"]) > 3 or can_id > 0x7FF:
        yield Reading("frame", f"identifier 0x{can_id:X}", "More than 11 bits: no identifier of this network.")
        return
    data = bytes.fromhex(match["data"] or "")
    readings = _remote_frame(can_id) if match["remote"] else _data_frame(can_id, data)
    yield from (replace(reading, rank=rank) for rank, reading in enumerate(readings))


def _data_frame(can_id: int, data: bytes) -> Iterator[Reading]:
    """By identifier: the broadcasts, then the function in the upper four bits and the node in the lower seven."""
    node = can_id & 0x7F
    if can_id in _BROADCASTS:
        yield _BROADCASTS[can_id](data)
    elif node and can_id & 0x780 in _PDO_NAMES:
        yield from _pdo(_PDO_NAMES[can_id & 0x780], node, data)
    elif node and can_id & 0x780 in _SERVICES:
        yield from _SERVICES[can_id & 0x780](node, data)
    else:
        yield _unassigned(can_id)


def _remote_frame(can_id: int) -> Iterator[Reading]:
    node, function = can_id & 0x7F, can_id & 0x780
    if node and function == 0x700:
        meaning = "The master asks for the node's state and shows that it is alive."
        yield Reading("frame", f"guard request to node {node}", meaning, source="CiA 301 7.2.8.2.2.1")
    elif node and _PDO_NAMES.get(function, "").startswith("T"):
        meaning = "Asks the node to send this PDO; transmission type 255 of firmware 2011h sends in no other way."
        yield Reading("frame", f"request of {_PDO_NAMES[function]} of node {node}", meaning, source="CiA 301 7.2.2")
    else:
        yield Reading("frame", f"remote frame 0x{can_id:03X}", "CANopen has no remote request with this identifier.")


def _unassigned(can_id: int) -> Reading:
    meaning = "The predefined connection set of CANopen gives it no function; a PDO may have been moved here."
    cure = "Read the PDO identifiers of the nodes (0x14nn/1, 0x18nn/1)."
    return Reading("frame", f"identifier 0x{can_id:03X}", meaning, cure=cure, source="CiA 301 7.3.3")


def _nmt_command(data: bytes) -> Reading:
    command = NMT_COMMANDS.get(data[0]) if len(data) == 2 and data[1] <= 127 else None
    if command is None:
        return Reading("frame", "NMT, malformed", "An NMT frame has a known command byte and a node id, 0 for all.")
    target = f"node {data[1]}" if data[1] else "all nodes"
    return Reading("frame", f"NMT to {target}: {command.name}", command.meaning, source=command.source)


def _sync(_data: bytes) -> Reading:
    meaning = "All PDOs of transmission type 1 are taken over and sent now."
    return Reading("frame", "SYNC", meaning, source="CiA 301 7.2.5")


def _time_stamp(_data: bytes) -> Reading:
    return Reading("frame", "time stamp", "Time of day; the EPOS 24/5 does not use it.", source="CiA 301 7.2.6")


# Process data


def _pdo(name: str, node: int, data: bytes) -> Iterator[Reading]:
    """One reading for each mapping of this length; a frame cut short is read as far as it goes."""
    maps = PDO_MAPS.get(name, ())
    fitting = [pdo for pdo in maps if pdo.size == len(data)]
    fitting = fitting or [pdo for pdo in maps if pdo.objects[0].type.bits <= 8 * len(data) < 8 * pdo.size]
    for pdo in fitting:
        yield _mapped(pdo, name, node, data)
    if not fitting:
        meaning = f"{len(data)} bytes fit no mapping that canhelm or the factory sets."
        cure = "Read the mapping of the PDO from the node (0x16nn, 0x1Ann)."
        yield Reading("frame", f"{name} of node {node}", meaning, {"data": data.hex(" ")}, cure=cure)


def _mapped(pdo: PdoMap, name: str, node: int, data: bytes) -> Reading:
    details, offset = {}, 0
    for entry in pdo.objects:
        part = data[offset : offset + entry.type.bits // 8]
        offset += entry.type.bits // 8
        if offset <= len(data):
            details[f"{entry.name} ({entry.address})"] = object_words(entry, part)
    sender = "from" if name.startswith("T") else "to"
    cut = f", cut short: {len(data)} of {pdo.size} bytes" if len(data) < pdo.size else ""
    meaning = f"Process data {sender} the node{cut}."
    cause, cure = _trouble(pdo, data)
    return Reading("frame", f"{name} of node {node}", meaning, details, cause, cure, pdo.assumes)


def _trouble(pdo: PdoMap, data: bytes) -> tuple[str, str]:
    """Cause and cure of the state that a PDO with a statusword in front tells of."""
    state = state_of(int.from_bytes(data[:2], "little")) if pdo.objects[0].name == "statusword" else None
    return (STATES[state].cause, STATES[state].cure) if state is not None else ("", "")


def object_words(entry: ObjectDef, data: bytes) -> str:
    """The value of an object's bytes for people; the bytes where they do not fit the object."""
    if entry.type.bits != len(data) * 8 and entry.type.bits:
        return f"{data.hex(' ')} ({len(data)} bytes; the object has {entry.type.bits // 8})"
    value = entry.type.unpack(data)
    if isinstance(value, int) and entry.name in _WORDS:
        return _WORDS[entry.name](value)
    return repr(value) if isinstance(value, str) else value_words(entry, value)


# Emergencies and error control


def _emergency(node: int, data: bytes) -> Iterator[Reading]:
    if len(data) < 3:
        yield Reading("frame", f"EMCY of node {node}, malformed", "An emergency has 8 bytes: code, register, details.")
        return
    code = int.from_bytes(data[:2], "little")
    if code in EMERGENCIES:
        reading = code_reading("frame", f"EMCY of node {node}, 0x{code:04X}", EMERGENCIES[code], rank=0)
    else:
        reading = unknown_emcy(code)
        reading = replace(reading, kind="frame", title=f"EMCY of node {node}, {reading.title.removeprefix('EMCY ')}")
    details = reading.details | {"error register": f"0x{data[2]:02X} ({register_words(data[2])})"}
    if any(data[3:]):
        details["maker's bytes"] = data[3:].hex(" ")
    yield replace(reading, details=details, assumes="EPOS 24/5" if code in EMERGENCIES else reading.assumes)


def _error_control(node: int, data: bytes) -> Iterator[Reading]:
    state = NMT_STATES.get(data[0] & 0x7F) if len(data) == 1 else None
    if state is None:
        yield Reading("frame", f"error control of node {node}, malformed", "It has one byte with a known NMT state.")
        return
    title = f"boot-up of node {node}" if data[0] == 0 else f"state of node {node}: {state.name}"
    details = {} if data[0] == 0 else {"toggle bit": f"{data[0] >> 7}; alternates from one guard answer to the next"}
    assumes = "" if data[0] == 0 else "guard answer; of a node with heartbeat: heartbeat"
    yield Reading("frame", title, state.meaning, details, state.cause, state.cure, assumes, state.source)


# Service data


def _sdo(
    sender: str, services: dict[int, _SdoReader], otherwise: _SdoReader
) -> Callable[[int, bytes], Iterator[Reading]]:
    def read(node: int, data: bytes) -> Iterator[Reading]:
        title = f"SDO {sender} node {node}"
        if len(data) != 8:
            yield Reading("frame", f"{title}, malformed", f"An SDO frame has 8 bytes, not {len(data)}.")
        else:
            yield from services.get(data[0] >> 5, otherwise)(title, data)

    return read


def objects_at(index: int, sub: int) -> list[tuple[str, ObjectDef | None, str]]:
    """Name with address, object and device for each dictionary that has this object; alike ones once."""
    found: dict[str, tuple[str, ObjectDef | None, str]] = {}
    for device, table in DICTIONARIES.items():
        entry = table.at(index, sub)
        if entry is not None:
            found.setdefault(f"{entry.name} {entry.type}", (f"{entry.name} ({entry.address})", entry, device))
    return list(found.values()) or [(f"0x{index:04X}/{sub} (in no dictionary)", None, "")]


def _objects_of(data: bytes) -> list[tuple[str, ObjectDef | None, str]]:
    """The objects that the multiplexer of an SDO frame may mean."""
    return objects_at(int.from_bytes(data[1:3], "little"), data[3])


def _with_object(action: str, show_value: bool) -> _SdoReader:
    """A reader of a frame with multiplexer, and with an expedited value or a length where ``show_value`` says so."""

    def read(title: str, data: bytes) -> Iterator[Reading]:
        for name, entry, device in _objects_of(data):
            details = _expedited(entry, data) if show_value else {}
            meaning = entry.meaning if entry else "An object that neither EPOS 24/5 nor encoder has."
            source = "CiA 301 7.2.4.3"
            yield Reading("frame", f"{title}: {action} {name}", meaning, details, assumes=device, source=source)

    return read


def _expedited(entry: ObjectDef | None, data: bytes) -> dict[str, str]:
    if not data[0] & 0x02:
        return {"length": f"{int.from_bytes(data[4:], 'little')} bytes, in segments that follow"}
    size = 4 - (data[0] >> 2 & 3) if data[0] & 0x01 else (entry.type.bits // 8 if entry and entry.type.bits else 4)
    value = data[4 : 4 + size]
    return {"value": object_words(entry, value) if entry else value.hex(" ")}


def _segment(action: str, carries_data: bool) -> _SdoReader:
    def read(title: str, data: bytes) -> Iterator[Reading]:
        details = {"toggle bit": str(data[0] >> 4 & 1)}
        if carries_data:
            details["data"] = repr(data[1 : 8 - (data[0] >> 1 & 7)])[1:]
            details["last segment"] = "yes" if data[0] & 1 else "no"
        meaning = "Part of a segmented transfer; its object stands in the frame that began it."
        yield Reading("frame", f"{title}: {action}", meaning, details, source="CiA 301 7.2.4.3")

    return read


def _abort(title: str, data: bytes) -> Iterator[Reading]:
    code = int.from_bytes(data[4:], "little")
    for name, _, device in _objects_of(data):
        label = f"{title}: abort 0x{code:08X} at {name}"
        if code in ABORTS:
            yield code_reading("frame", label, ABORTS[code], rank=0, assumes=device)
        else:
            meaning = "The transfer was aborted with a code that is in no table."
            yield Reading("frame", label, meaning, cure="Look the code up in the device's manual.", assumes=device)


_SDO_REQUESTS: dict[int, _SdoReader] = {
    0: _segment("write segment", carries_data=True),
    1: _with_object("write", show_value=True),
    2: _with_object("read", show_value=False),
    3: _segment("read next segment", carries_data=False),
    4: _abort,
}
_SDO_ANSWERS: dict[int, _SdoReader] = {
    0: _segment("segment", carries_data=True),
    1: _segment("segment written", carries_data=False),
    2: _with_object("value of", show_value=True),
    3: _with_object("written:", show_value=False),
    4: _abort,
}
"""Readers by command specifier, the upper three bits of the first byte."""

_BROADCASTS: dict[int, Callable[[bytes], Reading]] = {
    0x000: _nmt_command,
    0x080: _sync,
    0x100: _time_stamp,
    0x7E4: partial(lss_reading, 0x7E4),
    0x7E5: partial(lss_reading, 0x7E5),
}
_PDO_NAMES = {
    **{0x080 + 0x100 * number: f"TPDO{number}" for number in (1, 2, 3, 4)},
    **{0x100 + 0x100 * number: f"RPDO{number}" for number in (1, 2, 3, 4)},
}
_SERVICES: dict[int, Callable[[int, bytes], Iterator[Reading]]] = {
    0x080: _emergency,
    0x580: _sdo("answer of", _SDO_ANSWERS, block_reader(answer=True)),
    0x600: _sdo("request to", _SDO_REQUESTS, block_reader(answer=False)),
    0x700: _error_control,
}
