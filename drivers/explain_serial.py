"""Every reading of a frame of the EPOS's RS-232 line: a request in words, or an answer, whose request is not known."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import replace

from drivers.epos.serial_answers import Answer, parse_answer
from drivers.epos.serial_frames import (
    CRC_WRONG,
    FAILED,
    OKAY,
    Frame,
    InitiateSegmentedRead,
    InitiateSegmentedWrite,
    Opcode,
    ReadObject,
    Request,
    RequestCanFrame,
    SegmentRead,
    SegmentWrite,
    SendCanFrame,
    SendNmt,
    WriteObject,
    crc_of,
    frame_size,
    make_read_object,
    make_request_can_frame,
    make_segment_read,
    make_segment_write,
    make_write_object,
    parse_frame,
    parse_request,
)
from drivers.epos.serial_frames_v2 import DLE, STX, Deframer
from drivers.explain_codes import ABORTS, Reading, code_reading
from drivers.explain_frame import frame_readings, object_words, objects_at

_BYTES = re.compile(r"serial:\s*(?P<marked>([0-9A-F]{2}\s*)+)|(?P<spaced>[0-9A-F]{2}(\s+[0-9A-F]{2}){1,})", re.I | re.A)
_SOURCE = "maxon EPOS Communication Guide 6.2, 6.3"
_LATER_FRAMING = "framing of EPOS2 on USB and of EPOS4"

_POSSIBLE_REQUESTS = {
    "a read": make_read_object(0, 0, 0),
    "a write, or the begin of a transfer in segments": make_write_object(0, 0, 0, b""),
    "a segment that was read": make_segment_read(0),
    "a segment that was written": make_segment_write(b"", 0),
    "a request for a CAN frame of 8 bytes": make_request_can_frame(0, 8),
}
"""One request of each kind whose answers look different."""


def serial_readings(text: str) -> Iterator[Reading]:
    """Readings of ``10 01 41 60 00 01 AB F0`` or ``serial:1001...``; nothing where the text is no such bytes."""
    match = _BYTES.fullmatch(text)
    if match is None:
        return
    raw = bytes.fromhex(match["marked"] or match["spaced"])
    if len(raw) == 1:
        yield _acknowledge(raw[0])
    elif raw[:2] == bytes((DLE, STX)):
        frame = next(Deframer().feed(raw), "the frame is cut short")
        yield from (replace(reading, assumes=_LATER_FRAMING) for reading in _frame(frame, raw))
    else:
        yield from _frame(parse_frame(raw), raw)


def _acknowledge(byte: int) -> Reading:
    if byte == OKAY:
        return _reading("acknowledge O", "Ready for the frame, or the frame was good.")
    if byte == FAILED:
        cure = "Send the request again; if it happens often, look at cable, ground and baud rate."
        return _reading("acknowledge F", "Not ready, or the CRC of the frame was wrong.", cure=cure)
    if byte in set(Opcode):
        name = Opcode(byte).name.lower().replace("_", " ")
        return _reading(
            f"operation code 0x{byte:02X}: {name}", "The first byte of a frame goes alone; then comes O or F."
        )
    return _reading(f"byte 0x{byte:02X}", "No acknowledge and no operation code.")


def _reading(title: str, meaning: str, details: dict[str, str] | None = None, cure: str = "") -> Reading:
    return Reading("serial", f"RS-232: {title}", meaning, details or {}, cure=cure, source=_SOURCE)


def _frame(frame: Frame | str, raw: bytes) -> Iterator[Reading]:
    if isinstance(frame, str):
        yield _damaged(frame, raw)
    elif frame.opcode == Opcode.ANSWER:
        yield from _answer(frame)
    else:
        request = parse_request(frame)
        yield from [_damaged(request, raw)] if isinstance(request, str) else _request(request)


def _damaged(reason: str, raw: bytes) -> Reading:
    """What is wrong, and what would be right where the length is."""
    details = {}
    if reason == CRC_WRONG and raw[0] != DLE:
        right = crc_of(raw[:-2]).to_bytes(2, "little")
        details["CRC"] = f"{raw[-2:].hex(' ').upper()}; these bytes have {right.hex(' ').upper()}"
    elif raw[0] != DLE and len(raw) != frame_size(raw[1]):
        details["length"] = f"{len(raw)} bytes; the length byte 0x{raw[1]:02X} asks for {frame_size(raw[1])}"
    cure = "Check that all bytes were copied and no acknowledge is among them; on a real line look at cable and ground."
    return _reading("damaged or unknown frame", f"This is no frame that an EPOS takes: {reason}.", details, cure)


# Requests


def _request(request: Request) -> Iterator[Reading]:
    if isinstance(request, SendNmt):
        yield from _on_can("NMT command", f"000#{request.command:02X}{request.node:02X}")
    elif isinstance(request, SendCanFrame):
        yield from _on_can("send", f"{request.cob_id:03X}#{request.data.hex()}")
    elif isinstance(request, RequestCanFrame):
        yield from _on_can("send and wait for the answer to", f"{request.cob_id:03X}#R")
    elif isinstance(request, SegmentRead):
        yield _reading("read next segment", "Part of a transfer in segments.", {"toggle bit": str(request.toggle)})
    elif isinstance(request, SegmentWrite):
        details = {"toggle bit": str(request.toggle), "data": repr(request.data)[1:]}
        yield _reading("write next segment", "Part of a transfer in segments.", details)
    else:
        yield from _access(request)


def _on_can(verb: str, frame: str) -> Iterator[Reading]:
    """A command that puts a frame on the CAN bus, with the readings of that frame."""
    for reading in frame_readings(frame):
        yield replace(reading, kind="serial", title=f"RS-232: {verb} {reading.title}")


def _access(request: ReadObject | WriteObject | InitiateSegmentedRead | InitiateSegmentedWrite) -> Iterator[Reading]:
    node = f"node {request.node}" if request.node else "the drive on the line"
    for rank, (name, entry, device) in enumerate(objects_at(request.index, request.sub)):
        details = {}
        if isinstance(request, WriteObject):
            size = entry.type.bits // 8 if entry and entry.type.bits else 4
            details["value"] = object_words(entry, request.data[:size]) if entry else request.data.hex(" ")
        elif isinstance(request, InitiateSegmentedWrite):
            details["length"] = f"{request.size} bytes, in segments that follow"
        verb = "write" if isinstance(request, WriteObject | InitiateSegmentedWrite) else "read"
        segments = " in segments" if isinstance(request, InitiateSegmentedRead | InitiateSegmentedWrite) else ""
        meaning = entry.meaning if entry else "An object that neither EPOS 24/5 nor encoder has."
        reading = _reading(f"{verb} {name} of {node}{segments}", meaning, details)
        yield replace(reading, assumes=device, rank=rank)


# Answers


def _answer(frame: Frame) -> Iterator[Reading]:
    """One reading for each kind of request that it may answer."""
    error = int.from_bytes(frame.data[:4], "little")
    if error:
        yield _abort(error)
        return
    answers = [(kind, request[0], parse_answer(request, frame)) for kind, request in _POSSIBLE_REQUESTS.items()]
    fitting = [(kind, opcode, answer) for kind, opcode, answer in answers if isinstance(answer, Answer)]
    for rank, (kind, opcode, answer) in enumerate(fitting):
        title = "answer" if len(frame.data) > 4 else "answer: done"
        reading = _reading(title, "It does not say which request it answers.", _answer_details(opcode, answer))
        yield replace(reading, assumes=f"answer to {kind}", rank=rank)
    if not fitting:
        yield _reading(
            "answer", "No request of this protocol has such an answer.", {"data": frame.data.hex(" ").upper()}
        )


def _abort(error: int) -> Reading:
    label = f"RS-232: answer, abort 0x{error:08X}"
    if error in ABORTS:
        return code_reading("serial", label, ABORTS[error], rank=0)
    return Reading(
        "serial", label, "Refused with a code that is in no table.", cure="Look it up in the device's manual."
    )


def _answer_details(opcode: int, answer: Answer) -> dict[str, str]:
    if opcode == Opcode.READ_OBJECT:
        unsigned = int.from_bytes(answer.data, "little")
        signed = int.from_bytes(answer.data, "little", signed=True)
        return {"value": f"0x{unsigned:X} = {signed}", "bytes": answer.data.hex(" ").upper()}
    if opcode == Opcode.SEGMENT_READ:
        more = "yes" if answer.more else "no"
        return {"data": repr(answer.data)[1:], "toggle bit": str(answer.toggle), "more segments": more}
    if opcode == Opcode.SEGMENT_WRITE:
        return {"bytes taken": str(answer.accepted), "toggle bit": str(answer.toggle)}
    return {"data": answer.data.hex(" ").upper()} if answer.data else {}
