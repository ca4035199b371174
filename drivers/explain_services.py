"""Frames of the layer setting service (CiA 305) and of SDO block transfers (CiA 301 7.2.4.3) in words."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator

from drivers.canopen.lss import ANSWER_COB_ID, BIT_TIMINGS, UNCONFIGURED, Identity, LssCommand
from drivers.explain_codes import Reading

_PARTS = Identity._fields
_BIT_RATES = {index: rate for rate, index in BIT_TIMINGS.items()}
_CONFIRMED = {
    0: "done",
    1: "refused: value not supported",
    2: "failed: the device cannot keep it",
    0xFF: "maker's error",
}
_NOTE = "The EPOS 24/5 does not take part."


def lss_reading(can_id: int, data: bytes) -> Reading:
    """The reading of a frame with the identifier of the LSS master or of its slaves."""
    sender = "answer" if can_id == ANSWER_COB_ID else "request"
    if len(data) != 8:
        return Reading("frame", f"LSS {sender}, malformed", f"It has 8 bytes, not {len(data)}.", source="CiA 305")
    number = int.from_bytes(data[1:5], "little")
    words = _lss_answer(data, number) if sender == "answer" else _lss_request(data, number)
    if words is None:
        return Reading("frame", f"LSS {sender} 0x{data[0]:02X}", "No such service is known.", source="CiA 305")
    return Reading("frame", f"LSS {sender}: {words}", f"Layer setting service. {_NOTE}", source="CiA 305")


def _lss_request(data: bytes, number: int) -> str | None:
    command = data[0]
    for first, action in ((LssCommand.SELECT, "select the device with"), (LssCommand.INQUIRE, "tell your")):
        if first <= command < first + len(_PARTS):
            value = f" 0x{number:X}" if first is LssCommand.SELECT else ""
            return f"{action} {_PARTS[command - first]} number{value}"
    rate = _BIT_RATES.get(data[2])
    requests = {
        LssCommand.SWITCH_GLOBAL: f"all devices into {'configuration' if data[1] else 'waiting'}",
        LssCommand.SET_NODE_ID: "take no node id" if data[1] == UNCONFIGURED else f"take node id {data[1]}",
        LssCommand.SET_BIT_TIMING: f"take {rate} bit/s" if rate and not data[1] else f"take bit timing {data[2]}",
        LssCommand.ACTIVATE_BIT_TIMING: f"change the bit rate after {number & 0xFFFF} ms",
        LssCommand.STORE: "keep node id and bit rate",
        LssCommand.INQUIRE_NODE_ID: "tell your node id",
        LssCommand.FAST_SCAN: _fast_scan(data, number),
    }
    return {int(known): words for known, words in requests.items()}.get(command)


def _fast_scan(data: bytes, number: int) -> str:
    if data[5] >= 32:
        return "fast scan: is any device without a node id there?"
    return f"fast scan: is there a {_PARTS[data[6] & 3]} number 0x{number:X}, compared down to bit {data[5]}?"


def _lss_answer(data: bytes, number: int) -> str | None:
    command = data[0]
    if LssCommand.INQUIRE <= command < LssCommand.INQUIRE + len(_PARTS):
        return f"{_PARTS[command - LssCommand.INQUIRE]} number 0x{number:X}"
    outcome = _CONFIRMED.get(data[1], f"error {data[1]}")
    answers = {
        LssCommand.SELECTED: "selected",
        LssCommand.FOUND: "here is one (fast scan)",
        LssCommand.INQUIRE_NODE_ID: "no node id" if data[1] == UNCONFIGURED else f"node id {data[1]}",
        LssCommand.SET_NODE_ID: f"node id {outcome}",
        LssCommand.SET_BIT_TIMING: f"bit rate {outcome}",
        LssCommand.STORE: f"store {outcome}",
    }
    return {int(known): words for known, words in answers.items()}.get(command)


# Block transfers. Segments carry no command: they look like anything, and are not told apart here.

_Describe = Callable[[bytes], str]
_REQUESTS: tuple[tuple[str, _Describe], ...] = (
    ("110. ...0", lambda d: f"write {_address(d)} in blocks{_size(d)}"),
    ("110. ...1", lambda d: f"all blocks sent, checksum 0x{_number(d, 1, 3):04X}"),
    ("101. ..00", lambda d: f"read {_address(d)} in blocks of {d[4]} segments"),
    ("101. ..11", lambda d: "send the first block"),
    ("101. ..10", lambda d: _received(d)),
    ("101. ..01", lambda d: "all blocks received"),
)
_ANSWERS: tuple[tuple[str, _Describe], ...] = (
    ("101. ..00", lambda d: f"{_address(d)} may be written in blocks of {d[4]} segments"),
    ("101. ..10", lambda d: _received(d)),
    ("101. ..01", lambda d: "all blocks received"),
    ("110. ...0", lambda d: f"{_address(d)} comes in blocks{_size(d)}"),
    ("110. ...1", lambda d: f"all blocks sent, checksum 0x{_number(d, 1, 3):04X}"),
)
"""Patterns of the command byte, most significant bit first, and what it says."""


def block_reader(answer: bool) -> Callable[[str, bytes], Iterator[Reading]]:
    """The reader for command bytes of block transfers, from the server or from the client."""

    def read(title: str, data: bytes) -> Iterator[Reading]:
        bits = f"{data[0]:08b}"
        for pattern, words in _ANSWERS if answer else _REQUESTS:
            if re.fullmatch(pattern.replace(" ", ""), bits):
                meaning = "Block transfer; the EPOS 24/5 refuses it with abort 0x05040001, encoders may know it."
                yield Reading("frame", f"{title}: {words(data)}", meaning, source="CiA 301 7.2.4.3")
                return
        meaning = "No such command byte, or a segment of a block transfer, which only its neighbours tell."
        yield Reading("frame", f"{title}: command byte 0x{data[0]:02X}", meaning, source="CiA 301 7.2.4.3")

    return read


def _number(data: bytes, begin: int, end: int) -> int:
    return int.from_bytes(data[begin:end], "little")


def _address(data: bytes) -> str:
    return f"0x{_number(data, 1, 3):04X}/{data[3]}"


def _size(data: bytes) -> str:
    return f", {_number(data, 4, 8)} bytes" if data[0] & 2 else ""


def _received(data: bytes) -> str:
    return f"received up to segment {data[1]}; the next block may have {data[2]}"
