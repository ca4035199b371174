"""The serial side of a simulated EPOS 24/5: the handshake of the RS-232 protocol, and its patience.

Source: maxon EPOS Communication Guide 6.2. The manual gives 500 ms for the host's acknowledge of an answer. Assumed, as
it says nothing: the same limit between the bytes of a request; times to acknowledge and to answer; that an unknown
operation code and one that comes while a request is executed are answered "not ready"; that bytes other than ``O`` and
``F`` are no acknowledge; that a restarting drive loses the acknowledge of the command that restarts it.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum, auto

from drivers.canopen.codes import NmtState
from drivers.epos.serial_frames import FAILED, OKAY, Opcode, frame_size, parse_frame
from drivers.epos.value_tables import RS232_BAUD_RATES
from drivers.simulated.node import SimulatedNode
from drivers.simulated.serial_commands import SerialCommands
from drivers.simulated.serial_wire import QUIET, SerialCable, SerialNoise

ACKNOWLEDGE_LIMIT_S = 0.5
"""Longest silence of the host within an exchange; then the communication is reset."""

_LSS_OPCODES = (0x30, 0x31)
"""Commands of later drives: accepted and refused as illegal."""
_OPCODES = {opcode for opcode in Opcode if opcode is not Opcode.ANSWER}.union(_LSS_OPCODES)
_OKAY, _FAILED, _ANSWER = bytes((OKAY,)), bytes((FAILED,)), bytes((Opcode.ANSWER,))


@dataclass(frozen=True, slots=True)
class EposTiming:
    """How fast the EPOS is; assumed."""

    acknowledge_s: float = 0.0001
    """From the last byte of something to its acknowledge."""
    answer_s: float = 0.001
    """From the end of a request, and of what it caused on the CAN bus, to the answer."""
    forwarding_timeout_s: float = 0.5
    """Longest time that another node is waited for."""


@dataclass(slots=True)
class SerialCounters:
    """What happened on the serial side since it was made."""

    requests: int = 0
    """Requests whose CRC was right."""
    answers: int = 0
    """Answers that the host acknowledged as good."""
    crc_errors: int = 0
    not_ready: int = 0
    """Operation codes refused."""
    resets: int = 0
    """Exchanges given up because the host was silent for too long."""


class _Phase(Enum):
    IDLE = auto()
    REQUEST = auto()
    EXECUTING = auto()
    ANSWER_READY = auto()
    ANSWER_SENT = auto()


class SimulatedSerial:
    """The RS-232 port of one drive, which makes it the gateway to all others.

    Args:
        node: the drive.
        baud: bit/s, one of those that object 0x2002 knows; the drive finds it there at its next power-up.
        timing: how fast it is.
        noise: what happens to the bytes on the cable.
        seed: of the noise.

    Attributes:
        cable: its cable; the host writes to it, or a :class:`SerialPty` does.
        counters: what happened.

    Raises:
        ValueError: a baud rate that the drive does not know.
    """

    def __init__(
        self,
        node: SimulatedNode,
        baud: int = 115200,
        timing: EposTiming = EposTiming(),
        noise: SerialNoise = QUIET,
        seed: int = 0,
    ) -> None:
        codes = [code for code, rate in RS232_BAUD_RATES.items() if rate == baud]
        if not codes:
            raise ValueError(f"an EPOS 24/5 has no {baud} bit/s on its serial line")
        node.dictionary.commission({"rs232_baud_rate_code": codes[0]})
        self.cable = SerialCable(baud, self._receive, noise, seed)
        self.counters = SerialCounters()
        self._node = node
        self._timing = timing
        self._commands = SerialCommands(node, timing.forwarding_timeout_s)
        self._phase = _Phase.IDLE
        self._request = bytearray()
        self._answer = b""
        self._answer_begins_s = 0.0
        self._patience_ends_s = 0.0
        self._timer: asyncio.TimerHandle | None = None
        self._on_byte: dict[_Phase, Callable[[int, float], None]] = {
            _Phase.IDLE: self._on_opcode,
            _Phase.REQUEST: self._on_request_byte,
            _Phase.EXECUTING: self._on_byte_too_early,
            _Phase.ANSWER_READY: self._on_ready_acknowledge,
            _Phase.ANSWER_SENT: self._on_end_acknowledge,
        }

    def _receive(self, data: bytes, end_s: float) -> None:
        if self._node.nmt_state is NmtState.BOOT_UP:
            self._restart()
            return
        for byte in data:
            self._on_byte[self._phase](byte, end_s)

    def _send(self, data: bytes, at_s: float) -> float:
        return self.cable.to_host.send(data, at_s)

    def _acknowledge(self, good: bool, at_s: float) -> None:
        self._send(_OKAY if good else _FAILED, at_s + self._timing.acknowledge_s)

    # Request

    def _on_opcode(self, byte: int, at_s: float) -> None:
        if byte not in _OPCODES:
            self.counters.not_ready += 1
            self._acknowledge(False, at_s)
            return
        self._request = bytearray((byte,))
        self._enter(_Phase.REQUEST, at_s)
        self._acknowledge(True, at_s)

    def _on_request_byte(self, byte: int, at_s: float) -> None:
        self._request.append(byte)
        if len(self._request) < frame_size(self._request[1]):
            self._patience_ends_s = at_s + ACKNOWLEDGE_LIMIT_S
            return
        frame = parse_frame(bytes(self._request))
        if isinstance(frame, str):
            self.counters.crc_errors += 1
            self._phase = _Phase.IDLE
            self._acknowledge(False, at_s)
            return
        self.counters.requests += 1
        self._phase = _Phase.EXECUTING
        self._acknowledge(True, at_s)
        self._commands.execute(frame, self._reply, at_s)
        if self._node.nmt_state is NmtState.BOOT_UP:
            self._restart()

    def _on_byte_too_early(self, byte: int, at_s: float) -> None:
        if byte in _OPCODES:
            self.counters.not_ready += 1
            self._acknowledge(False, at_s)

    # Answer

    def _reply(self, answer: bytes | None, at_s: float) -> None:
        if answer is None:
            self._phase = _Phase.IDLE
            return
        if self._node.nmt_state is NmtState.BOOT_UP:
            self._restart()
            return
        self._answer = answer
        self._answer_begins_s = self._send(_ANSWER, at_s + self._timing.answer_s)
        self._enter(_Phase.ANSWER_READY, self._answer_begins_s)

    def _on_ready_acknowledge(self, byte: int, at_s: float) -> None:
        if at_s < self._answer_begins_s:
            self._on_byte_too_early(byte, at_s)
        elif byte == OKAY:
            end_s = self._send(self._answer[1:], at_s + self._timing.acknowledge_s)
            self._enter(_Phase.ANSWER_SENT, end_s)
        elif byte == FAILED:
            self._phase = _Phase.IDLE

    def _on_end_acknowledge(self, byte: int, _: float) -> None:
        if byte in (OKAY, FAILED):
            self.counters.answers += byte == OKAY
            self._phase = _Phase.IDLE

    # Patience

    def _enter(self, phase: _Phase, at_s: float) -> None:
        """Wait for the host from ``at_s`` on."""
        self._phase = phase
        self._patience_ends_s = at_s + ACKNOWLEDGE_LIMIT_S
        if self._timer is None:
            self._timer = asyncio.get_running_loop().call_at(self._patience_ends_s, self._on_timer)

    def _on_timer(self) -> None:
        self._timer = None
        if self._phase in (_Phase.IDLE, _Phase.EXECUTING):
            return
        loop = asyncio.get_running_loop()
        if self._patience_ends_s > loop.time():
            self._timer = loop.call_at(self._patience_ends_s, self._on_timer)
        else:
            self.counters.resets += 1
            self._phase = _Phase.IDLE

    def _restart(self) -> None:
        """The drive restarts: what was under way is forgotten, and what was to be sent is lost."""
        self._commands.forget()
        self.cable.to_host.clear()
        self._phase = _Phase.IDLE
