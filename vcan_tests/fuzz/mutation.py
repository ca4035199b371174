"""Valid inputs, changed a little: most of what breaks a reader is nearly right."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Sequence
from typing import Any

from hypothesis import strategies as st

MOST_CHANGES = 4
_NUMBERS = """
0 -0 1 -1 2 7 127 128 255 256 65535 65536 2147483648 -2147483649 4294967296 9223372036854775808 1e3 1e-9 1e15 1e17 1e18
1e300 -1e300 1e-300 1e308 1e309 1e999 5e-324 nan NaN .nan inf -inf .inf Infinity 0x 0x0 -0x1 0xFFFFFFFF 1_000 0o17 017
0xFFFFFFFFFFFFFFFFFF 1.2.3 +5 +-5 .5 5. ² ٣ Ⅷ 𝟘
"""
_SYNTAX = """
true false null ~ yes on None [] {} [[]] {a} [[[[[[[[[[[[ {{{{{{{{{{ &a *a !!int !!python/object:os.system !assumed
!!binary | > - : ? , # % ' " \\ \\u0000 .. ../.. / // \U0001f600
"""
_LETTERS = "\ud800\x00\x1b\x7f\x85\xa0\u2028\ufeff\ufffe\t"
_NAMES = "all last off self none front rear front_left rear_left max2d devices/ec40 extends part:1"
WORDS: tuple[str, ...] = (
    *_NUMBERS.split(),
    *_SYNTAX.split(),
    *_LETTERS,
    *_NAMES.split(),
    "",
    " ",
    "a" * 300,
    "9" * 30,
    "9" * 5000,
    "-" + "9" * 400,
    "0." + "0" * 400 + "1",
    "[" * 2000,
    '{"a":' * 2000,
    "x: " * 100,
)
"""What may stand in the place of any word of a text: numbers at their limits, other notations, syntax out of place."""
BYTES: tuple[bytes, ...] = tuple(word.encode("utf-8", "surrogatepass") for word in WORDS)
_SHORT = tuple(word for word in BYTES if len(word) <= 20)
_WORD = re.compile(rb"[^\s,:=\[\]{}()\"'#]+")
Edit = Callable[[st.DrawFn, bytes], bytes]


def damaged(valid: Sequence[bytes]) -> st.SearchStrategy[bytes]:
    """A valid input with some of its bytes changed, lost, doubled or moved."""
    return _changed(valid, (_other_byte, _without, _inserted, _doubled, _spliced(valid)))


def damaged_text(valid: Sequence[bytes]) -> st.SearchStrategy[bytes]:
    """A valid text with some of its words, lines or bytes changed, lost, doubled or moved."""
    lines = (_other_line_order, _line_lost, _line_doubled, _indented)
    return _changed(valid, (_other_word, _other_word, _other_word, *lines, _other_byte, _without, _spliced(valid)))


@st.composite
def _changed(draw: st.DrawFn, valid: Sequence[bytes], edits: Sequence[Edit]) -> bytes:
    content = draw(st.sampled_from(valid))
    for _ in range(draw(st.integers(1, MOST_CHANGES))):
        content = draw(st.sampled_from(edits))(draw, content)
    return content


def _slice(draw: st.DrawFn, size: int) -> tuple[int, int]:
    begin = draw(st.integers(0, size))
    return begin, min(size, begin + draw(st.integers(0, 1 + size // 4)))


def _other_byte(draw: st.DrawFn, content: bytes) -> bytes:
    place = draw(st.integers(0, max(len(content) - 1, 0)))
    return content[:place] + bytes((draw(st.integers(0, 255)),)) + content[place + 1 :]


def _without(draw: st.DrawFn, content: bytes) -> bytes:
    begin, end = _slice(draw, len(content))
    return content[:begin] + content[end:]


def _inserted(draw: st.DrawFn, content: bytes) -> bytes:
    place = draw(st.integers(0, len(content)))
    return content[:place] + draw(st.binary(max_size=8) | st.sampled_from(_SHORT)) + content[place:]


def _doubled(draw: st.DrawFn, content: bytes) -> bytes:
    begin, end = _slice(draw, len(content))
    return content[:end] + content[begin:]


def _spliced(valid: Sequence[bytes]) -> Edit:
    def splice(draw: st.DrawFn, content: bytes) -> bytes:
        other = draw(st.sampled_from(valid))
        return content[: draw(st.integers(0, len(content)))] + other[draw(st.integers(0, len(other))) :]

    return splice


def _other_word(draw: st.DrawFn, content: bytes) -> bytes:
    words = list(_WORD.finditer(content))
    if not words:
        return content + draw(st.sampled_from(BYTES))
    word = draw(st.sampled_from(words))
    return content[: word.start()] + draw(st.sampled_from(BYTES)) + content[word.end() :]


def _of_lines(edit: Callable[[st.DrawFn, list[bytes], int], list[bytes]]) -> Edit:
    def change(draw: st.DrawFn, content: bytes) -> bytes:
        lines = content.split(b"\n")
        return b"\n".join(edit(draw, lines, draw(st.integers(0, len(lines) - 1))))

    return change


_line_lost = _of_lines(lambda _, lines, place: lines[:place] + lines[place + 1 :])
_line_doubled = _of_lines(lambda _, lines, place: lines[: place + 1] + lines[place:])
_other_line_order = _of_lines(lambda _, lines, place: [*lines[place:], *lines[:place]])
_indented = _of_lines(
    lambda draw, lines, place: [
        *lines[:place],
        draw(st.sampled_from((b" ", b"  ", b"\t", b"- "))) + lines[place],
        *lines[place + 1 :],
    ]
)

SCALARS: st.SearchStrategy[Any] = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(-3, 300),
    st.sampled_from((2**31, 2**53, 2**63 - 1, -(2**63), 2**64, 10**30, 1e15, 1e16, 9.9e14, -1e15, 1e-300, -0.0)),
    st.floats(),
    st.sampled_from(WORDS),
    st.text(max_size=20),
)
VALUES: st.SearchStrategy[Any] = st.recursive(
    SCALARS,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=6), inner, max_size=3),
    max_leaves=6,
)


@st.composite
def damaged_value(draw: st.DrawFn, value: Any) -> Any:
    """A value as JSON has them with one part of it replaced, lost or added."""
    if isinstance(value, dict) and value and draw(st.integers(0, 9)):
        key = draw(st.sampled_from(sorted(value)))
        rest = {name: item for name, item in value.items() if name != key}
        kept = draw(st.sampled_from(("inside", "inside", "inside", "lost", "renamed")))
        if kept == "inside":
            return {**value, key: draw(damaged_value(value[key]))}
        return rest if kept == "lost" else {**rest, draw(st.text(max_size=8)): value[key]}
    if isinstance(value, list) and value and draw(st.integers(0, 9)):
        place = draw(st.integers(0, len(value) - 1))
        return [*value[:place], draw(damaged_value(value[place])), *value[place + draw(st.integers(0, 1)) :]]
    return draw(VALUES)


def as_json(value: Any) -> bytes:
    """A value as a program writes it that does not know which numbers JSON lacks."""
    return json.dumps(value).encode()
