"""Work on a disk, in order and away from the control cycle: a card that is busy keeps nobody waiting."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from functools import partial

from daemon.runtime.clock import VirtualTimeLoop
from drivers.simulated.computer_trouble import ComputerTrouble

PAUSE_S = 0.01
"""Between two jobs that leave the control cycle its time."""
PENDING_LIMIT_BYTES = 8_000_000
"""What may wait for a slow disk; more is thrown away."""


class Disk:
    """Carries out jobs one after the other in a thread of its own; on virtual time at once, in the loop's.

    Args:
        on_failure: called in the loop when a job has failed for what the disk said.
        trouble: what faults make of a simulated robot's computer.
    """

    def __init__(self, on_failure: Callable[[OSError], None], trouble: ComputerTrouble) -> None:
        self._loop = asyncio.get_running_loop()
        self._on_failure = on_failure
        self._trouble = trouble
        self._pending_bytes = 0
        self._waiting: deque[tuple[Callable[[], None], int]] = deque()
        self._timer: asyncio.TimerHandle | None = None
        virtual = isinstance(self._loop, VirtualTimeLoop)
        self._pool = None if virtual else ThreadPoolExecutor(1, "canhelm-runs")

    def do(self, job: Callable[[], None], size_bytes: int = 0) -> bool:
        """Carry out a job when its turn comes; False where too much waits already.

        Args:
            job: raises OSError where the disk fails.
            size_bytes: what it keeps in memory until then; jobs without any are always taken.
        """
        if size_bytes and self._pending_bytes + size_bytes > PENDING_LIMIT_BYTES:
            return False
        self._pending_bytes += size_bytes
        if self._timer is None and not self._trouble.disk_delay_s:
            self._carry_out(job, size_bytes)
        else:
            self._waiting.append((job, size_bytes))
            self._timer = self._timer or self._loop.call_later(self._trouble.disk_delay_s, self._take_turn)
        return True

    def _carry_out(self, job: Callable[[], None], size_bytes: int) -> None:
        if self._pool is not None:
            self._pool.submit(job).add_done_callback(partial(self._done_in_thread, size_bytes))
            return
        error: BaseException | None = None
        try:
            job()
        except OSError as failure:
            error = failure
        self._done(size_bytes, error)

    def do_in_turns(self, *jobs: Callable[[], None]) -> None:
        """Carry out jobs that compute for a while, with pauses in between: threads share one interpreter."""
        self._waiting.extend((job, 0) for job in jobs)
        if self._timer is None:
            self._take_turn()

    def _take_turn(self) -> None:
        self._timer = None
        if self._waiting:
            self._carry_out(*self._waiting.popleft())
            self._timer = self._loop.call_later(max(PAUSE_S, self._trouble.disk_delay_s), self._take_turn)

    def close(self) -> None:
        """Wait until everything is done."""
        if self._timer is not None:
            self._timer.cancel()
        while self._waiting:
            self._carry_out(*self._waiting.popleft())
        if self._pool is not None:
            self._pool.shutdown()

    def _done_in_thread(self, size_bytes: int, future: Future[None]) -> None:
        self._loop.call_soon_threadsafe(self._done, size_bytes, future.exception())

    def _done(self, size_bytes: int, error: BaseException | None) -> None:
        self._pending_bytes -= size_bytes
        if isinstance(error, OSError):
            self._on_failure(error)
        elif error is not None:
            raise error
