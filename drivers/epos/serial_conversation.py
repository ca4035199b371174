"""One exchange after the other on a serial line: bytes out and in, patience, and silence after a broken conversation.

An answer does not say what it answers. It counts for the request whose handshake stands around it and for no other, so
after a broken conversation nothing is said until the drive has been silent for longer than it keeps waiting.
"""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from drivers.bus.wire_time import LoadMeter
from drivers.epos.serial_answers import Answer
from drivers.epos.serial_frames import MAX_WORDS, frame_size
from drivers.epos.serial_handshake import BITS_PER_BYTE, Exchange, Outcome, Phase

_FILLER = bytes(frame_size(MAX_WORDS - 1))
"""Ends any frame whose rest a drive may still be waiting for: the CRC of what it completes is wrong."""
_UNHEARD_BEFORE_FILLER = 2
STALL_S = 0.005
"""A timer that is later than this tells of a process that stood still."""
GRACE_S = 0.02


@dataclass(frozen=True, slots=True)
class SerialTiming:
    """How long the host waits.

    Attributes:
        acknowledge_s: for an acknowledge, beyond the time that the bytes take.
        answer_s: for the first byte of an answer; longer than a gateway waits for a dead node.
        byte_s: for the next byte of an answer; adapters on USB hand bytes over every 16 ms.
        pause_s: of silence before what the drive refused is sent again.
        silence_s: of silence after a broken conversation; longer than the 500 ms for which the drive waits for an
            acknowledge (maxon EPOS Communication Guide 6.2.5).
        longest_silence_s: a line that babbles on is spoken to again after this time.
    """

    acknowledge_s: float = 0.2
    answer_s: float = 1.0
    byte_s: float = 0.05
    pause_s: float = 0.02
    silence_s: float = 0.55
    longest_silence_s: float = 3.0


class Transport(Protocol):
    """The bytes below: a terminal, or a simulated cable.

    Attributes:
        host: takes bytes of the drive and the loop time at which the last of them ended.
    """

    host: Callable[[bytes, float], None] | None

    def write(self, data: bytes) -> None:
        """Send bytes; never blocks."""


@dataclass(slots=True)
class SerialCounters:
    """What went over a line since it was made.

    Attributes:
        exchanges: conversations that were begun.
        refused: requests that the drive was not ready for, or whose CRC it found wrong.
        unheard: requests without a ready acknowledge.
        lost: requests whose end acknowledge or answer did not come.
        resyncs: times that the line had to fall silent.
        disturbances: bytes that came while it had to be silent, or when nothing was asked.
        wire_s: time that the bytes of either direction took.
        own_idle_s: silence while it was the host's turn: from the drive's last byte to the host's next one, and after
            the host's last acknowledge to the next request.
    """

    sent_bytes: int = 0
    received_bytes: int = 0
    exchanges: int = 0
    refused: int = 0
    unheard: int = 0
    lost: int = 0
    resyncs: int = 0
    disturbances: int = 0
    wire_s: float = 0.0
    own_idle_s: float = 0.0


class Conversation:
    """What is being said on the line; make it on the running loop.

    Args:
        transport: carries the bytes.
        baud: bit/s.
        exchange: how one request and its answer go over the line.
        timing: how long to wait.
        on_end: called when an exchange has ended and the line is free for the next one.

    Attributes:
        counters: what went over the line.
        exchange: as above; holds the answer.
    """

    def __init__(
        self,
        transport: Transport,
        baud: int,
        exchange: Exchange,
        timing: SerialTiming,
        on_end: Callable[[Outcome], None],
    ) -> None:
        self.counters = SerialCounters()
        self.exchange = exchange
        self._loop = asyncio.get_running_loop()
        self._timing = timing
        self._patience_s = {
            Phase.READY: timing.acknowledge_s,
            Phase.ACCEPTED: timing.acknowledge_s,
            Phase.ANSWER: timing.answer_s,
            Phase.REST: timing.byte_s,
            Phase.SENDING: 0.0,
        }
        self._on_end = on_end
        self._byte_s = BITS_PER_BYTE / baud
        self._meter = LoadMeter(baud)
        self._asking = False
        self._timer: asyncio.TimerHandle | None = None
        self._outcome = Outcome.ANSWERED
        self._silence_s = 0.0
        self._silent_by_s = 0.0
        self._disturbed = False
        self._unheard = 0
        self._our_turn_s = math.inf
        self._due_s = math.inf
        self._stalled = False
        self._transport = transport
        transport.host = self.receive

    def attach(self, transport: Transport) -> None:
        """Speak over another transport from now on; the one before is not listened to any more."""
        self._transport.host = None
        self._transport = transport
        transport.host = self.receive

    @property
    def answer(self) -> Answer:
        """The answer of the last exchange that was answered."""
        return self.exchange.answer

    @property
    def heard(self) -> bool:
        """Whether the drive has taken the operation code of the exchange that runs, and with it the request."""
        return self.exchange.phase is not Phase.READY

    def load(self) -> float:
        """Share of the last second that bytes of either direction kept the line busy, 0 to 1."""
        return self._meter.load(self._loop.time())

    def begin(self, request: bytes) -> None:
        """Begin an exchange on a free line."""
        self.counters.exchanges += 1
        self._asking = True
        first = self.exchange.begin(request, self._loop.time())
        self._send(first)
        self._await_phase(len(first))

    def abandon(self) -> None:
        """Say nothing more and expect nothing: the line is gone."""
        self._asking = False
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def receive(self, data: bytes, stamp_s: float) -> None:
        """Take bytes of the drive, the last of which ended at ``stamp_s``."""
        self._our_turn_s = stamp_s
        self.counters.received_bytes += len(data)
        self._count(stamp_s, len(data))
        if not self._asking:
            self._disturb(len(data))
            return
        exchange, phase = self.exchange, self.exchange.phase
        reply = exchange.feed(data, stamp_s)
        if reply:
            self._send(reply)
        if exchange.outcome is not None:
            self._end(exchange.outcome)
        elif exchange.phase is not phase or phase is Phase.REST:
            self._await_phase(len(reply))

    def _send(self, data: bytes) -> None:
        now_s, counters = self._loop.time(), self.counters
        if now_s > self._our_turn_s:
            counters.own_idle_s += now_s - self._our_turn_s
        self._our_turn_s = math.inf
        counters.sent_bytes += len(data)
        self._count(now_s, len(data))
        self._transport.write(data)

    def _count(self, now_s: float, size: int) -> None:
        self.counters.wire_s += size * self._byte_s
        self._meter.add(now_s, size * BITS_PER_BYTE)

    def _await_phase(self, sent: int) -> None:
        """Wait for what comes next, beyond the time that the host's own bytes and the drive's first one take."""
        patience_s = self._patience_s[self.exchange.phase] + (sent + 1) * self._byte_s
        self._stalled = False
        self._due_s = self._loop.time() + patience_s
        self._wait(patience_s, self._on_silence)

    def _wait(self, delay_s: float, callback: Callable[[], None]) -> None:
        if self._timer is not None:
            self._timer.cancel()
        self._timer = self._loop.call_later(delay_s, callback)

    def _on_silence(self) -> None:
        """The drive says nothing more, unless this process stood still and what it said is waiting to be read."""
        if self._loop.time() - self._due_s > STALL_S and not self._stalled:
            self._stalled = True
            self._wait(GRACE_S, self._on_silence)
            return
        last_word = self.exchange.give_up(self._loop.time())
        if last_word:
            self._send(last_word)
        self._end(self.exchange.outcome or Outcome.LOST)

    # --- the end of an exchange ----------------------------------------------------------------------------------

    def _end(self, outcome: Outcome) -> None:
        self._asking = False
        self._our_turn_s = max(self._loop.time(), self.exchange.sent_s)
        if outcome is Outcome.ANSWERED:
            self._unheard = 0
            self.abandon()
            self._on_end(outcome)
            return
        counters = self.counters
        counters.refused += outcome in (Outcome.NOT_READY, Outcome.REFUSED)
        counters.unheard += outcome is Outcome.UNHEARD
        counters.lost += outcome in (Outcome.LOST, Outcome.GARBLED)
        quick = outcome in (Outcome.NOT_READY, Outcome.REFUSED, Outcome.GARBLED)
        self._fall_silent(outcome, self._timing.pause_s if quick else self._timing.silence_s)

    def _fall_silent(self, outcome: Outcome, silence_s: float) -> None:
        self.counters.resyncs += 1
        self._outcome, self._silence_s, self._disturbed = outcome, silence_s, False
        self._silent_by_s = self._loop.time() + self._timing.longest_silence_s
        self._unheard = self._unheard + 1 if outcome is Outcome.UNHEARD else 0
        if self._unheard == _UNHEARD_BEFORE_FILLER:
            self._unheard = 0
            self._send(_FILLER)
            silence_s += len(_FILLER) * self._byte_s
        self._wait(silence_s, self._resume)

    def _disturb(self, size: int) -> None:
        """Bytes that nobody asked for; silence begins anew."""
        self.counters.disturbances += size
        self._disturbed = True
        if self._timer is not None and self._loop.time() < self._silent_by_s:
            self._wait(self._silence_s, self._resume)

    def _resume(self) -> None:
        """Both ends are idle. A refusal that bytes followed was none: the drive went on with the request."""
        self._timer = None
        refused = self._outcome in (Outcome.NOT_READY, Outcome.REFUSED)
        self._on_end(Outcome.LOST if refused and self._disturbed else self._outcome)
