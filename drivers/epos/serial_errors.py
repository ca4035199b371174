"""What went wrong on the serial line, in words."""

from __future__ import annotations

from typing import Any

from canhelm.errors import Aborted, BusOff, NotReady, Timeout
from drivers.canopen.codes import SDO_ABORTS
from drivers.epos.codes import GATEWAY_ABORTS
from drivers.epos.serial_frames import (
    READS,
    Frame,
    Opcode,
    RequestCanFrame,
    SendCanFrame,
    SendNmt,
    parse_frame,
    parse_request,
)

ABORTS = SDO_ABORTS | GATEWAY_ABORTS


def request_words(request: bytes) -> str:
    """A request frame in a few words, for messages."""
    frame = parse_frame(request)
    parsed = parse_request(frame) if isinstance(frame, Frame) else frame
    if isinstance(parsed, SendCanFrame | RequestCanFrame):
        return f"CAN frame 0x{parsed.cob_id:03X}"
    if isinstance(parsed, SendNmt):
        return f"NMT command {parsed.command} to node {parsed.node}"
    node, address = _target(request)
    verb = "read" if request[0] in READS else "write"
    return f"{verb} of {address} of node {node}" if address else "segment of a transfer"


def _target(request: bytes) -> tuple[int | None, str | None]:
    """Node and object that a request names."""
    if not Opcode.READ_OBJECT <= request[0] <= Opcode.INITIATE_SEGMENTED_WRITE:
        return None, None
    index, sub = request[2] | request[3] << 8, request[4]
    return request[5], f"0x{index:04X}/{sub}" if sub else f"0x{index:04X}"


def _where(request: bytes) -> dict[str, Any]:
    node, address = _target(request)
    return {"node": node, "object": address}


def aborted(request: bytes, code: int) -> Aborted:
    """The drive, or the node behind it, refused."""
    known = ABORTS.get(code)
    return Aborted(
        f"{request_words(request)} was refused: {known.name if known else 'abort'} (0x{code:08X})",
        **_where(request),
        value=code,
        remedy=known.cure if known else f"canhelm explain 0x{code:08X}",
    )


def unsent(request: bytes, line: str) -> Timeout:
    """The deadline of a request passed before its turn came."""
    message = f"{line} was busy: {request_words(request)} was not sent"
    return Timeout(message, **_where(request), remedy="ask for less at a time, or raise the line's baud rate")


def unanswered(request: bytes, line: str) -> Timeout:
    """The deadline of a request passed while the drive had it."""
    remedy = "is the node behind the gateway switched on? What was written may have arrived: read it back"
    return Timeout(f"{request_words(request)} over {line} was not answered in time", **_where(request), remedy=remedy)


def unheard(request: bytes, line: str, baud: int) -> Timeout:
    """The drive on the line does not react at all, or refuses every time."""
    return Timeout(
        f"the drive on {line} takes no requests: {request_words(request)} was not carried out",
        **_where(request),
        remedy=f"is it switched on, is the cable in place, and is its baud rate (0x2002) {baud}?",
    )


def lost(request: bytes, line: str) -> Timeout:
    """No good answer came; what is no read may have been carried out."""
    what, cable = request_words(request), "if it happens often, look at the cable and its ground"
    if request[0] in READS:
        return Timeout(f"no good answer on {line} to the {what}", **_where(request), remedy=f"try again; {cable}")
    message = f"the answer on {line} was lost: {what} may have been carried out"
    return Timeout(message, **_where(request), remedy=f"read it back before you do it again; {cable}")


def deaf(line: str, baud: int) -> BusOff:
    """Nothing at all comes from the line."""
    return BusOff(
        f"the drive on {line} does not answer",
        remedy=f"is it switched on, is the cable in place, and is its baud rate (0x2002) {baud}?",
    )


def garbage(line: str, baud: int) -> BusOff:
    """What comes from the line makes no sense."""
    return BusOff(
        f"nothing understandable comes from {line} at {baud} baud",
        remedy="try another baud rate (--bus rs232:DEVICE@38400 is the factory's); look at the cable and its ground",
    )


def queue_full(request: bytes, line: str) -> NotReady:
    """Too many requests wait for the line."""
    message = f"too many requests wait for {line}: {request_words(request)} was not sent"
    return NotReady(message, **_where(request), remedy="ask for less at a time")


def gone(line: str, reason: str) -> BusOff:
    """The device of the line has vanished."""
    return BusOff(f"{line} is gone: {reason}", remedy="plug the cable or the adapter in again")
