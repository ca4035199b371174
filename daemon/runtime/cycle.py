"""The control cycle: SYNC out, readings in, one step, targets out."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from daemon.runtime.clock import Ticker
from drivers.canopen.master import Master
from drivers.contract import NodeState
from drivers.devices import Devices

LONGEST_STEP = 5
"""Periods; a step that comes later is told that it were this late, so that no law leaps."""


class Pace(Protocol):
    """What ticks once a cycle."""

    max_lateness_s: float
    """Worst delay of a tick behind its time."""
    synced: bool
    """Whether the tick is a SYNC that was on the wire; the cycle sends one otherwise."""

    def start(self) -> None:
        """Tick from now on, on the running loop."""

    def stop(self) -> None:
        """Tick no more."""


@dataclass(slots=True)
class CycleCounters:
    """How the cycle fares.

    Attributes:
        cycles: steps run.
        late_cycles: steps that ended after their period, and ticks that came a period late or more.
        incomplete: steps that ran without some node's reading.
        max_lateness_s: worst delay of a tick behind its time.
        achieved_hz: cycles a second, over the last second or so.
    """

    cycles: int = 0
    late_cycles: int = 0
    incomplete: int = 0
    max_lateness_s: float = 0.0
    achieved_hz: float = 0.0


class Cycle:
    """Runs ``step(now_s, dt_s)`` once per period, as soon as every node's reading of the cycle is there.

    A good cycle, one whose step ended in time, sends the guard requests that are due; so a daemon that hangs
    stops guarding and its drives stop by themselves.

    Args:
        master: sends SYNC and guard requests.
        devices: tell of each reading.
        period_s: the cycle's period.
        step: the control step; must not block.
        pace: makes what ticks, from period and callback.
        reading_share: share of the period that the readings may take before the step runs without those that are
            missing.
        good_within: periods within which a cycle has to end to be a good one.

    Attributes:
        on_good: called with the loop's time at the end of each good cycle.
    """

    def __init__(
        self,
        master: Master,
        devices: Devices,
        period_s: float,
        step: Callable[[float, float], None],
        pace: Callable[[float, Callable[[], None]], Pace] = Ticker,
        reading_share: float = 0.5,
        good_within: float = 1.0,
    ) -> None:
        self.counters = CycleCounters()
        self.period_s = period_s
        self.on_good: Callable[[float], None] | None = None
        self._master = master
        self._devices = devices
        self._step = step
        self._reading_s = reading_share * period_s
        self._good_s = good_within * period_s
        self._ticker = pace(period_s, self._tick)
        self._missing: set[int] = set()
        self._waiting = False
        self._tick_s = 0.0
        self._last_step_s: float | None = None
        self._mark = (0.0, 0)
        self._deadline: asyncio.TimerHandle | None = None
        devices.on_reading = self._on_reading

    def start(self) -> None:
        """Begin ticking on the running loop."""
        self._loop = asyncio.get_running_loop()
        self._ticker.start()

    def stop(self) -> None:
        """End ticking."""
        self._ticker.stop()
        if self._deadline is not None:
            self._deadline.cancel()

    def _tick(self) -> None:
        if self._waiting:
            self._run()
        self._tick_s = self._loop.time()
        ready = NodeState.READY
        self._missing = {node for node, device in self._devices.by_node.items() if device.node_state is ready}
        if not self._ticker.synced:
            self._master.sync()
        self._waiting = True
        if self._missing:
            self._deadline = self._loop.call_at(self._tick_s + self._reading_s, self._on_deadline)
        else:
            self._run()

    def _on_reading(self, node: int) -> None:
        if self._waiting:
            self._missing.discard(node)
            if not self._missing:
                self._run()

    def _on_deadline(self) -> None:
        if self._waiting:
            self.counters.incomplete += 1
            self._run()

    def _run(self) -> None:
        self._waiting = False
        now = self._loop.time()
        dt = self.period_s if self._last_step_s is None else min(now - self._last_step_s, LONGEST_STEP * self.period_s)
        self._last_step_s = now
        self._step(now, dt)
        if self._deadline is not None:
            self._deadline.cancel()
            self._deadline = None
        counters = self.counters
        counters.cycles += 1
        if now >= self._mark[0] + 1.0:
            counters.achieved_hz = (counters.cycles - self._mark[1]) / (now - self._mark[0])
            self._mark = (now, counters.cycles)
        end = self._loop.time()
        lateness = self._ticker.max_lateness_s
        counters.max_lateness_s = max(counters.max_lateness_s, lateness)
        if end <= self._tick_s + self._good_s:
            self._master.guard_due(end)
            if self.on_good is not None:
                self.on_good(end)
        else:
            counters.late_cycles += 1
