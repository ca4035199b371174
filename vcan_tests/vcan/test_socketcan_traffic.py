"""SocketCAN on a real kernel: order, time and loss of frames."""

from __future__ import annotations

import asyncio
import socket
import struct
import threading

import pytest

from drivers.bus import socketcan
from drivers.bus.contract import RTR_FLAG
from drivers.bus.socketcan import SocketCanBus
from drivers.bus.socketcan_frames import make_frame
from vcan_tests.kernel.slcan_adapter import SlcanAdapter
from vcan_tests.vcan.socketcan_bench import BIT_RATE, PERIOD_S, Witness, opened, stand_still, until

pytestmark = [pytest.mark.vcan, pytest.mark.timeout(60)]


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
