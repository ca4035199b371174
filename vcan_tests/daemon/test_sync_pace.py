"""The pace by the kernel's SYNC, on virtual time, with a kernel that is played here."""

from __future__ import annotations

import asyncio
import logging
import math

import pytest

from daemon.runtime import sync_pace
from daemon.runtime.sync_pace import AHEAD_S, PATIENCE, SyncPace
from drivers.bus.contract import FrameHandler
from drivers.bus.socketcan import SocketCanBus
from drivers.canopen.nmt import SYNC_COB_ID

PERIOD_S = 0.01


class Wire(SocketCanBus):
    """An interface that is never opened; what would be on its wire is handed to who hears it."""

    def __init__(self) -> None:
        super().__init__("can0", 1_000_000)
        self.works = True
        self.handler: FrameHandler | None = None

    def hear(self, can_id: int, handler: FrameHandler) -> None:
        assert can_id == SYNC_COB_ID
        self.handler = handler

    def carry(self, age_s: float = 0.0) -> None:
        """A SYNC was on the wire."""
        if self.works and self.handler is not None:
            self.handler(SYNC_COB_ID, b"", asyncio.get_running_loop().time() - age_s)


class KernelTimer:
    """Repeats SYNC as the broadcast manager does: the first one at once, the others by the period, as counted."""

    wire: Wire
    made: list[KernelTimer]

    def __init__(self, channel: str, can_id: int, data: bytes, period_s: float, count: int) -> None:
        assert (channel, can_id, data) == ("can0", SYNC_COB_ID, b"")
        self.period_s, self.count, self.left = period_s, count, 0
        self.timer: asyncio.Handle | None = None
        self.refuses = False
        KernelTimer.made.append(self)

    def start(self) -> bool:
        if self.refuses:
            return False
        self.left = self.count
        self.timer = asyncio.get_running_loop().call_soon(self._send)
        return True

    def renew(self) -> None:
        self.left = self.count

    def stop(self) -> None:
        if self.timer is not None:
            self.timer.cancel()
            self.timer = None

    close = stop

    def _send(self) -> None:
        self.left -= 1
        self.timer = asyncio.get_running_loop().call_later(self.period_s, self._send) if self.left else None
        KernelTimer.wire.carry()


class Robot:
    """Counts ticks; as the cycle does, it sends SYNC itself where the tick is none."""

    def __init__(self) -> None:
        self.wire = KernelTimer.wire = Wire()
        KernelTimer.made = []
        self.pace = SyncPace(self.wire, PERIOD_S, self._tick)
        (self.timer,) = KernelTimer.made
        self.ticks: list[tuple[float, bool]] = []

    def _tick(self) -> None:
        loop = asyncio.get_running_loop()
        self.ticks.append((loop.time(), self.pace.synced))
        if not self.pace.synced:
            loop.call_soon(self.wire.carry)

    def since(self, start: int) -> list[bool]:
        """Whether the ticks since the given one were SYNCs."""
        return [synced for _, synced in self.ticks[start:]]


@pytest.fixture
def robot(monkeypatch: pytest.MonkeyPatch) -> Robot:
    monkeypatch.setattr(sync_pace, "RepeatedFrame", KernelTimer)
    return Robot()


async def test_the_kernel_takes_over_as_soon_as_a_sync_got_through(robot: Robot) -> None:
    robot.pace.start()
    await asyncio.sleep(4.5 * PERIOD_S)
    assert robot.since(0) == [False, True, True, True]
    assert [round(at, 6) for at, _ in robot.ticks] == [0.01, 0.02, 0.03, 0.04]
    robot.pace.stop()


async def test_while_nothing_gets_through_the_cycle_ticks_by_the_timer(robot: Robot) -> None:
    robot.wire.works = False
    robot.pace.start()
    await asyncio.sleep(1.0)
    assert robot.since(0) == [False] * 99
    robot.pace.stop()


async def test_while_the_kernel_refuses_the_cycle_ticks_by_the_timer(robot: Robot) -> None:
    robot.timer.refuses = True
    robot.pace.start()
    await asyncio.sleep(1.0)
    assert robot.since(0) == [False] * 99
    robot.pace.stop()


async def test_a_bus_that_fails_in_mid_drive_costs_less_than_three_cycles(robot: Robot) -> None:
    robot.pace.start()
    await asyncio.sleep(10.5 * PERIOD_S)
    robot.wire.works, ticked = False, len(robot.ticks)
    await asyncio.sleep(10 * PERIOD_S)
    assert not any(robot.since(ticked))
    assert robot.ticks[ticked][0] - robot.ticks[ticked - 1][0] == pytest.approx(PATIENCE * PERIOD_S)
    robot.wire.works = True
    await asyncio.sleep(2.5 * PERIOD_S)
    assert robot.since(-1) == [True]
    robot.pace.stop()


async def test_each_tick_renews_the_count_of_the_kernel(robot: Robot) -> None:
    robot.pace.start()
    await asyncio.sleep(20 * AHEAD_S)
    assert all(robot.since(1))
    assert robot.timer.left == robot.timer.count == math.ceil(AHEAD_S / PERIOD_S)
    robot.pace.stop()


async def test_a_sync_that_is_seen_too_late_is_no_tick_and_renews_nothing(robot: Robot) -> None:
    robot.pace.start()
    await asyncio.sleep(3.5 * PERIOD_S)
    ticked, robot.timer.left = len(robot.ticks), 5
    for age in (3.2, 2.2, 1.2):
        robot.wire.carry(age * PERIOD_S)
    assert (len(robot.ticks), robot.pace.missed, robot.timer.left) == (ticked, 3, 5)
    assert robot.pace.max_lateness_s == pytest.approx(3.2 * PERIOD_S)
    robot.pace.stop()


async def test_the_newest_sync_of_a_pause_is_a_tick(robot: Robot) -> None:
    robot.pace.start()
    await asyncio.sleep(3.5 * PERIOD_S)
    ticked = len(robot.ticks)
    for age in (1.5, 0.5):
        robot.wire.carry(age * PERIOD_S)
    assert robot.since(ticked) == [True]
    robot.pace.stop()


async def test_a_pace_that_was_stopped_leaves_no_sync_behind(robot: Robot) -> None:
    robot.pace.start()
    await asyncio.sleep(5.5 * PERIOD_S)
    robot.pace.stop()
    ticked = len(robot.ticks)
    await asyncio.sleep(1.0)
    assert (len(robot.ticks), robot.timer.timer) == (ticked, None)


async def test_the_log_tells_of_a_sync_that_stays_away_but_not_of_a_short_pause(
    robot: Robot, caplog: pytest.LogCaptureFixture
) -> None:
    with caplog.at_level(logging.INFO):
        robot.pace.start()
        for pause_s in (0.5, 0.5, 2.0):
            robot.wire.works = True
            await asyncio.sleep(0.2)
            robot.wire.works = False
            await asyncio.sleep(pause_s)
        robot.wire.works = True
        await asyncio.sleep(0.2)
        robot.pace.stop()
    comes, stays_away = "SYNC on can0 comes from the kernel", "no SYNC of the kernel on can0"
    assert [message.partition(":")[0] for message in caplog.messages] == [comes, stays_away, comes]
