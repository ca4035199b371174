"""The pace of the control cycle on the kernel's CAN: the kernel sends SYNC, and each SYNC begins a cycle.

The kernel's timer keeps the period of SYNC while Python is busy. It has a count of frames to go that each cycle renews,
so SYNC ends :data:`AHEAD_S` after a daemon began to hang, and at once when its process dies.

Where SYNC stays away, because the bus is down or nobody acknowledges, a timer ticks instead, and the cycle sends its
own SYNC, which goes stale and is dropped when it cannot go out. As soon as one of those was on the wire the kernel goes
on.
"""

from __future__ import annotations

import asyncio
import logging
import math
from collections.abc import Callable

from drivers.bus.broadcast_manager import RepeatedFrame
from drivers.bus.socketcan import SocketCanBus
from drivers.canopen.nmt import SYNC_COB_ID

LOGGER = logging.getLogger("canhelm.bus")

AHEAD_S = 0.25
"""How long SYNC goes on without a cycle: a longer pause than a loaded machine makes, less than a node's life time."""
PATIENCE = 2.5
"""Periods without a SYNC after which the timer ticks."""
WORTH_TELLING_S = 1.0
"""How long the kernel's SYNC stays away before somebody has to know: a pause of this process alone ends sooner."""


class SyncPace:
    """Ticks for :class:`daemon.runtime.cycle.Cycle`, with each SYNC on the wire.

    Args:
        bus: the interface; shows SYNC when it was on the wire.
        period_s: time between two SYNCs.
        callback: called at each tick; must not block.

    Attributes:
        max_lateness_s: worst delay of a tick behind its SYNC.
        missed: SYNCs that came to be seen only after the next one was due, and that therefore were no tick.
        synced: whether the present tick is a SYNC.
    """

    def __init__(self, bus: SocketCanBus, period_s: float, callback: Callable[[], None]) -> None:
        self.max_lateness_s = 0.0
        self.missed = 0
        self.synced = False
        self._name = bus.name
        self._period_s = period_s
        self._callback = callback
        self._frame = RepeatedFrame(bus.name, SYNC_COB_ID, b"", period_s, max(2, math.ceil(AHEAD_S / period_s)))
        self._by_kernel = False
        self._seen = False
        self._missed_since_s = 0.0
        self._told_missing: bool | None = None
        self._timer: asyncio.TimerHandle | None = None
        self._due_s = 0.0
        bus.hear(SYNC_COB_ID, self._on_sync)

    def start(self) -> None:
        """Tick from now on, on the running loop."""
        self._loop = asyncio.get_running_loop()
        self._missed_since_s = self._loop.time()
        self._expect(self._loop.time() + self._period_s)

    def stop(self) -> None:
        """Tick no more; SYNC ends."""
        self._frame.close()
        self._by_kernel = False
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def _expect(self, due_s: float) -> None:
        """Tick by the timer then, if nothing else does before."""
        if self._timer is not None:
            self._timer.cancel()
        self._due_s = due_s
        self._timer = self._loop.call_at(due_s, self._on_timer)

    def _on_sync(self, can_id: int, data: bytes, timestamp_s: float) -> None:
        """A SYNC was on the wire; it is a tick unless it is the cycle's own, or old."""
        self._seen = True
        if self._timer is None or not self._by_kernel:
            return
        now = self._loop.time()
        lateness_s = now - timestamp_s
        self.max_lateness_s = max(self.max_lateness_s, lateness_s)
        if lateness_s >= self._period_s:
            self.missed += 1
            self._expect(now + self._period_s)  # the next one is due by then
            return
        self._frame.renew()
        self._expect(now + PATIENCE * self._period_s)
        self.synced = True
        self._callback()

    def _on_timer(self) -> None:
        now = self._loop.time()
        if self._by_kernel:
            self._frame.stop()
            self._by_kernel = False
            self._missed_since_s = now
        elif self._seen and self._frame.start():
            self._by_kernel = True
            self._tell(missing=False)
            self._expect(now + PATIENCE * self._period_s)
            return
        elif now - self._missed_since_s > WORTH_TELLING_S:
            self._tell(missing=True)
        self._seen = False
        self.max_lateness_s = max(self.max_lateness_s, now - self._due_s)
        self._expect(max(now, self._due_s + self._period_s))
        self.synced = False
        self._callback()

    def _tell(self, *, missing: bool) -> None:
        """Let the log know what has changed since it was told last."""
        if missing and not self._told_missing:
            LOGGER.warning("no SYNC of the kernel on %s: the daemon sends it until one gets through", self._name)
        elif not missing and self._told_missing is not False:
            LOGGER.info("SYNC on %s comes from the kernel", self._name)
        self._told_missing = missing
