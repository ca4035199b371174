"""The datatypes of the CiA 309-3 gateway: SDO values to text and back. Pure; little-endian as on the wire.

``hex`` and ``x8`` to ``x64`` are not in the standard; CANopenNode has them, and its clients use them.
"""

from __future__ import annotations

import base64
import binascii
import math
import re
import struct
from collections.abc import Callable
from dataclasses import dataclass

_NUMBER = re.compile(r"(?P<sign>[+-]?)(?:0[xX](?P<hex>[0-9a-fA-F]+)|(?P<octal>0[0-7]*)|(?P<decimal>[1-9][0-9]*))")
_REAL = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?")
_QUOTED = re.compile(r'"((?:[^"]|"")+)"')
_WORD = re.compile(r'[^" \t]+')


@dataclass(frozen=True, slots=True)
class ValueType:
    """How a value is written in the text.

    Attributes:
        name: the token.
        size: bytes on the wire, 0 where the length varies.
        to_text: the text of bytes of that size; None where they have none in this type.
        from_text: the bytes of a text; None where it is no such value.
    """

    name: str
    size: int
    to_text: Callable[[bytes], str | None]
    from_text: Callable[[str], bytes | None]


def parse_number(text: str) -> int | None:
    """A number as C writes it: decimal, ``0x`` hexadecimal, or octal with a leading 0; None where it is none."""
    found = _NUMBER.fullmatch(text)
    if found is None:
        return None
    size = (
        int(found["hex"], 16) if found["hex"] else int(found["octal"] or found["decimal"], 8 if found["octal"] else 10)
    )
    return -size if found["sign"] == "-" else size


def print_value(data: bytes, datatype: ValueType) -> str:
    """The text of a value that was read; as ``hex`` where it does not fit its datatype."""
    fits = not datatype.size or len(data) == datatype.size
    text = datatype.to_text(data) if fits else None
    return _hex_text(data) if text is None else text


def _integer(name: str, size: int, *, signed: bool = False, as_hex: bool = False) -> ValueType:
    def to_text(data: bytes) -> str:
        value = int.from_bytes(data, "little", signed=signed)
        return f"0x{value:0{2 * size}X}" if as_hex else str(value)

    def from_text(text: str) -> bytes | None:
        value = parse_number(text)
        try:
            return None if value is None else value.to_bytes(size, "little", signed=signed)
        except OverflowError:
            return None

    return ValueType(name, size, to_text, from_text)


def _real(name: str, layout: struct.Struct) -> ValueType:
    def to_text(data: bytes) -> str:
        return f"{layout.unpack(data)[0]:g}"

    def from_text(text: str) -> bytes | None:
        value = float(text) if _REAL.fullmatch(text) else math.inf
        try:
            return layout.pack(value) if math.isfinite(value) else None
        except OverflowError:
            return None

    return ValueType(name, layout.size, to_text, from_text)


def _hex_text(data: bytes) -> str:
    return data.hex(" ").upper()


def _hex_bytes(text: str) -> bytes | None:
    try:
        return bytes.fromhex(text) or None
    except ValueError:
        return None


def _string_text(data: bytes) -> str | None:
    """Zeros that pad the end fall away; a control character would break the line, such a string has no text."""
    text = data.rstrip(b"\0").decode("latin-1")
    return '"' + text.replace('"', '""') + '"' if text.isprintable() else None


def _string_bytes(text: str) -> bytes | None:
    quoted = _QUOTED.fullmatch(text)
    if quoted is not None:
        return quoted[1].replace('""', '"').encode("latin-1")
    return text.encode("latin-1") if _WORD.fullmatch(text) else None


def _base64_text(data: bytes) -> str:
    return base64.b64encode(data).decode("ascii")


def _base64_bytes(text: str) -> bytes | None:
    try:
        return base64.b64decode(text, validate=True) or None
    except (binascii.Error, ValueError):
        return None


HEX = ValueType("hex", 0, _hex_text, _hex_bytes)
"""What a read without a datatype is answered in: pairs of digits in the order of transfer."""

VALUE_TYPES = {
    datatype.name: datatype
    for datatype in (
        HEX,
        _integer("b", 1),
        *(_integer(f"i{8 * size}", size, signed=True) for size in (1, 2, 4, 8)),
        *(_integer(f"u{8 * size}", size) for size in (1, 2, 4, 8)),
        *(_integer(f"x{8 * size}", size, as_hex=True) for size in (1, 2, 4, 8)),
        _real("r32", struct.Struct("<f")),
        _real("r64", struct.Struct("<d")),
        ValueType("vs", 0, _string_text, _string_bytes),
        *(ValueType(name, 0, _base64_text, _base64_bytes) for name in ("os", "us", "d")),
    )
}
