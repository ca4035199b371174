"""The python-can back end over slcan on a pty: an adapter that is plugged in, unplugged, and plugged in again."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import os
import sys
import tty
from collections.abc import AsyncIterator, Callable
from pathlib import Path

import pytest

from canhelm.errors import BusOff, UsageError
from drivers.bus import python_can
from drivers.bus.contract import RTR_FLAG
from drivers.bus.python_can import PythonCanBus, python_can_bus

pytestmark = [pytest.mark.real_time, pytest.mark.timeout(30)]


class Adapter:
    """The far end of a pty: takes commands as an slcan adapter does, and keeps the frames that it was told to send."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.frames: list[str] = []
        self.commands: list[str] = []
        self._master = -1
        self._pending = b""

    def plug_in(self) -> None:
        """Appear under the adapter's path."""
        self._master, far = os.openpty()
        tty.setraw(far)
        os.symlink(os.ttyname(far), self.path)
        os.close(far)
        asyncio.get_running_loop().add_reader(self._master, self._read)

    def unplug(self) -> None:
        """Vanish, as a USB adapter does."""
        asyncio.get_running_loop().remove_reader(self._master)
        os.close(self._master)
        self.path.unlink()

    def say(self, text: bytes) -> None:
        """Send bytes to the computer."""
        os.write(self._master, text)

    def _read(self) -> None:
        with contextlib.suppress(OSError):  # nobody has opened the other end yet
            *lines, self._pending = (self._pending + os.read(self._master, 4096)).split(b"\r")
            for line in lines:
                text = line.decode()
                (self.frames if text[:1] in ("t", "r") else self.commands).append(text)
                self.say(b"z\r" if text[:1] in ("t", "r") else b"\r")


@pytest.fixture
async def adapter(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> AsyncIterator[Adapter]:
    monkeypatch.setattr(python_can, "REOPEN_S", 0.02)
    monkeypatch.setitem(python_can.OPTIONS, "slcan", python_can.OPTIONS["slcan"] | {"sleep_after_open": 0.0})
    adapter = Adapter(tmp_path / "ttyCAN")
    yield adapter
    if adapter.path.is_symlink():
        adapter.unplug()


@pytest.fixture
async def bus(adapter: Adapter) -> AsyncIterator[PythonCanBus]:
    """A back end over the adapter; what a test leaves open is closed."""
    bus = python_can_bus("slcan", str(adapter.path), 500_000)
    yield bus
    await bus.close()


async def until(condition: Callable[[], bool]) -> None:
    """Wait until a condition holds; threads and the pty have their own time."""
    for _ in range(1000):
        if condition():
            return
        await asyncio.sleep(0.005)
    raise AssertionError("nothing came of it")


def listen(bus: PythonCanBus) -> list[tuple[int, bytes]]:
    frames: list[tuple[int, bytes]] = []
    bus.receiver = lambda can_id, data, stamp: frames.append((can_id, data))
    return frames


async def test_frames_go_through_the_adapter_both_ways(adapter: Adapter, bus: PythonCanBus) -> None:
    adapter.plug_in()
    await bus.open()
    frames = listen(bus)
    bus.send(0x201, b"\x0f\x00")
    bus.send(0x701 | RTR_FLAG)
    adapter.say(b"t18126306\r")
    await until(lambda: len(adapter.frames) == 2 and len(frames) == 1)
    assert (adapter.frames, frames) == (["t20120F00", "r7010"], [(0x181, b"\x63\x06")])
    assert adapter.commands[-2:] == ["O", "O"]
    assert "S6" in adapter.commands


@pytest.mark.parametrize(
    "garbage",
    [b"\xff\xfe\r", b"t\r", b"t1\r", b"tXYZ2\r", b"t1812zz\r", b"t1819001122334455667788\r", b"d123F00\r", b"\a"],
)
async def test_after_an_adapters_garbage_the_next_frame_gets_through(
    adapter: Adapter, bus: PythonCanBus, garbage: bytes
) -> None:
    adapter.plug_in()
    await bus.open()
    frames = listen(bus)
    adapter.say(garbage)
    await asyncio.sleep(0.05)
    adapter.say(b"t18126306\r")
    await until(lambda: bool(frames))
    assert frames == [(0x181, b"\x63\x06")]
    assert bus.down is None


async def test_an_adapter_that_is_unplugged_is_opened_again_when_it_is_back(
    adapter: Adapter, bus: PythonCanBus, caplog: pytest.LogCaptureFixture
) -> None:
    adapter.plug_in()
    await bus.open()
    frames = listen(bus)
    with caplog.at_level(logging.ERROR):
        adapter.unplug()
        await until(lambda: bus.down is not None)
        bus.send(0x201)
        await asyncio.sleep(0.1)
        assert bus.down is not None
    assert [record.getMessage().count("adapter plugged in") for record in caplog.records] == [1]
    adapter.plug_in()
    await until(lambda: bus.down is None)
    adapter.say(b"t1810\r")
    bus.send(0x202)
    await until(lambda: bool(frames) and bool(adapter.frames))
    assert (frames, adapter.frames, bus.counters.dropped_stale) == ([(0x181, b"")], ["t2020"], 1)


async def test_a_bus_that_is_closed_while_its_adapter_is_away_opens_no_more(
    adapter: Adapter, bus: PythonCanBus
) -> None:
    adapter.plug_in()
    await bus.open()
    await until(lambda: adapter.commands[-1:] == ["O"])
    adapter.unplug()
    await until(lambda: bus.down is not None)
    await bus.close()
    heard = len(adapter.commands)
    adapter.plug_in()
    await asyncio.sleep(0.1)
    assert len(adapter.commands) == heard
    bus.send(0x201)
    assert bus.counters.sent == 0


async def test_an_adapter_that_is_missing_is_told(adapter: Adapter, bus: PythonCanBus) -> None:
    with pytest.raises(BusOff, match="ttyCAN is down or missing"):
        await bus.open()


async def test_an_empty_line_does_not_hold_up_the_loop(adapter: Adapter, bus: PythonCanBus) -> None:
    adapter.plug_in()
    await bus.open()
    listen(bus)
    loop = asyncio.get_running_loop()
    began = loop.time()
    for _ in range(100):
        bus._receive_all()
    assert loop.time() - began < 0.05


def test_without_pyserial_the_line_that_installs_it_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "serial", None)
    with pytest.raises(UsageError, match="pyserial is missing") as refused:
        python_can_bus("slcan", "/dev/ttyUSB0", 500_000)
    assert refused.value.remedy == f"{sys.executable} -m pip install 'canhelm[slcan]'"
