"""The host's side of one exchange with the EPOS, byte by byte, without clock or I/O (Communication Guide 6.2.5).

Host: operation code. Drive: ``O``. Host: the rest of the frame. Drive: ``O``; then, if there is an answer, operation
code 0. Host: ``O``. Drive: the rest of the answer. Host: ``O``.

An acknowledge is one byte without a check, so what cannot be one is not taken for one: a byte that came before the
host's own bytes can have reached the drive is an echo of the past, a doubled byte or noise.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from enum import Enum, auto

from drivers.epos.serial_answers import Answer, may_answer, parse_answer
from drivers.epos.serial_frames import FAILED, OKAY, UNANSWERED, Opcode, frame_size, parse_frame

BITS_PER_BYTE = 10
"""Start bit, eight data bits, one stop bit (Communication Guide 6.2.1)."""

_OKAY, _FAILED = bytes((OKAY,)), bytes((FAILED,))
_LONGEST = frame_size(0xFF)


class Phase(Enum):
    """What the host waits for."""

    READY = auto()
    """The ready acknowledge."""
    ACCEPTED = auto()
    """The end acknowledge of the request."""
    ANSWER = auto()
    """Operation code 0, the first byte of the answer."""
    REST = auto()
    """The rest of the answer."""
    SENDING = auto()
    """Nothing but the end of the host's own bytes."""


class Outcome(Enum):
    """How an exchange ended."""

    ANSWERED = auto()
    NOT_READY = auto()
    """The drive refused the operation code; it has not seen the request."""
    REFUSED = auto()
    """The drive found the CRC of the request wrong; it has not carried it out."""
    UNHEARD = auto()
    """No ready acknowledge: the request was not sent beyond its operation code."""
    LOST = auto()
    """No end acknowledge or no answer: the request may have been carried out."""
    GARBLED = auto()
    """The answer is damaged: the request was carried out."""


class Exchange(ABC):
    """The exchanges of one line, one after the other.

    Args:
        baud: bit/s of the line.

    Attributes:
        phase: what is being waited for.
        outcome: how the last exchange ended; None while it runs.
        answer: the answer, once it is there.
        strays: bytes or frames that had no place in the conversation.
        crc_errors: answers that were damaged.
        sent_s: end of the host's last byte on the wire.
    """

    def __init__(self, baud: int) -> None:
        self.phase = Phase.READY
        self.outcome: Outcome | None = None
        self.answer = Answer()
        self.strays = 0
        self.crc_errors = 0
        self.sent_s = 0.0
        self._byte_s = BITS_PER_BYTE / baud
        self._request = b""

    @abstractmethod
    def begin(self, request: bytes, now_s: float) -> bytes:
        """Begin an exchange; the bytes to send at ``now_s``."""

    @abstractmethod
    def feed(self, data: bytes, stamp_s: float) -> bytes:
        """Take bytes of the drive, the last of which ended at ``stamp_s``; the bytes to send now."""

    @abstractmethod
    def give_up(self, now_s: float) -> bytes:
        """Nothing came in time: sets the outcome. Returns what to send, so that the drive does not wait, either."""

    def _say(self, data: bytes, now_s: float) -> bytes:
        self.sent_s = max(now_s, self.sent_s) + len(data) * self._byte_s
        return data


class Handshake(Exchange):
    """The acknowledged exchange of the first generation."""

    def __init__(self, baud: int) -> None:
        super().__init__(baud)
        self._received = bytearray()

    def begin(self, request: bytes, now_s: float) -> bytes:
        """Begin an exchange; the bytes to send at ``now_s``."""
        self._request = request
        self.outcome = None
        self.phase = Phase.READY
        return self._say(request[:1], now_s)

    def feed(self, data: bytes, stamp_s: float) -> bytes:
        """Take bytes of the drive, the last of which ended at ``stamp_s``; the bytes to send now."""
        reply = b""
        for byte in data:
            if self.outcome is not None:
                self.strays += 1
            elif self.phase is Phase.REST and len(self._received) > 1:
                reply += self._take_rest(byte, stamp_s)
            elif stamp_s < self.sent_s + 0.5 * self._byte_s:
                self.strays += 1
            else:
                reply += self._take_word(byte, stamp_s)
        return reply

    def give_up(self, now_s: float) -> bytes:
        """No byte came in time. Returns what to send, so that a drive that waits for the end acknowledge gets one."""
        if self.phase is Phase.REST:
            return self._garbled(now_s)
        self.outcome = Outcome.UNHEARD if self.phase is Phase.READY else Outcome.LOST
        return b""

    def _take_word(self, byte: int, stamp_s: float) -> bytes:
        """The first byte that can be an answer to what the host said last."""
        if self.phase is Phase.READY:
            return self._take_ready(byte, stamp_s)
        if self.phase is Phase.ACCEPTED:
            return self._take_accepted(byte)
        if self.phase is Phase.ANSWER:
            return self._take_answer(byte, stamp_s)
        return self._take_rest(byte, stamp_s)

    def _take_ready(self, byte: int, stamp_s: float) -> bytes:
        if byte == OKAY:
            self.phase = Phase.ACCEPTED
            return self._say(self._request[1:], stamp_s)
        if byte == FAILED:
            self.outcome = Outcome.NOT_READY
        else:
            self.strays += 1
        return b""

    def _take_accepted(self, byte: int) -> bytes:
        if byte == FAILED:
            self.outcome = Outcome.REFUSED
        elif byte != OKAY:
            self.strays += 1
        elif self._request[0] in UNANSWERED:
            self.answer = Answer()
            self.outcome = Outcome.ANSWERED
        else:
            self.phase = Phase.ANSWER
        return b""

    def _take_answer(self, byte: int, stamp_s: float) -> bytes:
        if byte != Opcode.ANSWER:
            self.strays += 1
            return b""
        self.phase = Phase.REST
        self._received = bytearray((byte,))
        return self._say(_OKAY, stamp_s)

    def _take_rest(self, byte: int, stamp_s: float) -> bytes:
        """A frame of a length that cannot be right ends with the silence after it: the drive is still sending."""
        received = self._received
        received.append(byte)
        size = frame_size(received[1])
        if not may_answer(self._request, size - 4):
            return self._garbled(stamp_s) if len(received) > _LONGEST else b""
        if len(received) < size:
            return b""
        frame = parse_frame(bytes(received))
        answer = frame if isinstance(frame, str) else parse_answer(self._request, frame)
        if isinstance(answer, str):
            return self._garbled(stamp_s)
        self.answer = answer
        self.outcome = Outcome.ANSWERED
        return self._say(_OKAY, stamp_s)

    def _garbled(self, now_s: float) -> bytes:
        self.crc_errors += 1
        self.outcome = Outcome.GARBLED
        return self._say(_FAILED, now_s)
