"""What a code means on this network: every reading of a statusword, controlword, error code, object or frame."""

from __future__ import annotations

import re
from collections.abc import Iterator

from canhelm.errors import UsageError
from drivers.explain_codes import NUMBER_READERS, Reading, object_readings
from drivers.explain_frame import frame_readings
from drivers.explain_serial import serial_readings

KINDS = ("statusword", "controlword", "emcy", "abort", "object", "frame", "nmt", "register", "serial")

_NUMBER = re.compile(r"(?P<prefix>0x)?(?P<digits>[0-9a-f]{1,10}?)(?P<suffix>h)?", re.IGNORECASE | re.ASCII)
_LONG = re.compile(r"([0-9a-f]{2}){5,}", re.IGNORECASE | re.ASCII)
"""Too many digits for a number."""


def explain(text: str, kind: str | None = None) -> list[Reading]:
    """Every reading of a code, the most likely first.

    Args:
        text: ``0x0337``, ``6320h``, ``33072``, ``0x2078/1``, ``target_velocity``, ``181#3703...``,
            ``10 01 41 60 00 01 AB F0``.
        kind: one of :data:`KINDS` to read it as this and nothing else; then unlikely values are read, too.

    Raises:
        UsageError: the text has no reading, or there is no such kind.
    """
    if kind is not None and kind not in KINDS:
        raise UsageError(f"{kind!r} is no kind of code", value=kind, remedy=f"take one of: {', '.join(KINDS)}")
    text = text.strip()
    readings = [reading for reading in _readings(text, kind) if kind in (None, reading.kind)]
    if not readings:
        what = f"cannot be read as {kind}" if kind else "is no code, object or frame"
        raise UsageError(f"{text!r} {what}", value=text, remedy=_accepted(kind, text))
    return sorted(readings, key=lambda reading: reading.rank)


def _accepted(kind: str | None, text: str) -> str:
    if kind is None and _LONG.fullmatch(text):
        return f"bytes of an RS-232 line are written as serial:{text}"
    if kind == "frame":
        return "give identifier#data as candump writes it, e.g. 181#3703000000000000 or 701#R"
    if kind == "serial":
        return (
            "give the bytes of an RS-232 frame in hexadecimal, e.g. 10 01 41 60 00 01 AB F0 or serial:100141600001ABF0"
        )
    if kind == "object":
        return "give a name or an address, e.g. target_velocity, 0x6041 or 0x2078/1; canhelm object list shows all"
    return "give a number (0x0337, 6320h), an object (0x2078/1, target_velocity) or a frame (181#3703000000000000)"


def _readings(text: str, kind: str | None) -> Iterator[Reading]:
    if "#" in text:
        yield from frame_readings(text)
        return
    yield from serial_readings(text)
    yield from object_readings(text)
    for value, digits in _numbers(text):
        for name, read in NUMBER_READERS.items():
            if kind in (None, name):
                yield from read(value, digits, kind is not None)


def _numbers(text: str) -> Iterator[tuple[int, int]]:
    """The numbers a text may stand for, each with its count of hexadecimal digits: 0x1F, 1Fh, 1F; 31 in both bases."""
    match = _NUMBER.fullmatch(text)
    if match is None:
        return
    digits = match["digits"]
    if len(digits) <= 8:
        yield int(digits, 16), len(digits)
    if not match["prefix"] and not match["suffix"] and digits.isdigit() and 9 < int(digits) <= 0xFFFF_FFFF:
        yield int(digits), len(f"{int(digits):X}")
