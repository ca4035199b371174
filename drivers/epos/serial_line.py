"""The host's end of the serial line to an EPOS: requests queue up, one is outstanding, the line recovers by itself.

What is repeated, and what is not: a request that the drive certainly has not carried out (it was not ready, or found
the CRC wrong) is sent again, and so is a read. Anything else whose answer is lost may have been carried out; it fails,
and the error says so. A request whose deadline passes keeps the line until the drive has answered it, though nobody
listens any more: so both ends stay in step.
"""

from __future__ import annotations

import asyncio
import math
from collections import deque
from collections.abc import Callable

from canhelm.errors import BusOff, CanhelmError
from drivers.epos import serial_errors
from drivers.epos.serial_answers import Answer
from drivers.epos.serial_conversation import Conversation, SerialCounters, SerialTiming, Transport
from drivers.epos.serial_frames import READS, Opcode
from drivers.epos.serial_handshake import Exchange, Handshake, Outcome

QUEUE_DEPTH = 64
MAX_TRIES = 3
REQUEST_TIMEOUT_S = 3.0
VAIN = 2
"""Exchanges in a row without an answer after which the line, and no node, is to blame."""

_NOT_CARRIED_OUT = frozenset((Outcome.NOT_READY, Outcome.REFUSED, Outcome.UNHEARD))
_RESTARTS = (129, 130)
"""NMT commands after which the end acknowledge may be missing, because the drive restarts."""

Done = Callable[[Answer | CanhelmError], None]


class _Job:
    """One request on its way; ``on_done`` is None when nobody waits for it any more."""

    __slots__ = ("deadline_s", "on_done", "request", "timer", "tries", "urgent")

    def __init__(self, request: bytes, on_done: Done, deadline_s: float, urgent: bool) -> None:
        self.request = request
        self.on_done: Done | None = on_done
        self.deadline_s = deadline_s
        self.urgent = urgent
        self.tries = 0
        self.timer: asyncio.TimerHandle | None = None


class SerialLine:
    """Sends requests and hands their answers back; make it on the running loop.

    Args:
        transport: carries the bytes.
        baud: bit/s.
        name: how people call the line, for instance its device.
        exchange: how one request and its answer go over the line; None for the first generation's handshake.
        timing: how long to wait.

    Attributes:
        down: why the line does not work; None while it does.
        retries: requests that were sent again.
        late_answers: answers to requests whose deadline had passed.
        failures: requests that failed; an abort code of a node is an answer.
        vain: exchanges in a row that were not answered.
    """

    def __init__(
        self,
        transport: Transport,
        baud: int,
        name: str = "",
        exchange: Exchange | None = None,
        timing: SerialTiming | None = None,
    ) -> None:
        self.baud = baud
        self.name = name or "the serial line"
        self.down: BusOff | None = None
        self.retries = 0
        self.late_answers = 0
        self.failures = 0
        self.vain = 0
        self._heard_bytes = 0
        self._loop = asyncio.get_running_loop()
        self._urgent: deque[_Job] = deque()
        self._others: deque[_Job] = deque()
        self._job: _Job | None = None
        self._began_s = self._loop.time()
        self._talk = Conversation(transport, baud, exchange or Handshake(baud), timing or SerialTiming(), self._on_end)

    @property
    def counters(self) -> SerialCounters:
        """What went over the line."""
        return self._talk.counters

    @property
    def crc_errors(self) -> int:
        """Damaged answers."""
        return self._talk.exchange.crc_errors

    @property
    def trouble(self) -> BusOff | None:
        """Why nothing is to be had from this line, as far as it is known; None while it works."""
        if self.down is not None or self.vain < VAIN:
            return self.down
        if self.counters.received_bytes > self._heard_bytes:
            return serial_errors.garbage(self.name, self.baud)
        return serial_errors.deaf(self.name, self.baud)

    def load(self) -> float:
        """Share of the last second that bytes of either direction kept the line busy, 0 to 1."""
        return self._talk.load()

    def utilisation(self) -> float:
        """Share of the time since the line was made that it was busy, 0 to 1."""
        return self.counters.wire_s / self._elapsed_s()

    def own_idle_share(self) -> float:
        """Share of the time since the line was made from the drive's last byte to the host's next one, 0 to 1."""
        return self.counters.own_idle_s / self._elapsed_s()

    def _elapsed_s(self) -> float:
        return max(self._loop.time() - self._began_s, 1e-9)

    # --- requests ------------------------------------------------------------------------------------------------

    async def request(self, request: bytes, timeout_s: float = REQUEST_TIMEOUT_S, urgent: bool = False) -> Answer:
        """Send one request frame and wait for its answer.

        Raises:
            Aborted: the drive, or the node behind it, refused; the code is in ``value``.
            Timeout: no good answer in time; the message says whether the request may have been carried out.
            NotReady: too many requests are waiting.
            BusOff: the line is down.
        """
        waiter: asyncio.Future[Answer | CanhelmError] = self._loop.create_future()

        def on_done(result: Answer | CanhelmError) -> None:
            if not waiter.done():
                waiter.set_result(result)

        self.submit(request, on_done, self._loop.time() + timeout_s, urgent)
        result = await waiter
        if isinstance(result, CanhelmError):
            raise result
        if result.error:
            raise serial_errors.aborted(request, result.error)
        return result

    def submit(self, request: bytes, on_done: Done, deadline_s: float = math.inf, urgent: bool = False) -> None:
        """Queue one request frame.

        Args:
            request: a whole frame of :mod:`drivers.epos.serial_frames`.
            on_done: called once, never from within this call: with the answer, whose ``error`` may be an abort code,
                or with the error that :meth:`request` would raise.
            deadline_s: loop time after which nobody wants the answer any more.
            urgent: goes before all that are not.
        """
        job = _Job(request, on_done, deadline_s, urgent)
        if self.down is not None or len(self._urgent) + len(self._others) >= QUEUE_DEPTH:
            self._fail(job, self.down or serial_errors.queue_full(request, self.name))
            return
        if deadline_s < math.inf:
            job.timer = self._loop.call_at(deadline_s, self._expire, job)
        self._queue_of(job).append(job)
        if self._job is None:
            self._next()

    def _queue_of(self, job: _Job) -> deque[_Job]:
        return self._urgent if job.urgent else self._others

    def _next(self) -> None:
        """Send what comes first; what is too late by now is not sent, even if its timer is late, too."""
        now_s = self._loop.time()
        queue = self._urgent or self._others
        while queue and self._job is None:
            job = queue.popleft()
            if job.deadline_s > now_s:
                self._job = job
                job.tries += 1
                self._talk.begin(job.request)
            else:
                self._fail(job, serial_errors.unsent(job.request, self.name))
            queue = self._urgent or self._others

    def _expire(self, job: _Job) -> None:
        """Nobody waits any more; what is on the line goes on to its end."""
        running = job is self._job
        if not running:
            self._queue_of(job).remove(job)
        if not job.tries:
            error = serial_errors.unsent(job.request, self.name)
        elif running and self._talk.heard:
            error = serial_errors.unanswered(job.request, self.name)
        else:
            error = serial_errors.unheard(job.request, self.name, self.baud)
        self._fail(job, error)

    def _on_end(self, outcome: Outcome) -> None:
        """An exchange has ended, and the line is free."""
        job, self._job = self._job, None
        if outcome is Outcome.ANSWERED:
            self.vain, self._heard_bytes = 0, self.counters.received_bytes
        else:
            self.vain += 1
        try:
            if job is not None:
                self._conclude(job, outcome)
        finally:
            if self._job is None:
                self._next()

    def _conclude(self, job: _Job, outcome: Outcome) -> None:
        """Report the result of a request, or put it back to be sent again."""
        if outcome is Outcome.ANSWERED:
            self._report(job, self._talk.answer)
        elif _restarts(job.request) and outcome is Outcome.LOST:
            self._report(job, Answer())
        elif job.on_done is not None and job.tries < MAX_TRIES and _may_repeat(job.request, outcome):
            self.retries += 1
            self._queue_of(job).appendleft(job)
        elif outcome in _NOT_CARRIED_OUT:
            self._fail(job, serial_errors.unheard(job.request, self.name, self.baud))
        else:
            self._fail(job, serial_errors.lost(job.request, self.name))

    def _fail(self, job: _Job, error: CanhelmError) -> None:
        """Tell on the loop's next turn: failures come in the middle of something else."""
        on_done = self._release(job)
        if on_done is not None:
            self.failures += 1
            self._loop.call_soon(on_done, error)

    def _report(self, job: _Job, answer: Answer) -> None:
        on_done = self._release(job)
        if on_done is not None:
            on_done(answer)
        else:
            self.late_answers += 1

    def _release(self, job: _Job) -> Done | None:
        """Who waits for this request; nobody does from now on."""
        if job.timer is not None:
            job.timer.cancel()
            job.timer = None
        on_done, job.on_done = job.on_done, None
        return on_done

    # --- the device below ----------------------------------------------------------------------------------------

    def lose(self, reason: str) -> None:
        """The device has vanished: what waits fails with BusOff, and so does what comes, until :meth:`attach`."""
        self.down = serial_errors.gone(self.name, reason)
        self._talk.abandon()
        jobs = [*self._urgent, *self._others] if self._job is None else [self._job, *self._urgent, *self._others]
        self._urgent.clear()
        self._others.clear()
        self._job = None
        for job in jobs:
            self._fail(job, self.down)

    def attach(self, transport: Transport) -> None:
        """Go on over another transport, for instance the same device opened again."""
        self._talk.attach(transport)
        self.down = None


def _may_repeat(request: bytes, outcome: Outcome) -> bool:
    return outcome in _NOT_CARRIED_OUT or request[0] in READS


def _restarts(request: bytes) -> bool:
    return request[0] == Opcode.SEND_NMT and request[4] in _RESTARTS
