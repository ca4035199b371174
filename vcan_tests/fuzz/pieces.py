"""What is said on a line piece by piece, as a text that people can read: a line of hex digits a piece."""

from __future__ import annotations

from collections.abc import Iterable


def make_pieces(pieces: Iterable[bytes]) -> bytes:
    """Pieces as a text."""
    return "\n".join(piece.hex() for piece in pieces).encode()


def parse_pieces(content: bytes) -> list[bytes]:
    """The pieces of a text; what is no hex digit is passed over."""
    lines = content.decode("ascii", "replace").lower().splitlines()
    digits = ("".join(letter for letter in line if letter in "0123456789abcdef") for line in lines)
    return [bytes.fromhex(line[: len(line) // 2 * 2]) for line in digits]
