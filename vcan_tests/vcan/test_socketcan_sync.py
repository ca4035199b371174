"""SYNC that the kernel sends: its period, what becomes of it while Python is busy, and its end."""

from __future__ import annotations

import asyncio
import contextlib
import signal
import sys
from itertools import pairwise
from statistics import median

import pytest

from daemon.runtime.sync_pace import AHEAD_S, SyncPace
from drivers.bus.socketcan import SocketCanBus
from vcan_tests.vcan.socketcan_bench import PERIOD_S, Witness, ip, opened, stand_still, until

pytestmark = [pytest.mark.vcan, pytest.mark.timeout(60)]

SYNC = 0x080
CHILD = """
import asyncio
from daemon.runtime.sync_pace import SyncPace
from drivers.bus.socketcan import SocketCanBus

async def main():
    bus = SocketCanBus("vcan0", 1_000_000)
    pace = SyncPace(bus, 0.01, lambda: pace.synced or bus.send(0x080, b"", asyncio.get_running_loop().time() + 0.01))
    await bus.open()
    pace.start()
    await asyncio.Event().wait()

asyncio.run(main())
"""
"""A process whose cycle does nothing but to be paced by SYNC."""


def paced(bus: SocketCanBus, ticks: list[bool]) -> SyncPace:
    """A pace whose cycle notes whether a tick was a SYNC, and sends one where it was not."""

    def tick() -> None:
        ticks.append(pace.synced)
        if not pace.synced:
            bus.send(SYNC, b"", asyncio.get_running_loop().time() + PERIOD_S)

    pace = SyncPace(bus, PERIOD_S, tick)
    return pace


@pytest.mark.real_time
async def test_sync_keeps_its_period_while_python_is_busy(one: SocketCanBus, two: SocketCanBus) -> None:
    ticks: list[bool] = []
    pace, witness, loop = paced(one, ticks), Witness(two), asyncio.get_running_loop()
    pace.start()
    await until(lambda: len(ticks) > 5)
    before, began_s = len(ticks), loop.time()
    stand_still(0.15)
    ended_s = loop.time()
    assert len(ticks) == before
    await until(lambda: len(ticks) > before + 20)
    pace.stop()
    assert len([stamp for stamp in witness.stamps if began_s < stamp < ended_s]) in range(13, 17)
    periods = [later - earlier for earlier, later in pairwise(witness.stamps)]
    assert median(periods) == pytest.approx(PERIOD_S, abs=0.001)


@pytest.mark.real_time
async def test_of_the_syncs_of_a_pause_only_the_newest_begins_a_cycle(one: SocketCanBus) -> None:
    ticks: list[bool] = []
    pace = paced(one, ticks)
    pace.start()
    await until(lambda: len(ticks) > 5)
    before = len(ticks)
    stand_still(0.15)
    await asyncio.sleep(0)
    await asyncio.sleep(0)
    pace.stop()
    assert len(ticks) - before <= 1
    assert pace.missed >= 10


async def test_syncs_of_the_kernel_count_as_sent_and_do_not_reach_the_receiver(one: SocketCanBus) -> None:
    received: list[int] = []
    ticks: list[bool] = []
    one.receiver = lambda can_id, data, stamp: received.append(can_id)
    pace = paced(one, ticks)
    pace.start()
    await until(lambda: len(ticks) > 10)
    pace.stop()
    assert (received, one.counters.received) == ([], 0)
    assert one.counters.sent == pytest.approx(len(ticks), abs=1)


async def test_the_cycle_goes_on_while_the_bus_is_down_and_the_kernels_sync_with_it(spare: str) -> None:
    async with opened(spare) as bus:
        ticks: list[bool] = []
        pace = paced(bus, ticks)
        pace.start()
        await until(lambda: ticks[-1:] == [True])
        ip("link", "delete", spare)
        await until(lambda: ticks[-1:] == [False])
        ticked = len(ticks)
        await asyncio.sleep(20 * PERIOD_S)
        assert len(ticks) - ticked > 10
        ip("link", "add", spare, "type", "vcan")
        ip("link", "set", spare, "up")
        await until(lambda: ticks[-1:] == [True])
        pace.stop()


@pytest.mark.real_time
@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGSTOP])
async def test_sync_ends_with_a_daemon_that_dies_and_soon_after_one_that_hangs(
    one: SocketCanBus, number: signal.Signals
) -> None:
    witness = Witness(one)
    child = await asyncio.create_subprocess_exec(sys.executable, "-c", CHILD)
    try:
        await until(lambda: len(witness.ids) > 20, within_s=20.0)
        loop = asyncio.get_running_loop()
        hung_s = loop.time()
        child.send_signal(number)
        await asyncio.sleep(AHEAD_S + 0.3)
        allowed_s = 1.5 * AHEAD_S if number is signal.SIGSTOP else 5 * PERIOD_S
        assert witness.stamps[-1] - hung_s < allowed_s
        if number is signal.SIGSTOP:
            child.send_signal(signal.SIGCONT)
            await until(lambda: witness.stamps[-1] > hung_s + AHEAD_S + 0.3 + 10 * PERIOD_S)
    finally:
        with contextlib.suppress(ProcessLookupError):
            child.kill()
        await child.wait()
