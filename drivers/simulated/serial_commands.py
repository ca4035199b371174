"""What the commands of the RS-232 protocol do in a simulated EPOS: they become SDO requests, NMT and CAN frames.

Source: maxon EPOS Communication Guide 6.3, 6.4 and chapter 8. Not published and therefore assumed: a node id above 127
is the wrong one, an object of more than four bytes is "too long" for the short read, and a refused frame without an
answer is dropped.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from drivers.canopen.codes import NmtState
from drivers.epos.serial_answers import (
    make_can_frame_answer,
    make_done_answer,
    make_read_answer,
    make_segment_answer,
    make_segment_written_answer,
)
from drivers.epos.serial_frames import (
    MAX_SEGMENT_BYTES,
    UNANSWERED,
    Frame,
    InitiateSegmentedRead,
    InitiateSegmentedWrite,
    Opcode,
    ReadObject,
    RequestCanFrame,
    SegmentRead,
    SegmentWrite,
    SendCanFrame,
    SendNmt,
    WriteObject,
    parse_request,
)
from drivers.simulated.dictionary import TOO_LONG
from drivers.simulated.node import SimulatedNode
from drivers.simulated.sdo_server import TOGGLE_NOT_ALTERNATED, UNKNOWN_COMMAND
from drivers.simulated.serial_forwarding import SDO_TIMEOUT, Forwarding

WRONG_NMT_STATE = 0x0F00_FFC0
ILLEGAL_COMMAND = 0x0F00_FFBF
WRONG_NODE = 0x0F00_FFB9
_LAST_NODE = 127
_GENERAL_ERROR = 0x0800_0000

_INITIATE = struct.Struct("<BHB4s")
_UPLOAD, _DOWNLOAD, _DOWNLOAD_SIZED, _DOWNLOAD_EXPEDITED = 0x40, 0x20, 0x21, 0x22
_UPLOAD_SEGMENT, _DOWNLOAD_SEGMENT = 0x60, 0x00
_ANSWERING = {_UPLOAD: 2, _DOWNLOAD: 3, _UPLOAD_SEGMENT: 0, _DOWNLOAD_SEGMENT: 1}
"""Command specifier of the SDO answer by that of the request (CiA 301 7.2.4.3)."""

Reply = Callable[[bytes | None, float], None]
"""Takes the answer frame, None for a command without one, and the time at which it is known."""
Done = Callable[[bytes, int, float], None]
"""Takes an SDO answer, its error code or 0, and its time."""


@dataclass(slots=True)
class _Transfer:
    """A segmented transfer between two of its requests.

    Attributes:
        upload: whether the host reads.
        data: bytes that the host, or the node, has still to get.
        left: of a download, bytes that the host has still to send.
        complete: of an upload, whether the node has sent everything.
        toggle: of the next request of the host.
        can_toggle: of the next SDO segment.
    """

    node: int
    multiplexer: bytes
    upload: bool
    data: bytearray
    left: int = 0
    complete: bool = False
    toggle: int = 0
    can_toggle: int = 0


class SerialCommands:
    """Executes one command after the other for the serial side of an EPOS.

    Args:
        node: the EPOS.
        timeout_s: longest time to wait for another node.
    """

    def __init__(self, node: SimulatedNode, timeout_s: float) -> None:
        self._node = node
        self._forwarding = Forwarding(node, timeout_s)
        self._transfer: _Transfer | None = None
        self._commands: dict[type, Callable[[Any, Reply, float], None]] = {
            ReadObject: self._read,
            WriteObject: self._write,
            InitiateSegmentedRead: self._initiate_read,
            InitiateSegmentedWrite: self._initiate_write,
            SegmentRead: self._read_segment,
            SegmentWrite: self._write_segment,
            SendNmt: self._send_nmt,
            SendCanFrame: self._send_frame,
            RequestCanFrame: self._request_frame,
        }

    def execute(self, frame: Frame, reply: Reply, at_s: float) -> None:
        """Do what a frame asks for, which came at ``at_s``, and reply then or later."""
        request = parse_request(frame)
        error = 0
        if isinstance(request, str):
            error = ILLEGAL_COMMAND
        elif self._node.nmt_state is NmtState.STOPPED and not isinstance(request, SendNmt):
            error = WRONG_NMT_STATE
        elif getattr(request, "node", 0) > _LAST_NODE:
            error = WRONG_NODE
        if error:
            reply(None if frame.opcode in UNANSWERED else _refusal(frame.opcode, error), at_s)
        else:
            self._commands[type(request)](request, reply, at_s)

    def forget(self) -> None:
        """Give up what is under way."""
        self._transfer = None
        self._forwarding.forget()

    def _ask(self, node: int, request: bytes, done: Done, at_s: float) -> None:
        expected = _ANSWERING[request[0] & 0xE0]

        def answered(answer: bytes | None, at_s: float) -> None:
            done(answer or b"", _error_of(answer, expected), at_s)

        self._forwarding.ask(node, request, answered, at_s)

    # Objects of up to four bytes

    def _read(self, request: ReadObject, reply: Reply, at_s: float) -> None:
        def done(answer: bytes, error: int, at_s: float) -> None:
            if not error and not answer[0] & 2:
                error = TOO_LONG
                self._forwarding.abort(request.node, answer[1:4], error)
            reply(make_read_answer(b"" if error else _expedited(answer), error), at_s)

        self._ask(request.node, _INITIATE.pack(_UPLOAD, request.index, request.sub, b""), done, at_s)

    def _write(self, request: WriteObject, reply: Reply, at_s: float) -> None:
        """The size of the object is not known here: an SDO request that gives none leaves it to the node."""
        sdo = _INITIATE.pack(_DOWNLOAD_EXPEDITED, request.index, request.sub, request.data)
        self._ask(request.node, sdo, lambda _, error, at_s: reply(make_done_answer(error), at_s), at_s)

    # Objects of any length

    def _initiate_read(self, request: InitiateSegmentedRead, reply: Reply, at_s: float) -> None:
        self._transfer = None

        def done(answer: bytes, error: int, at_s: float) -> None:
            if not error:
                short = bool(answer[0] & 2)
                data = bytearray(_expedited(answer) if short else b"")
                self._transfer = _Transfer(request.node, answer[1:4], True, data, complete=short)
            reply(make_done_answer(error), at_s)

        self._ask(request.node, _INITIATE.pack(_UPLOAD, request.index, request.sub, b""), done, at_s)

    def _initiate_write(self, request: InitiateSegmentedWrite, reply: Reply, at_s: float) -> None:
        self._transfer = None

        def done(answer: bytes, error: int, at_s: float) -> None:
            if not error:
                self._transfer = _Transfer(request.node, answer[1:4], False, bytearray(), left=request.size)
            reply(make_done_answer(error), at_s)

        size = request.size.to_bytes(4, "little")
        self._ask(request.node, _INITIATE.pack(_DOWNLOAD_SIZED, request.index, request.sub, size), done, at_s)

    def _running(self, upload: bool, toggle: int) -> _Transfer | int:
        """The transfer that a segment belongs to, or the error that ends it."""
        transfer = self._transfer
        if transfer is None or transfer.upload is not upload:
            return UNKNOWN_COMMAND
        if transfer.toggle != toggle:
            return self._break_off(transfer, TOGGLE_NOT_ALTERNATED)
        return transfer

    def _break_off(self, transfer: _Transfer, error: int) -> int:
        self._transfer = None
        self._forwarding.abort(transfer.node, transfer.multiplexer, error)
        return error

    def _read_segment(self, request: SegmentRead, reply: Reply, at_s: float) -> None:
        transfer = self._running(True, request.toggle)
        if isinstance(transfer, int):
            reply(make_segment_answer(b"", 0, False, transfer), at_s)
        else:
            self._gather(transfer, reply, at_s)

    def _gather(self, transfer: _Transfer, reply: Reply, at_s: float) -> None:
        """Read SDO segments of seven bytes until one more would not fit."""
        if transfer.complete or len(transfer.data) + 7 > MAX_SEGMENT_BYTES:
            reply(make_segment_answer(bytes(transfer.data), transfer.toggle, not transfer.complete), at_s)
            transfer.data.clear()
            transfer.toggle ^= 1
            self._transfer = None if transfer.complete else transfer
            return

        def done(answer: bytes, error: int, at_s: float) -> None:
            if error:
                self._transfer = None
                reply(make_segment_answer(b"", 0, False, error), at_s)
                return
            transfer.data += answer[1 : 8 - (answer[0] >> 1 & 7)]
            transfer.complete = bool(answer[0] & 1)
            self._gather(transfer, reply, at_s)

        head = _UPLOAD_SEGMENT | transfer.can_toggle << 4
        transfer.can_toggle ^= 1
        self._ask(transfer.node, bytes((head, *bytes(7))), done, at_s)

    def _write_segment(self, request: SegmentWrite, reply: Reply, at_s: float) -> None:
        transfer = self._running(False, request.toggle)
        if not isinstance(transfer, int) and len(request.data) > transfer.left:
            transfer = self._break_off(transfer, TOO_LONG)
        if isinstance(transfer, int):
            reply(make_segment_written_answer(0, request.toggle, transfer), at_s)
            return
        transfer.left -= len(request.data)
        transfer.data += request.data
        transfer.toggle ^= 1
        self._pass_on(transfer, request, reply, at_s)

    def _pass_on(self, transfer: _Transfer, request: SegmentWrite, reply: Reply, at_s: float) -> None:
        """Write SDO segments of seven bytes until everything is gone."""
        segment = bytes(transfer.data[:7])
        del transfer.data[:7]
        last = not (transfer.left or transfer.data)

        def done(_: bytes, error: int, at_s: float) -> None:
            if error or last:
                self._transfer = None
            if transfer.data and not error:
                self._pass_on(transfer, request, reply, at_s)
            else:
                accepted = 0 if error else len(request.data)
                reply(make_segment_written_answer(accepted, request.toggle, error), at_s)

        head = _DOWNLOAD_SEGMENT | transfer.can_toggle << 4 | 7 - len(segment) << 1 | last
        transfer.can_toggle ^= 1
        self._ask(transfer.node, bytes((head,)) + segment.ljust(7, b"\0"), done, at_s)

    # Frames

    def _send_nmt(self, request: SendNmt, reply: Reply, at_s: float) -> None:
        reply(None, at_s)
        data = bytes((request.command & 0xFF, request.node))
        self._forwarding.send_frame(0, data)
        receiver = self._node.port.receiver
        if receiver is not None:  # a controller does not hear its own frames
            receiver(0, data, at_s)

    def _send_frame(self, request: SendCanFrame, reply: Reply, at_s: float) -> None:
        self._forwarding.send_frame(request.cob_id, request.data)
        reply(None, at_s)

    def _request_frame(self, request: RequestCanFrame, reply: Reply, at_s: float) -> None:
        def answered(answer: bytes | None, at_s: float) -> None:
            error = SDO_TIMEOUT if answer is None else 0
            data = (answer or b"")[: request.length].ljust(request.length, b"\0")
            reply(make_can_frame_answer(data, error), at_s)

        self._forwarding.request_frame(request.cob_id, answered)


def _refusal(opcode: int, error: int) -> bytes:
    """The answer to a request that was not executed; a read still carries its four bytes."""
    return make_read_answer(b"", error) if opcode == Opcode.READ_OBJECT else make_done_answer(error)


def _error_of(answer: bytes | None, expected: int) -> int:
    """The error code of an SDO answer that should have the command specifier ``expected``; 0 where it has."""
    if answer is None:
        return SDO_TIMEOUT
    if len(answer) != 8:
        return _GENERAL_ERROR
    specifier = answer[0] >> 5
    if specifier == 4:
        return int.from_bytes(answer[4:], "little")
    return 0 if specifier == expected else UNKNOWN_COMMAND


def _expedited(answer: bytes) -> bytes:
    """The value in an expedited SDO answer."""
    return answer[4 : 8 - (answer[0] >> 2 & 3)] if answer[0] & 1 else answer[4:]
