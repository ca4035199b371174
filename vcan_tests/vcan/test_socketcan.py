"""SocketCAN on a real kernel: order, time and loss of frames, interfaces that fail, error states, and its own SYNC."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import signal
import socket
import struct
import subprocess
import sys
import threading
import time
from collections.abc import AsyncIterator, Callable, Iterator
from itertools import pairwise
from statistics import median

import pytest

from canhelm.errors import BusOff
from daemon.runtime.sync_pace import AHEAD_S, SyncPace
from drivers.bus import socketcan
from drivers.bus.contract import RTR_FLAG
from drivers.bus.socketcan import SocketCanBus
from drivers.bus.socketcan_frames import make_frame
from vcan_tests.kernel.slcan_adapter import SlcanAdapter

pytestmark = [pytest.mark.vcan, pytest.mark.timeout(60)]

SYNC = 0x080
BIT_RATE = 1_000_000
PERIOD_S = 0.01
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


@contextlib.asynccontextmanager
async def opened(channel: str = "vcan0") -> AsyncIterator[SocketCanBus]:
    bus = SocketCanBus(channel, BIT_RATE)
    await bus.open()
    try:
        yield bus
    finally:
        await bus.close()


class Witness:
    """Sees everything on an interface, with the kernel's times."""

    def __init__(self, bus: SocketCanBus) -> None:
        self.frames: list[tuple[int, bytes]] = []
        self.stamps: list[float] = []
        bus.taps.append(self._see)

    def _see(self, can_id: int, data: bytes, stamp: float) -> None:
        self.frames.append((can_id, data))
        self.stamps.append(stamp)

    @property
    def ids(self) -> list[int]:
        """Identifiers in the order of the wire."""
        return [can_id for can_id, _ in self.frames]


@pytest.fixture
async def one() -> AsyncIterator[SocketCanBus]:
    async with opened() as bus:
        yield bus


@pytest.fixture
async def two() -> AsyncIterator[SocketCanBus]:
    async with opened() as bus:
        yield bus


@pytest.fixture
def raw() -> Iterator[socket.socket]:
    """A socket of nobody's back end, for frames that ours would not send."""
    with socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW) as sender:
        sender.bind(("vcan0",))
        yield sender


@pytest.fixture
def spare() -> Iterator[str]:
    """An interface that a test may take down and away."""
    ip("link", "add", "spare0", "type", "vcan")
    ip("link", "set", "spare0", "up")
    yield "spare0"
    subprocess.run(["ip", "link", "delete", "spare0"], check=False, capture_output=True)


def ip(*arguments: str) -> None:
    subprocess.run(["ip", *arguments], check=True)


def stand_still(seconds: float) -> None:
    """Keep this process busy, its loop included."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        pass


async def until(condition: Callable[[], object], within_s: float = 10.0) -> None:
    """Wait for what comes from other processes and from the kernel."""
    for _ in range(round(within_s / 0.005)):
        if condition():
            return
        await asyncio.sleep(0.005)
    raise AssertionError("nothing came of it")


def error_frame(classes: int, data: bytes) -> bytes:
    return struct.pack("=IB3x8s", 0x2000_0000 | classes, 8, data)


# -- frames -----------------------------------------------------------------------------------------------------------


async def test_data_and_remote_frames_cross(one: SocketCanBus, two: SocketCanBus) -> None:
    got: list[tuple[int, bytes]] = []
    two.receiver = lambda can_id, data, stamp: got.append((can_id, data))
    one.send(0x181, b"\x37\x06")
    one.send(0x701 | RTR_FLAG)
    await until(lambda: len(got) == 2)
    assert got == [(0x181, b"\x37\x06"), (0x701 | RTR_FLAG, b"")]
    assert (one.counters.sent, one.counters.received, two.counters.received) == (2, 0, 2)


@pytest.mark.real_time
async def test_a_frame_has_the_time_at_which_it_came_not_at_which_it_was_read(
    one: SocketCanBus, raw: socket.socket
) -> None:
    witness, loop = Witness(one), asyncio.get_running_loop()
    sent_s = loop.time()
    raw.send(make_frame(0x181, b""))
    stand_still(0.1)
    await until(lambda: witness.stamps)
    assert witness.stamps[0] - sent_s == pytest.approx(0.0, abs=0.02)


async def test_a_tap_sees_own_and_other_frames_in_the_order_of_the_wire(one: SocketCanBus, two: SocketCanBus) -> None:
    witness = Witness(one)
    for can_id in range(0x100, 0x120):
        (one, two)[can_id % 2].send(can_id)
    await until(lambda: len(witness.ids) == 0x20)
    assert witness.ids == list(range(0x100, 0x120))
    assert witness.stamps == sorted(witness.stamps)
    assert one.counters.received == 0x10


async def test_without_a_tap_the_kernel_keeps_away_what_is_not_needed(one: SocketCanBus, two: SocketCanBus) -> None:
    needed = {0x182: None}
    two.needs(needed.keys())
    for can_id in (0x181, 0x182, 0x183):
        one.send(can_id)
    needed[0x183] = None
    two.needs(needed.keys())
    one.send(0x183)
    await until(lambda: two.counters.received == 2)
    one.send(0x182)
    await until(lambda: two.counters.received == 3)


async def test_a_tap_opens_the_filters_and_closes_them_when_it_goes(one: SocketCanBus, two: SocketCanBus) -> None:
    two.needs({0x182: None}.keys())
    witness = Witness(two)
    one.send(0x181)
    await until(lambda: witness.ids == [0x181])
    two.taps.remove(two.taps[0])
    one.send(0x181)
    one.send(0x182)
    await until(lambda: two.counters.received == 2)


async def test_other_kinds_of_frames_are_counted_and_dropped(one: SocketCanBus, raw: socket.socket) -> None:
    witness = Witness(one)
    raw.setsockopt(socket.SOL_CAN_RAW, socket.CAN_RAW_FD_FRAMES, 1)
    raw.send(struct.pack("=IB3x8s", 0x8000_0181, 0, b""))
    raw.send(struct.pack("=IBB2x64s", 0x181, 12, 0, b""))
    raw.send(make_frame(0x182, b""))
    await until(lambda: witness.ids)
    assert (witness.ids, one.foreign) == ([0x182], 1)


async def test_a_burst_of_a_thousand_frames_is_kept(one: SocketCanBus, raw: socket.socket) -> None:
    witness = Witness(one)
    for number in range(1000):
        raw.send(make_frame(0x181, struct.pack("<H", number)))
    await until(lambda: len(witness.frames) == 1000)
    assert [data for _, data in witness.frames] == [struct.pack("<H", number) for number in range(1000)]
    assert one.overflowed == 0


async def test_what_the_receive_buffer_has_no_room_for_is_counted_and_told(
    raw: socket.socket, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(socketcan, "RECEIVE_BUFFER_BYTES", 16 * 1024)
    async with opened() as bus:
        for _ in range(200):
            raw.send(make_frame(0x181, b""))
        await until(lambda: bus.counters.received)
        raw.send(make_frame(0x182, b""))  # the kernel tells of a loss with the next frame
        await until(lambda: bus.overflowed)
        assert bus.counters.received + bus.overflowed == 201
        assert bus.details()["dropped_overflow"] == bus.overflowed
    assert [message.count("overflowed") for message in caplog.messages] == [1]


async def test_the_load_counts_what_filters_keep_away(one: SocketCanBus, raw: socket.socket) -> None:
    one.needs({}.keys())
    for _ in range(200):
        for _ in range(10):
            raw.send(make_frame(0x181, bytes(8)))
        await asyncio.sleep(0.01)
        if one.load() > 0.02:
            break
    assert one.load() > 0.02
    assert one.counters.received == 0


async def test_few_frames_wait_in_the_kernel_for_an_adapter_that_takes_none(monkeypatch: pytest.MonkeyPatch) -> None:
    """However long the interface's queue is: the others go stale here, and are not sent when the adapter wakes up."""
    awake, take = threading.Event(), SlcanAdapter._from_kernel
    awake.set()

    def take_when_awake(adapter: SlcanAdapter, line: str) -> None:
        awake.wait()
        take(adapter, line)

    monkeypatch.setattr(SlcanAdapter, "_from_kernel", take_when_awake)
    with SlcanAdapter(bit_rate=BIT_RATE) as adapter:
        async with opened("can0") as bus:
            awake.clear()
            try:
                await fill(bus)
                for _ in range(20):
                    bus.send(0x202, b"", asyncio.get_running_loop().time() + PERIOD_S)
                    await asyncio.sleep(0.005)
                assert bus.counters.dropped_stale > 10
            finally:
                awake.set()
            bus.send(0x203)
            await until(lambda: "t2030" in adapter.frames)
            last = max(number for number, frame in enumerate(adapter.frames) if frame.startswith("t201"))
            assert last > 0
            assert adapter.frames[last + 1 :].count("t2020") <= 3


async def fill(bus: SocketCanBus) -> None:
    """Send until no frame gets away any more."""
    loop = asyncio.get_running_loop()
    while bus.counters.dropped_stale < 100:
        for _ in range(20):
            bus.send(0x201, bytes(8), loop.time() + PERIOD_S)
        await asyncio.sleep(0.001)


async def test_own_frames_stay_in_the_kernel_while_nobody_looks(one: SocketCanBus) -> None:
    def comes_back() -> int:
        assert one._link is not None
        return one._link.getsockopt(socket.SOL_CAN_RAW, socket.CAN_RAW_RECV_OWN_MSGS)

    before = comes_back()
    witness = Witness(one)
    during = comes_back()
    one.taps.remove(witness._see)
    assert (before, during, comes_back()) == (0, 1, 0)


# -- interfaces that fail ---------------------------------------------------------------------------------------------


async def test_an_interface_that_is_missing_is_told_with_the_line_that_makes_it() -> None:
    with pytest.raises(BusOff, match="vcan7 is down or missing") as refusal:
        await SocketCanBus("vcan7", 1_000_000).open()
    assert "sudo ip link add dev vcan7 type vcan" in str(refusal.value.remedy)


async def test_an_interface_that_is_down_is_told_at_opening(spare: str) -> None:
    ip("link", "set", spare, "down")
    with pytest.raises(BusOff, match="Network is down"):
        await SocketCanBus(spare, 1_000_000).open()


@pytest.mark.parametrize("how", ["down", "away"])
async def test_an_interface_that_fails_and_comes_back_is_used_again(
    spare: str, how: str, caplog: pytest.LogCaptureFixture
) -> None:
    async with opened(spare) as bus, opened(spare) as other:
        with caplog.at_level(logging.INFO):
            ip("link", *(["set", spare, "down"] if how == "down" else ["delete", spare]))
            await until(lambda: bus.down)
            assert bus.down == ("Network is down" if how == "down" else "No such device")
            assert spare in bus.details()["remedy"]
            bus.send(0x201)
            assert bus.counters.dropped_stale == 1
            if how == "away":
                ip("link", "add", spare, "type", "vcan")
            ip("link", "set", spare, "up")
            await until(lambda: bus.down is None and other.down is None)
        assert [message.count("is down or missing") for message in caplog.messages] == [1, 1, 0, 0]
        bus.send(0x202)
        await until(lambda: other.counters.received == 1)


async def test_a_bus_that_is_closed_while_its_interface_is_down_opens_no_more(spare: str) -> None:
    async with opened(spare) as bus:
        ip("link", "set", spare, "down")
        await until(lambda: bus.down)
    ip("link", "set", spare, "up")
    await asyncio.sleep(0.3)
    assert bus.down is not None
    assert bus._link is None


async def test_an_interface_with_another_bit_rate_is_left_alone_until_it_has_the_networks(
    caplog: pytest.LogCaptureFixture,
) -> None:
    with SlcanAdapter(bit_rate=BIT_RATE) as adapter:
        async with opened("can0") as bus:
            adapter.down()
            ip("link", "set", "can0", "type", "can", "bitrate", "125000")
            adapter.up()
            await until(lambda: bus.down == "it has 125000 bit/s, the profile says 1000000")
            *_, mend = bus.remedy().split("; sudo ")
            assert mend == "ip link set can0 up type can bitrate 1000000 restart-ms 100"
            adapter.down()
            ip("link", "set", "can0", "type", "can", "bitrate", str(BIT_RATE))
            adapter.up()
            await until(lambda: bus.down is None)
    assert "it has 125000 bit/s" in caplog.text


# -- error states -----------------------------------------------------------------------------------------------------


async def test_error_states_of_a_controller_are_followed_with_their_counters() -> None:
    with SlcanAdapter(bit_rate=BIT_RATE) as adapter:
        async with opened("can0") as bus:
            adapter.report_state("warning", rx_errors=10, tx_errors=96)
            await until(lambda: bus.details().get("controller") == "error-warning")
            adapter.report_state("passive", tx_errors=128)
            await until(lambda: bus.details().get("controller") == "error-passive")
            assert bus.details()["transmit_errors"] == 128
            adapter.report_state("active")
            await until(lambda: bus.details().get("controller") == "error-active")
            assert (bus.down, bus.counters.error_frames) == (None, 3)


async def test_errors_on_the_wire_are_told_in_words() -> None:
    with SlcanAdapter(bit_rate=BIT_RATE) as adapter:
        async with opened("can0") as bus:
            adapter.report_errors("a")
            await until(lambda: bus.counters.error_frames)
            assert bus.details()["last_error"] == "no node acknowledges"


async def test_bus_off_takes_the_bus_down_until_the_interface_was_restarted(caplog: pytest.LogCaptureFixture) -> None:
    with SlcanAdapter(bit_rate=BIT_RATE) as adapter:
        async with opened("can0") as bus:
            bus.send(0x201)
            await until(lambda: adapter.frames == ["t2010"])
            adapter.report_state("bus-off", tx_errors=255)
            await until(lambda: bus.down)
            assert (bus.down, bus.details()["bus_offs"]) == ("bus-off", 1)
            assert "ip link set can0 down" in bus.details()["remedy"]
            bus.send(0x202)
            assert bus.counters.dropped_stale == 1
            adapter.down()
            adapter.up()
            await until(lambda: bus.down is None)
            bus.send(0x203)
            await until(lambda: adapter.frames == ["t2010", "t2030"])
    assert sum("can0 is bus-off" in message and "termination" in message for message in caplog.messages) == 1


async def test_a_frame_from_others_ends_bus_off(one: SocketCanBus, raw: socket.socket) -> None:
    raw.send(error_frame(0x40, b""))
    await until(lambda: one.down)
    raw.send(make_frame(0x181, b""))
    await until(lambda: one.down is None)


async def test_a_restarted_controller_ends_bus_off(one: SocketCanBus, raw: socket.socket) -> None:
    raw.send(error_frame(0x40, b""))
    await until(lambda: one.down)
    raw.send(error_frame(0x100, b""))
    await until(lambda: one.down is None)


async def test_bus_off_ends_with_the_carrier_where_the_driver_says_nothing(
    one: SocketCanBus, raw: socket.socket
) -> None:
    raw.send(error_frame(0x40, b""))
    await until(lambda: one.down)
    await until(lambda: one.down is None, within_s=3.0)


# -- SYNC by the kernel -----------------------------------------------------------------------------------------------


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
