"""Typed definitions, one per object, error code and bit: read by codec, simulator, command line and docs alike."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from difflib import get_close_matches
from enum import Enum


class DataType(Enum):
    """CANopen data types (CiA 301, 7.4).

    Attributes:
        code: format character of :mod:`struct`, empty or blank for types without a fixed length.
        bits: size, 0 where the length varies.
    """

    U8 = ("B", 8)
    U16 = ("H", 16)
    U32 = ("I", 32)
    U64 = ("Q", 64)
    I8 = ("b", 8)
    I16 = ("h", 16)
    I32 = ("i", 32)
    VISIBLE_STRING = ("", 0)
    DOMAIN = (" ", 0)

    def __init__(self, code: str, bits: int) -> None:
        self.code = code
        self.bits = bits
        self._struct = struct.Struct(f"<{code}" if bits else "")

    def pack(self, value: int | str | bytes) -> bytes:
        """Little-endian bytes of a value. Raises struct.error or TypeError for a value that does not fit."""
        if self.bits:
            return self._struct.pack(value)
        return value.encode("ascii") if isinstance(value, str) else bytes(value)

    def unpack(self, data: bytes) -> int | str | bytes:
        """The value of little-endian bytes. Raises struct.error where the length is wrong."""
        if self.bits:
            number: int = self._struct.unpack(data)[0]
            return number
        return data.decode("latin-1") if self is DataType.VISIBLE_STRING else data


class Access(Enum):
    """Access through SDO."""

    RO = "ro"
    WO = "wo"
    RW = "rw"
    CONST = "const"


@dataclass(frozen=True, slots=True)
class ObjectDef:
    """One entry (index and sub-index) of an object dictionary.

    Attributes:
        name: the field's term in snake_case, unique in its dictionary (``target_velocity``).
        default: value after power-up, before what was stored; None where nothing is documented. For node-dependent
            identifiers the default is the base, and ``plus_node_id`` is set.
        low, high: limits beyond those of the type; None where not stated.
        pdo: ``"rx"``, ``"tx"``, ``"rx-static"``, ``"tx-static"`` or ``""``.
        firmware: ``"2011h"`` for the base firmware, ``"later"`` for objects to be probed before use.
        meaning: what it is and does, one or two sentences.
        cause, cure: for objects whose value tells of trouble: why, and what to do.
        source: document and section.
    """

    index: int
    sub: int
    name: str
    type: DataType
    access: Access
    meaning: str
    default: int | str | None = None
    plus_node_id: bool = False
    unit: str = ""
    low: int | None = None
    high: int | None = None
    pdo: str = ""
    firmware: str = "2011h"
    cause: str = ""
    cure: str = ""
    source: str = ""

    @property
    def address(self) -> str:
        """The object as people write it: ``0x6041`` or ``0x2078/1``."""
        return f"0x{self.index:04X}/{self.sub}" if self.sub else f"0x{self.index:04X}"

    @property
    def mapping(self) -> int:
        """The 32-bit mapping entry of the object (CiA 301: index, sub-index, length in bits)."""
        return self.index << 16 | self.sub << 8 | self.type.bits


@dataclass(frozen=True, slots=True)
class CodeDef:
    """One code with its cause and cure: an EMCY code, an SDO abort code, an NMT state.

    Attributes:
        code: the number.
        name: short name.
        meaning: what it says, one sentence.
        cause: what usually leads to it.
        cure: what to do about it.
        register: error register bits that come with an EMCY code, None where not documented.
        reaction: for faults of a drive ``"D"`` (power stage off at once) or ``"Q"`` (quick-stop ramp, then off).
        source: document and section.
    """

    code: int
    name: str
    meaning: str
    cause: str = ""
    cure: str = ""
    register: int | None = None
    reaction: str = ""
    source: str = ""


@dataclass(frozen=True, slots=True)
class BitDef:
    """One bit of a status or control word.

    Attributes:
        bit: bit number.
        name: short name in snake_case.
        when_set, when_clear: what it says when 1 and when 0.
        modes: mode of operation it holds for (``"1"``, ``"3"``, ``"6"``), empty for all.
    """

    bit: int
    name: str
    when_set: str
    when_clear: str = ""
    modes: str = ""


class ObjectTable:
    """An object dictionary by address and by name.

    Args:
        objects: its entries; names and addresses are unique.
    """

    def __init__(self, objects: tuple[ObjectDef, ...]) -> None:
        self.objects = objects
        self.by_address = {(entry.index, entry.sub): entry for entry in objects}
        self.by_name = {entry.name: entry for entry in objects}
        if not len(objects) == len(self.by_address) == len(self.by_name):
            raise ValueError("an object dictionary holds an address or a name twice")

    def __getitem__(self, name: str) -> ObjectDef:
        return self.by_name[name]

    def at(self, index: int, sub: int) -> ObjectDef | None:
        """The entry at an address, or None."""
        return self.by_address.get((index, sub))

    def find(self, text: str) -> ObjectDef | None:
        """The entry that a person means: a name, ``0x6041``, ``6041h`` or ``0x2078/1``; None where there is none."""
        if text in self.by_name:
            return self.by_name[text]
        address = parse_address(text)
        return self.by_address.get(address) if address else None

    def name_like(self, text: str) -> str | None:
        """The name that comes nearest to one that is misspelt; None where none is near."""
        return next(iter(get_close_matches(text.lower(), self.by_name, 1)), None)


def parse_address(text: str) -> tuple[int, int] | None:
    """Index and sub-index of ``0x2078/1``, ``0x2078:01`` or ``6041h``; None where the text is no address."""
    index_text, _, sub_text = text.replace(":", "/").partition("/")
    if index_text.lower().endswith("h"):
        index_text = "0x" + index_text[:-1]
    try:
        index, sub = int(index_text, 16), int(sub_text or "0", 0 if sub_text.lower().startswith("0x") else 10)
    except ValueError:
        return None
    return (index, sub) if 0 <= index <= 0xFFFF and 0 <= sub <= 0xFF else None
