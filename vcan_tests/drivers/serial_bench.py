"""A small drive at the far end of a serial line, and a line that loses, flips, doubles and delays bytes."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from random import Random

from drivers.epos.serial_answers import make_can_frame_answer, make_done_answer, make_read_answer
from drivers.epos.serial_conversation import Transport
from drivers.epos.serial_frames import (
    UNANSWERED,
    Frame,
    ReadObject,
    RequestCanFrame,
    WriteObject,
    frame_size,
    make_read_object,
    make_send_nmt,
    make_write_object,
    parse_frame,
    parse_request,
)
from drivers.epos.serial_line import SerialLine

OPCODES = (0x0E, 0x10, 0x11, 0x12, 0x13, 0x14, 0x15, 0x20, 0x21)
DEAD_NODE = 99
PATIENCE_S = 0.5
BAUD = 115200
BYTE_S = 10 / BAUD
STATUSWORD = make_read_object(1, 0x6041, 0)
CONTROLWORD = make_write_object(1, 0x6040, 0, b"\x06\x00")
START_ALL = make_send_nmt(0, 1)


class Wire:
    """One direction: bytes in their order and at their times, each with its own bad luck."""

    def __init__(self, baud: int, deliver: Callable[[bytes, float], None], share: float, dice: Random) -> None:
        self._byte_s, self._deliver, self._share, self._dice = 10 / baud, deliver, share, dice
        self._free_s = 0.0
        self.sent = 0
        self.spoiled = 0

    def send(self, data: bytes) -> None:
        self.sent += len(data)
        for byte in data:
            self._send_byte(byte)

    def _send_byte(self, byte: int) -> None:
        loop, dice = asyncio.get_running_loop(), self._dice
        self._free_s = max(self._free_s, loop.time()) + self._byte_s
        copies = 1
        if dice.random() < self._share:
            self.spoiled += 1
            fate = dice.randrange(4)
            copies = (0, 1, 2, 1)[fate]
            byte ^= 1 << dice.randrange(8) if fate == 1 else 0
            self._free_s += dice.uniform(0, 0.3) if fate == 3 else 0.0
        for copy in range(copies):
            self._free_s += copy * self._byte_s
            loop.call_at(self._free_s, self._deliver, bytes((byte,)), self._free_s)


class Drive:
    """Keeps the drive's manners: acknowledges, patience, CRC; every object has a value of its own until it is written.

    Args:
        frame_timeout_s: time after which it gives up half a request; None for a drive that never does.
    """

    def __init__(
        self, baud: int = 115200, share: float = 0.0, seed: int = 0, frame_timeout_s: float | None = PATIENCE_S
    ) -> None:
        dice = Random(seed)
        self.host: Callable[[bytes, float], None] | None = None
        self.to_host = Wire(baud, self._to_host, share, dice)
        self.to_drive = Wire(baud, lambda data, _: self.take(data[0]), share, dice)
        self.answering_s = 0.001
        self.objects: dict[tuple[int, int, int], bytes] = {}
        self.carried_out: list[object] = []
        self.say = self.to_host.send
        self.mute = False
        self._frame_timeout_s = frame_timeout_s
        self._expect: Callable[[int], None] = self._take_opcode
        self._received = bytearray()
        self._answer = b""
        self._timer: asyncio.TimerHandle | None = None

    def write(self, data: bytes) -> None:
        """The host sends."""
        self.to_drive.send(data)

    def _to_host(self, data: bytes, stamp_s: float) -> None:
        if self.host is not None and not self.mute:
            self.host(data, stamp_s)

    def value(self, node: int, index: int, sub: int) -> bytes:
        fresh = Random(node << 24 | index << 8 | sub).randbytes(4)
        return self.objects.get((node, index, sub), fresh)

    def take(self, byte: int) -> None:
        """One byte has arrived."""
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        self._expect(byte)

    def _await(self, expect: Callable[[int], None], patience_s: float | None) -> None:
        self._expect = expect
        if patience_s is not None:
            self._timer = asyncio.get_running_loop().call_later(patience_s, self._await, self._take_opcode, None)

    def _take_opcode(self, byte: int) -> None:
        if byte not in OPCODES:
            self.say(b"F")
            return
        self._received = bytearray((byte,))
        self._await(self._take_rest, self._frame_timeout_s)
        self.say(b"O")

    def _take_rest(self, byte: int) -> None:
        self._received.append(byte)
        if len(self._received) < frame_size(self._received[1]):
            self._await(self._take_rest, self._frame_timeout_s)
            return
        frame = parse_frame(bytes(self._received))
        self._await(self._take_opcode, None)
        self.say(b"F" if isinstance(frame, str) else b"O")
        if not isinstance(frame, str):
            self._carry_out(frame)

    def _carry_out(self, frame: Frame) -> None:
        request = parse_request(frame)
        self.carried_out.append(request)
        if frame.opcode in UNANSWERED:
            return
        delay_s = 0.5 if getattr(request, "node", 0) == DEAD_NODE else self.answering_s
        self._answer = self._answer_to(request)
        self._expect = lambda byte: None
        asyncio.get_running_loop().call_later(delay_s, self._begin_answer)

    def _answer_to(self, request: object) -> bytes:
        if getattr(request, "node", 0) == DEAD_NODE:
            return make_done_answer(0x0504_0000)
        if isinstance(request, WriteObject):
            self.objects[request.node, request.index, request.sub] = request.data
            return make_done_answer()
        if isinstance(request, ReadObject):
            return make_read_answer(self.value(request.node, request.index, request.sub))
        if isinstance(request, RequestCanFrame):
            return make_can_frame_answer(bytes(request.length))
        return make_done_answer(0x0F00_FFBF)

    def _begin_answer(self) -> None:
        self._await(self._take_ready, PATIENCE_S)
        self.say(self._answer[:1])

    def _take_ready(self, byte: int) -> None:
        if byte != ord("O"):
            self._await(self._take_opcode, None)
            return
        self._await(self._take_end, PATIENCE_S)
        self.say(self._answer[1:])

    def _take_end(self, byte: int) -> None:
        self._await(self._take_opcode, None)


def now() -> float:
    return asyncio.get_running_loop().time()


def a_line(drive: Transport) -> SerialLine:
    return SerialLine(drive, BAUD, "ttyTEST")
