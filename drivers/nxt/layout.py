"""How the parameters of an NXT telegram become bytes and back."""

from __future__ import annotations

import dataclasses
import struct
from dataclasses import dataclass
from typing import Any, ClassVar, Final, TypeVar

from drivers.nxt.codes import Kind

NAME_SIZE: Final = 20
"""Bytes of a file name: 15 characters, a dot, 3 characters, a zero."""

T = TypeVar("T", bound="Telegram")


@dataclass(frozen=True, slots=True)
class Telegram:
    """Parameters of a request or a reply.

    The fields stand in the order in which they go over the wire, each laid out as ``LAYOUT`` says (a little-endian
    :mod:`struct`). Enumerations are plain numbers here, so that whatever comes can be shown.
    """

    KIND: ClassVar[Kind] = Kind.DIRECT
    OPCODE: ClassVar[int]
    LAYOUT: ClassVar[str] = ""

    def pack(self) -> bytes:
        """The parameters as bytes.

        Raises:
            ValueError: a value that its field cannot hold.
        """
        values = [getattr(self, field.name) for field in dataclasses.fields(self)]
        try:
            return struct.pack("<" + self.LAYOUT, *(_packed(value) for value in values))
        except struct.error as error:
            raise ValueError(f"{self}: {error}") from None

    @classmethod
    def unpack(cls: type[T], payload: bytes) -> T:
        """The telegram for parameters. Raises ValueError for parameters that are laid out otherwise."""
        try:
            values = struct.unpack("<" + cls.LAYOUT, payload)
        except struct.error:
            size = struct.calcsize("<" + cls.LAYOUT)
            raise ValueError(f"{cls.__name__} has {size} bytes of parameters, not {len(payload)}") from None
        return cls(*(_unpacked(value) for value in values))


def _packed(value: Any) -> Any:
    return value.encode("latin-1", "replace") if isinstance(value, str) else value


def _unpacked(value: Any) -> Any:
    return as_text(value) if isinstance(value, bytes) else value


def as_text(field: bytes) -> str:
    """The text in a field that is padded with zeros."""
    return field.split(b"\0", 1)[0].decode("latin-1")


def require_text(text: str, longest: int) -> None:
    """Raise ValueError for a text that a field cannot hold with its final zero."""
    if len(text) > longest or "\0" in text or any(ord(character) > 0xFF for character in text):
        raise ValueError(f"{text!r} has to be at most {longest} characters of Latin-1")


def require_at_most(data: bytes, longest: int) -> None:
    """Raise ValueError for more bytes than a telegram may carry."""
    if len(data) > longest:
        raise ValueError(f"{len(data)} bytes are too many: {longest} at most")
