"""The pace of the control cycle on a serial line: the next cycle begins when the line has nothing left to do."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

from drivers.epos.serial_bus import SerialGatewayBus

SHORTEST_S = 0.005
"""Cycles do not follow each other faster, for instance while no node is there to be read."""


class LinePace:
    """Ticks for :class:`daemon.runtime.cycle.Cycle`, as fast as the line allows.

    Args:
        bus: tells when its cyclic requests are done.
        latest_s: a tick comes at the latest after this time, so that a line that hangs does not stop the watch.
        period_s: nominal period.
        callback: called at each tick; must not block.

    Attributes:
        max_lateness_s: worst delay of a tick behind the nominal period.
        synced: never; the cycle sends the SYNC that begins the readings.
    """

    def __init__(self, bus: SerialGatewayBus, latest_s: float, period_s: float, callback: Callable[[], None]) -> None:
        self.max_lateness_s = 0.0
        self.synced = False
        self._latest_s = latest_s
        self._period_s = period_s
        self._callback = callback
        self._timer: asyncio.TimerHandle | None = None
        self._last_s = 0.0
        bus.on_idle = self._on_idle

    def start(self) -> None:
        """Tick from now on, on the running loop."""
        self._loop = asyncio.get_running_loop()
        self._last_s = self._loop.time()
        self._timer = self._loop.call_later(self._latest_s, self._tick)

    def stop(self) -> None:
        """Tick no more."""
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def _on_idle(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = self._loop.call_at(self._last_s + SHORTEST_S, self._tick)

    def _tick(self) -> None:
        now = self._loop.time()
        self.max_lateness_s = max(self.max_lateness_s, now - self._last_s - self._period_s)
        self._last_s = now
        self._timer = self._loop.call_later(self._latest_s, self._tick)
        self._callback()
