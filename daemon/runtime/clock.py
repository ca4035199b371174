"""The one clock: virtual time, patient time for simulated robots, and the ticker that paces the control cycle.

Time is the running loop's ``time()``. On a :class:`VirtualTimeLoop` it starts at zero and jumps to the next timer as
soon as nothing is ready, so a program runs as fast as the processor goes and the same way each time. On a
:class:`PatientLoop` it is real time without that in which the machine let the process wait.
"""

from __future__ import annotations

import asyncio
import collections
import ctypes
import heapq
import os
import time
from collections.abc import Callable, Coroutine
from concurrent.futures import Executor
from contextvars import Context
from selectors import SelectorKey, SelectSelector
from typing import Any, TypeVar, TypeVarTuple, Unpack

from daemon.runtime.time_lapse import TimeLapse

T = TypeVar("T")
Ts = TypeVarTuple("Ts")


class Deadlock(RuntimeError):
    """Everything on a virtual-time loop waits for something that can no longer happen."""


class VirtualTimeLoop(asyncio.BaseEventLoop):
    """An event loop without a clock, sockets, signals and threads.

    Timers run in the order of their times, and those of one time in the order in which they were set. The scheduler is
    its own because asyncio's leaves the order of equal times open.
    """

    _ready: collections.deque[asyncio.Handle]
    _stopping: bool

    def __init__(self) -> None:
        super().__init__()
        self._now_s = 0.0
        self._timers: list[tuple[float, int, asyncio.TimerHandle]] = []
        self._timers_set = 0

    def time(self) -> float:
        """Virtual time in seconds since the loop was made."""
        return self._now_s

    def call_at(
        self, when: float, callback: Callable[[Unpack[Ts]], object], *args: *Ts, context: Context | None = None
    ) -> asyncio.TimerHandle:
        """Run ``callback(*args)`` at virtual time ``when``; a time that has passed means now."""
        handle = asyncio.TimerHandle(when, callback, args, self, context)
        self._timers_set += 1
        heapq.heappush(self._timers, (when, self._timers_set, handle))
        return handle

    def jump_to(self, when: float) -> bool:
        """Let the running callback go on at virtual time ``when``, which spares it a timer of its own.

        Returns:
            False, with the time as it was, where anything else is to run up to then.
        """
        timers = self._timers
        if self._ready or self._stopping or (timers and timers[0][0] <= when):
            return False
        if when > self._now_s:
            self._now_s = when
        return True

    def run_in_executor(
        self, executor: Executor | None, func: Callable[[Unpack[Ts]], T], *args: *Ts
    ) -> asyncio.Future[T]:
        """Refused: a thread takes real time, which would make the run depend on the machine."""
        raise RuntimeError("virtual time has no threads: run this on a real loop")

    def close(self) -> None:
        """Drop all timers and close the loop."""
        super().close()
        self._timers.clear()

    def _run_once(self) -> None:
        ready = self._ready
        if not ready:
            self._advance()
            if not ready:
                raise Deadlock("nothing is ready and no timer is set: what is awaited cannot happen any more")
        for _ in range(len(ready)):
            handle = ready.popleft()
            if not handle._cancelled:
                handle._run()

    def _advance(self) -> None:
        """Jump to the next timer and make it and all others of that time ready."""
        timers, ready = self._timers, self._ready
        while timers and (timers[0][0] <= self._now_s or not ready):
            when, _, handle = heapq.heappop(timers)
            if not handle._cancelled:
                ready.append(handle)
                if when > self._now_s:
                    self._now_s = when

    def _write_to_self(self) -> None:
        """What call_soon_threadsafe and signal handlers wake a sleeping loop with; this one never sleeps."""


def run_virtual(coro: Coroutine[Any, Any, T]) -> T:
    """Run a coroutine to its end on virtual time, as ``asyncio.run`` does in real time.

    Raises:
        Deadlock: the coroutine waits, and nothing is left that could wake it.
    """
    with asyncio.Runner(loop_factory=VirtualTimeLoop) as runner:
        return runner.run(coro)


def run_precise(coro: Coroutine[Any, Any, T]) -> T:
    """Run a coroutine to its end in real time with timers that are late by tens of microseconds, for simulated wires.

    The loop of ``asyncio.run`` waits in whole milliseconds (epoll), ten bytes on a serial line; select(2) waits in
    microseconds and serves up to 1024 descriptors.
    """
    with asyncio.Runner(loop_factory=lambda: asyncio.SelectorEventLoop(SelectSelector())) as runner:
        return runner.run(coro)


class PatientLoop(asyncio.SelectorEventLoop):
    """An event loop whose clock stands still while the machine keeps it waiting, for robots simulated in its process.

    A busy machine lets a process wait for hundreds of milliseconds. A real robot goes on meanwhile and has to be
    stopped; a simulated one waits with its master, so neither is to take the other for dead. What the process itself
    computes counts as time; what it spends without a processor, or blocked in a call, beyond ``GRACE_S`` at once does
    not.

    The clock may be made to pass faster or slower. Clients and the service manager live outside of the simulation: what
    they promise is judged by :func:`outside_s`.

    Attributes:
        stood_still_s: how much was left out since the loop was made.
    """

    GRACE_S = 0.001

    def __init__(self) -> None:
        self.stood_still_s = 0.0
        self._ahead_s = 0.0
        self._lapse: TimeLapse | None = None
        self._seen_s, self._seen_processor_s = time.monotonic(), time.thread_time()
        super().__init__(_PatientSelector(self))

    def time(self) -> float:
        """Seconds of a clock that never goes back; its zero is the monotonic clock's until :meth:`set_pace`."""
        outside_s = self.outside_s()
        return outside_s + self._ahead_s if self._lapse is None else self._lapse.computed(outside_s)

    @property
    def pace(self) -> float:
        """How many seconds of the loop pass in one outside."""
        return 1.0 if self._lapse is None else self._lapse.factor

    def set_pace(self, factor: float) -> None:
        """Let time pass so many times as fast from now on; it makes no jump."""
        now_s = self.time()
        outside_s = self._seen_s - self.stood_still_s
        self._lapse = None if factor == 1.0 else TimeLapse(factor, outside_s, now_s)
        self._ahead_s = now_s - outside_s

    def outside_s(self) -> float:
        """Seconds of the same clock as it passes outside of the simulation."""
        now_s, processor_s = time.monotonic(), time.thread_time()
        self._leave_out(now_s - self._seen_s - (processor_s - self._seen_processor_s))
        self._seen_s, self._seen_processor_s = now_s, processor_s
        return now_s - self.stood_still_s

    def sleep_s(self, timeout_s: float | None) -> float | None:
        """How long to sleep outside for a timer that is so far away by the loop; None: as long as it takes."""
        self.time()
        return timeout_s if timeout_s is None or self._lapse is None else self._lapse.sleep_s(timeout_s)

    def slept(self, timeout_s: float | None, wanted_s: float | None) -> None:
        """A sleep has ended.

        Args:
            timeout_s: how far away the next timer was by the loop; None: there was none.
            wanted_s: how long the sleep was to last at most.
        """
        now_s = time.monotonic()
        if wanted_s is not None:
            self._leave_out(now_s - self._seen_s - max(wanted_s, 0.0))
        self._seen_s, self._seen_processor_s = now_s, time.thread_time()
        if self._lapse is not None:
            self._lapse.slept(now_s - self.stood_still_s, timeout_s)

    def _leave_out(self, waited_s: float) -> None:
        if waited_s > self.GRACE_S:
            self.stood_still_s += waited_s - self.GRACE_S


class _PatientSelector(SelectSelector):
    """Tells its loop how long it was to sleep. Select(2) waits in microseconds and serves up to 1024 descriptors."""

    def __init__(self, loop: PatientLoop) -> None:
        super().__init__()
        self._loop = loop

    def select(self, timeout: float | None = None) -> list[tuple[SelectorKey, int]]:
        wanted_s = self._loop.sleep_s(timeout)
        events = super().select(wanted_s)
        self._loop.slept(timeout, wanted_s)
        return events


def run_patient(coro: Coroutine[Any, Any, T]) -> T:
    """Run a coroutine to its end on a :class:`PatientLoop`, as ``asyncio.run`` does in real time."""
    with asyncio.Runner(loop_factory=PatientLoop) as runner:
        return runner.run(coro)


def stood_still_s() -> float:
    """What the running loop's clock has left out, see :class:`PatientLoop`; 0 on any other loop."""
    loop = asyncio.get_running_loop()
    return loop.stood_still_s if isinstance(loop, PatientLoop) else 0.0


def outside_s() -> float:
    """Time for who lives outside of a simulation, clients and the service manager; on a real robot the loop's."""
    loop = asyncio.get_running_loop()
    return loop.outside_s() if isinstance(loop, PatientLoop) else loop.time()


def pace() -> float:
    """How many seconds of the running loop pass in one outside of its simulation."""
    loop = asyncio.get_running_loop()
    return loop.pace if isinstance(loop, PatientLoop) else 1.0


class Ticker:
    """Calls back once per period, at absolute deadlines that never drift.

    A tick that comes a whole period late or more is not made up for: the ticks in between are skipped and counted. In
    real time a timerfd ticks, because asyncio's own timers are late by up to a millisecond.

    Args:
        period_s: time between ticks; the first comes one period after :meth:`start`.
        callback: called at each tick; must not block.

    Attributes:
        ticks: calls made.
        missed: ticks skipped.
        late: calls made more than half a period behind their deadline.
        max_lateness_s: worst delay of a call behind its deadline.
        synced: never; who is called sends SYNC.
    """

    def __init__(self, period_s: float, callback: Callable[[], None]) -> None:
        self.period_s = period_s
        self.ticks = 0
        self.missed = 0
        self.late = 0
        self.max_lateness_s = 0.0
        self.synced = False
        self._callback = callback
        self._start_s = 0.0
        self._due = 0
        self._timer: asyncio.TimerHandle | None = None
        self._fd = -1

    @property
    def running(self) -> bool:
        """Whether it ticks."""
        return self._timer is not None or self._fd >= 0

    def start(self) -> None:
        """Tick from now on, on the running loop; no effect on a ticker that runs."""
        if self.running:
            return
        self._loop = asyncio.get_running_loop()
        self._start_s = self._loop.time()
        self._due = 0
        if isinstance(self._loop, VirtualTimeLoop | PatientLoop):  # their clocks are not the kernel's
            self._timer = self._loop.call_at(self._start_s + self.period_s, self._on_timer)
        else:
            self._fd = _periodic_timerfd(self._start_s + self.period_s, self.period_s)
            self._loop.add_reader(self._fd, self._on_timerfd)

    def stop(self) -> None:
        """Tick no more."""
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        if self._fd >= 0:
            self._loop.remove_reader(self._fd)
            os.close(self._fd)
            self._fd = -1

    def _on_timer(self) -> None:
        late_s = self._loop.time() - self._deadline_s(self._due + 1)
        expired = 1 + max(0, int(late_s / self.period_s))
        self._timer = self._loop.call_at(self._deadline_s(self._due + expired + 1), self._on_timer)
        self._tick(expired)

    def _on_timerfd(self) -> None:
        try:
            expired = int.from_bytes(os.read(self._fd, 8), "little")
        except BlockingIOError:
            return
        self._tick(expired)

    def _deadline_s(self, tick: int) -> float:
        return self._start_s + tick * self.period_s

    def _tick(self, expired: int) -> None:
        """Call back once for all the ticks whose time has come."""
        lateness_s = self._loop.time() - self._deadline_s(self._due + 1)
        self._due += expired
        self.missed += expired - 1
        self.max_lateness_s = max(self.max_lateness_s, lateness_s)
        self.late += lateness_s > 0.5 * self.period_s
        self.ticks += 1
        self._callback()


_TFD_TIMER_ABSTIME = 1


class _Itimerspec(ctypes.Structure):
    _fields_ = (
        ("interval_s", ctypes.c_long),
        ("interval_ns", ctypes.c_long),
        ("value_s", ctypes.c_long),
        ("value_ns", ctypes.c_long),
    )


def _periodic_timerfd(first_s: float, period_s: float) -> int:
    """A non-blocking timerfd on the monotonic clock, which is the one of asyncio's loops (timerfd_create(2))."""
    libc = ctypes.CDLL(None, use_errno=True)
    fd = int(libc.timerfd_create(time.CLOCK_MONOTONIC, os.O_NONBLOCK | os.O_CLOEXEC))
    if fd < 0:
        raise OSError(ctypes.get_errno(), "timerfd_create failed")
    spec = _Itimerspec(*divmod(round(period_s * 1e9), 1_000_000_000), *divmod(round(first_s * 1e9), 1_000_000_000))
    if libc.timerfd_settime(fd, _TFD_TIMER_ABSTIME, ctypes.byref(spec), None) < 0:
        os.close(fd)
        raise OSError(ctypes.get_errno(), "timerfd_settime failed")
    return fd
