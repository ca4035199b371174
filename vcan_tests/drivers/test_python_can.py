"""The python-can back end: its virtual interface, and a scripted one with a file descriptor that can fail."""

from __future__ import annotations

import asyncio
import errno
import logging
import socket
import time
from collections.abc import Iterator

import can
import pytest

from canhelm.errors import BusOff, UsageError
from drivers.bus import python_can
from drivers.bus.contract import RTR_FLAG, Bus
from drivers.bus.interfaces import open_bus
from drivers.bus.python_can import PythonCanBus
from drivers.bus.transmit_queue import QUEUE_DEPTH
from drivers.bus.wire_time import frame_bits

pytestmark = pytest.mark.real_time

BIT_RATE = 1_000_000
Frame = tuple[int, bytes]


def adapter() -> PythonCanBus:
    """A bus on a scripted link."""
    return PythonCanBus("slcan", "/dev/ttyUSB0", BIT_RATE)


def listen(bus: Bus) -> list[Frame]:
    frames: list[Frame] = []
    bus.receiver = lambda can_id, data, stamp: frames.append((can_id, data))
    return frames


async def until_received(bus: Bus, count: int) -> None:
    """Wait until so many frames have come in."""
    if bus.counters.received < count:
        came = asyncio.get_running_loop().create_future()

        def check(can_id: int, data: bytes, stamp: float) -> None:
            if bus.counters.received >= count and not came.done():
                came.set_result(None)

        bus.taps.append(check)
        await asyncio.wait_for(came, 5.0)
        bus.taps.remove(check)


class ScriptedLink:
    """An interface with a file descriptor: frames come through a socket pair as text, sending fails by ``error``."""

    def __init__(self) -> None:
        self.near, self.far = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self.near.setblocking(False)
        self.error: int | None = None
        self.sent: list[int] = []
        self.closed = False

    def fileno(self) -> int:
        return self.near.fileno()

    def recv(self, timeout: float) -> can.Message | None:
        try:
            text = self.near.recv(64)
        except BlockingIOError:
            return None
        if text == b"down":
            raise can.CanOperationError("Network is down", errno.ENETDOWN)
        if text == b"bus-off":
            return can.Message(is_error_frame=True, arbitration_id=0x40, is_extended_id=False)
        if text == b"extended":
            return can.Message(arbitration_id=0x181, is_extended_id=True)
        return can.Message(arbitration_id=int(text, 16), is_extended_id=False, timestamp=time.time() - 0.2)

    def send(self, message: can.Message, timeout: float) -> None:
        if self.error is not None:
            raise can.CanOperationError("cannot send", self.error)
        self.sent.append(message.arbitration_id)

    def shutdown(self) -> None:
        self.closed = True
        self.near.close()
        self.far.close()


@pytest.fixture
def links(monkeypatch: pytest.MonkeyPatch) -> Iterator[list[ScriptedLink]]:
    """Every link that is opened, in order; links[0] is the first."""
    opened: list[ScriptedLink] = []

    def make(**_: object) -> ScriptedLink:
        opened.append(ScriptedLink())
        return opened[-1]

    monkeypatch.setattr(can, "Bus", make)
    yield opened
    assert all(link.closed for link in opened)


@pytest.mark.parametrize("spec", ["can0", ":can0", "socketcan:", "", "pigeon:can0"])
def test_a_specification_that_names_no_bus_is_refused(spec: str) -> None:
    with pytest.raises(UsageError):
        open_bus(spec, BIT_RATE)


def test_an_unknown_interface_is_told_what_else_there_is() -> None:
    with pytest.raises(UsageError) as refused:
        open_bus("pigeon:can0", BIT_RATE)
    assert {"rs232", "simulated", "slcan", "socketcan"} <= set((refused.value.remedy or "").split(", "))


@pytest.mark.parametrize("interface", ["rs232", "slcan"])
def test_an_interface_in_capitals_is_told_how_it_is_written(interface: str) -> None:
    with pytest.raises(UsageError) as refused:
        open_bus(f"{interface.upper()}:/dev/ttyS0", BIT_RATE)
    assert refused.value.remedy == f"write {interface}"


def test_a_serial_port_gives_a_name_without_its_folder() -> None:
    assert open_bus("slcan:/dev/ttyUSB0", BIT_RATE).name == "ttyUSB0"


async def test_frames_pass_between_two_buses_of_one_virtual_channel() -> None:
    one, two = open_bus("virtual:pair", BIT_RATE), open_bus("virtual:pair", BIT_RATE)
    await one.open()
    await two.open()
    frames = listen(two)
    one.send(0x181, b"\x37\x06")
    one.send(0x701 | RTR_FLAG)
    await until_received(two, 2)
    assert frames == [(0x181, b"\x37\x06"), (0x701 | RTR_FLAG, b"")]
    assert (one.counters.sent, two.counters.received) == (2, 2)
    bits = frame_bits(0x181, b"\x37\x06") + frame_bits(0x701 | RTR_FLAG, b"")
    assert one.load() == two.load() == pytest.approx(bits / BIT_RATE)
    await one.close()
    await two.close()


async def test_taps_see_what_is_sent_and_received() -> None:
    one, two = open_bus("virtual:taps", BIT_RATE), open_bus("virtual:taps", BIT_RATE)
    await one.open()
    await two.open()
    seen: list[int] = []
    two.taps.append(lambda can_id, data, stamp: seen.append(can_id))
    two.send(0x080)
    one.send(0x181)
    await until_received(two, 1)
    assert seen == [0x080, 0x181]
    await one.close()
    await two.close()


async def test_a_frame_keeps_the_time_at_which_it_came(links: list[ScriptedLink]) -> None:
    bus = adapter()
    await bus.open()
    stamps: list[float] = []
    bus.receiver = lambda can_id, data, stamp: stamps.append(stamp)
    links[0].far.send(b"181")
    await until_received(bus, 1)
    assert 0.19 < asyncio.get_running_loop().time() - stamps[0] < 1.0
    await bus.close()


async def test_frames_of_other_kinds_are_counted_and_dropped(links: list[ScriptedLink]) -> None:
    bus = adapter()
    await bus.open()
    frames = listen(bus)
    for text in (b"extended", b"garbage", b"182"):
        links[0].far.send(text)
    await until_received(bus, 1)
    assert frames == [(0x182, b"")]
    assert bus.foreign == 2
    await bus.close()


async def test_frames_wait_for_room_most_urgent_first(links: list[ScriptedLink]) -> None:
    bus = adapter()
    await bus.open()
    links[0].error = errno.ENOBUFS
    for can_id in (0x203, 0x201, 0x202):
        bus.send(can_id)
    assert links[0].sent == []
    links[0].error = None
    await asyncio.sleep(0.02)
    assert links[0].sent == [0x201, 0x202, 0x203]
    assert bus.counters.sent == 3
    await bus.close()


async def test_frames_that_wait_too_long_are_dropped(links: list[ScriptedLink]) -> None:
    bus = adapter()
    await bus.open()
    links[0].error = errno.ENOBUFS
    bus.send(0x201, deadline_s=asyncio.get_running_loop().time() + 0.002)
    await asyncio.sleep(0.02)
    links[0].error = None
    await asyncio.sleep(0.01)
    assert links[0].sent == []
    assert bus.counters.dropped_stale == 1
    await bus.close()


async def test_a_full_queue_refuses_more(links: list[ScriptedLink]) -> None:
    bus = adapter()
    await bus.open()
    links[0].error = errno.ENOBUFS
    for _ in range(QUEUE_DEPTH + 3):
        bus.send(0x201)
    assert bus.counters.dropped_full == 3
    await bus.close()


@pytest.mark.parametrize("by", ["receiving", "sending"])
async def test_an_interface_that_goes_down_is_opened_again(
    links: list[ScriptedLink], by: str, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(python_can, "REOPEN_S", 0.0)
    bus = adapter()
    await bus.open()
    with caplog.at_level(logging.ERROR):
        if by == "receiving":
            links[0].far.send(b"down")
            await asyncio.sleep(0)  # the turn that reads it
            await asyncio.sleep(0)
        else:
            links[0].error = errno.ENETDOWN
            bus.send(0x080)
        assert bus.down is not None
        bus.send(0x201)
        assert bus._reopening is not None
        await asyncio.wait_for(bus._reopening, 5.0)
    assert [record.getMessage().count("adapter plugged in") for record in caplog.records] == [1]
    bus.send(0x202)
    assert (links[0].closed, links[1].sent) == (True, [0x202])
    assert (bus.down is None, bus.counters.dropped_stale) == (True, 1 if by == "receiving" else 2)
    await bus.close()


async def test_bus_off_is_said_until_frames_come_again(links: list[ScriptedLink]) -> None:
    bus = adapter()
    await bus.open()
    links[0].far.send(b"bus-off")
    await asyncio.sleep(0.01)
    assert (bus.down, bus.counters.error_frames) == ("bus-off", 1)
    links[0].far.send(b"181")
    await until_received(bus, 1)
    assert bus.down is None
    await bus.close()


async def test_a_missing_adapter_comes_with_what_to_look_for(monkeypatch: pytest.MonkeyPatch) -> None:
    def missing(**_: object) -> can.BusABC:
        raise OSError(errno.ENODEV, "No such device")

    monkeypatch.setattr(can, "Bus", missing)
    with pytest.raises(BusOff, match="No such device") as refusal:
        await adapter().open()
    assert "adapter plugged in" in str(refusal.value.remedy)


async def test_an_interface_that_is_down_is_refused_at_opening(monkeypatch: pytest.MonkeyPatch) -> None:
    link = ScriptedLink()
    link.far.send(b"down")
    monkeypatch.setattr(can, "Bus", lambda **_: link)
    with pytest.raises(BusOff, match="Network is down"):
        await adapter().open()
    assert link.closed


async def test_sending_on_a_closed_bus_is_dropped_and_counted() -> None:
    bus = open_bus("virtual:closed", BIT_RATE)
    await bus.open()
    await bus.close()
    bus.send(0x080)
    assert (bus.counters.sent, bus.counters.dropped_stale) == (0, 1)
