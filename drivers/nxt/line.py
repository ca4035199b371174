"""The host's end of the line to an NXT: requests queue up, one is outstanding, a reply that stays away ends the line.

A Bluetooth connection loses nothing: where no reply comes in time, brick or connection are gone. So the line is given
up as a whole, and no late reply can be taken for that of another request.
"""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, Protocol

from canhelm.errors import Aborted, BusOff, CanhelmError, NotReady, Timeout
from drivers.nxt.codes import OK, Output, status_of
from drivers.nxt.layout import Telegram
from drivers.nxt.requests import SetOutputState
from drivers.nxt.telegrams import Reply, Unframer, make_frame, make_request, parse_reply

QUEUE_DEPTH: Final = 64
REPLY_TIMEOUT_S: Final = 0.9
_REMEDY: Final = "is the brick switched on, in reach, and no other program connected to it?"


class Port(Protocol):
    """The bytes below: a terminal, or a simulated connection.

    Attributes:
        host: takes bytes of the brick and the loop time at which they came.
    """

    host: Callable[[bytes, float], None] | None

    def write(self, data: bytes) -> None:
        """Send bytes; never blocks."""

    def close(self) -> None:
        """Close the connection."""


@dataclass(slots=True)
class LineCounters:
    """What went over the line."""

    sent: int = 0
    replies: int = 0
    bad_replies: int = 0
    """Telegrams that are no replies."""
    unexpected: int = 0
    """Replies that nobody waited for."""
    refusals: int = 0
    """Replies with a status other than 0."""
    dropped_bytes: int = 0
    """Bytes in which no telegram could be found."""


@dataclass(slots=True, eq=False)
class _Job:
    content: Telegram
    waiter: asyncio.Future[Telegram | None] | None
    """None for a request that wants no reply."""


class BrickLine:
    """Sends requests and hands their replies back; make it on the running loop.

    Args:
        port: carries the bytes; closed with the line.
        name: how people call it, for instance its device.
        reply_timeout_s: longest time to wait for a reply.

    Attributes:
        counters: what went over it.
        dead: gets the reason when the line is given up.
    """

    def __init__(self, port: Port, name: str, reply_timeout_s: float = REPLY_TIMEOUT_S) -> None:
        self.counters = LineCounters()
        self._loop = asyncio.get_running_loop()
        self.dead: asyncio.Future[CanhelmError] = self._loop.create_future()
        self._port = port
        self._name = name
        self._reply_timeout_s = reply_timeout_s
        self._unframer = Unframer()
        self._queue: deque[_Job] = deque()
        self._job: _Job | None = None
        self._timer: asyncio.TimerHandle | None = None
        port.host = self._receive

    async def ask(self, content: Telegram) -> Telegram | None:
        """Send a request and wait for its reply.

        Returns:
            What was asked for; None where the reply is only that all went well.

        Raises:
            Aborted: the brick refused; the status is in ``value``.
            Timeout: it did not reply; the line is given up.
            NotReady: too many requests are waiting.
            BusOff: the line is down.
        """
        waiter: asyncio.Future[Telegram | None] = self._loop.create_future()
        self._submit(_Job(content, waiter))
        return await waiter

    def send(self, content: Telegram) -> None:
        """Send a request that wants no reply, after those that wait. Raises NotReady, BusOff."""
        self._submit(_Job(content, None))

    def send_first(self, content: SetOutputState) -> None:
        """Send an order to a motor, or to all, before all that waits; those that wait for it are forgotten."""
        self._queue = deque(job for job in self._queue if not _is_overtaken(job.content, content.port))
        self._queue.appendleft(_Job(content, None))
        self._next()

    def _submit(self, job: _Job) -> None:
        if self.dead.done():
            raise self.dead.result()
        if len(self._queue) >= QUEUE_DEPTH:
            raise NotReady(f"too many requests wait for {self._name}", remedy="ask for less at a time")
        self._queue.append(job)
        self._next()

    def _next(self) -> None:
        while self._queue and self._job is None and not self.dead.done():
            job = self._queue.popleft()
            if job.waiter is None:
                self._write(job)
            elif not job.waiter.done():
                self._job = job
                self._timer = self._loop.call_later(self._reply_timeout_s, self._on_silence)
                self._write(job)

    def _write(self, job: _Job) -> None:
        self.counters.sent += 1
        self._port.write(make_frame(make_request(job.content, reply=job.waiter is not None)))

    def _receive(self, data: bytes, _: float) -> None:
        for telegram in self._unframer.feed(data):
            reply = parse_reply(telegram)
            if isinstance(reply, str):
                self.counters.bad_replies += 1
            elif self._job is None or reply.opcode != self._job.content.OPCODE:
                self.counters.unexpected += 1
            else:
                self._conclude(self._job, reply)
        self.counters.dropped_bytes = self._unframer.dropped

    def _conclude(self, job: _Job, reply: Reply) -> None:
        self.counters.replies += 1
        self._release()
        if job.waiter is not None and not job.waiter.done():
            if reply.status == OK:
                job.waiter.set_result(reply.content)
            else:
                self.counters.refusals += 1
                job.waiter.set_exception(self._refusal(job.content, reply.status))
        self._next()

    def _release(self) -> None:
        self._job = None
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def _refusal(self, content: Telegram, code: int) -> Aborted:
        status = status_of(code)
        message = f"the brick on {self._name} refused {type(content).__name__}: {status.meaning} (0x{code:02X})"
        return Aborted(message, value=code, remedy=status.remedy)

    def _on_silence(self) -> None:
        job = self._job
        assert job is not None
        what = type(job.content).__name__
        self.give_up(Timeout(f"the brick on {self._name} did not reply to {what} in time", remedy=_REMEDY))

    def lose(self, reason: str) -> None:
        """The connection has vanished."""
        self.give_up(BusOff(f"the connection to the brick on {self._name} is gone: {reason}", remedy=_REMEDY))

    def give_up(self, error: CanhelmError) -> None:
        """End the line: what waits fails with ``error``, and so does what comes. No effect on one that has ended."""
        if self.dead.done():
            return
        jobs = [*self._queue] if self._job is None else [self._job, *self._queue]
        self._release()
        self._queue.clear()
        self._port.close()
        self.dead.set_result(error)
        for job in jobs:
            if job.waiter is not None and not job.waiter.done():
                job.waiter.set_exception(error)


def _is_overtaken(content: Telegram, port: int) -> bool:
    return isinstance(content, SetOutputState) and port in (content.port, Output.ALL)
