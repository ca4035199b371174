"""Frames that an interface has no room for: they wait here, most urgent first, until they fit or are worthless."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from heapq import heapify, heappop, heappush

from drivers.bus.contract import ID_MASK, RTR_FLAG, BusCounters

QUEUE_DEPTH = 64
RETRY_S = 0.001

_Queued = tuple[int, int, int, bytes, float]
"""Priority on the wire, order of queueing, identifier with flags, what is transmitted, deadline."""


class TransmitQueue:
    """Sends at once where it can, else again every :data:`RETRY_S`. It is made closed.

    Args:
        transmit: hands a frame to the interface, its identifier and its data or whatever else was queued; False where
            that has no room or is gone, which closes the queue.
        counters: of the interface; counts what is dropped.
    """

    def __init__(self, transmit: Callable[[int, bytes], bool], counters: BusCounters) -> None:
        self._transmit = transmit
        self._counters = counters
        self._open = False
        self._pending: list[_Queued] = []
        self._order = 0
        self._retry: asyncio.TimerHandle | None = None

    def open(self) -> None:
        """Take frames from now on."""
        self._open = True

    def close(self) -> None:
        """The interface is gone: drop what waits, and what comes."""
        self._open = False
        if self._retry is not None:
            self._retry.cancel()
            self._retry = None
        self._counters.dropped_stale += len(self._pending)
        self._pending.clear()

    def send(self, can_id: int, data: bytes, deadline_s: float) -> None:
        """Send a frame, queue it, or drop it; arguments as :meth:`drivers.bus.contract.Bus.send`."""
        if self._open and not self._pending and self._transmit(can_id, data):
            return
        if not self._open:
            self._counters.dropped_stale += 1
            return
        if len(self._pending) >= QUEUE_DEPTH:
            self._drop_stale()
        if len(self._pending) >= QUEUE_DEPTH:
            self._counters.dropped_full += 1
            return
        self._order += 1
        priority = (can_id & ID_MASK) << 1 | (can_id & RTR_FLAG != 0)
        heappush(self._pending, (priority, self._order, can_id, data, deadline_s))
        self._try_again()

    def _try_again(self) -> None:
        if self._retry is None:
            self._retry = asyncio.get_running_loop().call_later(RETRY_S, self._send_pending)

    def _send_pending(self) -> None:
        self._retry = None
        self._drop_stale()
        while self._pending:
            queued = heappop(self._pending)
            if self._transmit(queued[2], queued[3]):
                continue
            if not self._open:
                self._counters.dropped_stale += 1
                return
            heappush(self._pending, queued)
            self._try_again()
            return

    def _drop_stale(self) -> None:
        now = asyncio.get_running_loop().time()
        wanted = [queued for queued in self._pending if queued[4] >= now]
        self._counters.dropped_stale += len(self._pending) - len(wanted)
        heapify(wanted)
        self._pending[:] = wanted
