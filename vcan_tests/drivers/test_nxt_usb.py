"""A brick on USB: the simulated one behind what pyusb offers of a device."""

from __future__ import annotations

import asyncio
import queue
import sys
from collections.abc import AsyncIterator
from types import SimpleNamespace
from typing import Any

import pytest
import usb.core

from canhelm.errors import BusOff
from daemon.brick_ports import brick_port
from drivers.contract import NodeState
from drivers.nxt.brick import Brick
from drivers.nxt.codes import Output
from drivers.nxt.telegrams import Unframer, make_frame
from drivers.simulated.nxt import USB, SimulatedNxt

pytestmark = pytest.mark.real_time


class OutEndpoint:
    """Takes telegrams on pyusb's thread and hands them to the brick on the loop."""

    bEndpointAddress = 0x01

    def __init__(self, device: UsbBrick) -> None:
        self._device = device

    def write(self, data: bytes, timeout: int) -> int:
        self._device.require_plugged()
        self._device.loop.call_soon_threadsafe(self._device.nxt.cable.write, make_frame(data))
        return len(data)


class InEndpoint:
    """Gives what the brick has answered, or times out as libusb does."""

    bEndpointAddress = 0x82

    def __init__(self, device: UsbBrick) -> None:
        self._device = device

    def read(self, size: int, timeout: int) -> bytes:
        self._device.require_plugged()
        try:
            return self._device.answers.get(timeout=timeout / 1000)[:size]
        except queue.Empty:
            raise usb.core.USBTimeoutError("Operation timed out", -7, 110) from None


class UsbBrick:
    """What pyusb makes of a brick on the cable."""

    def __init__(self) -> None:
        self.loop = asyncio.get_running_loop()
        self.nxt = SimulatedNxt("Cabled", timing=USB)
        self.answers: queue.Queue[bytes] = queue.Queue()
        self.plugged = True
        self.disposed = 0
        self._unframer = Unframer()
        self._ctx = SimpleNamespace(dispose=self._dispose)
        self.nxt.cable.host = self._answer

    def _answer(self, data: bytes, _: float) -> None:
        for telegram in self._unframer.feed(data):
            self.answers.put(telegram)

    def _dispose(self, device: Any) -> None:
        self.disposed += 1

    def require_plugged(self) -> None:
        if not self.plugged:
            raise usb.core.USBError("No such device (it may have been disconnected)", -4, 19)

    def set_configuration(self) -> None:
        self.require_plugged()

    def get_active_configuration(self) -> dict[tuple[int, int], list[Any]]:
        return {(0, 0): [OutEndpoint(self), InEndpoint(self)]}


@pytest.fixture
async def cabled(monkeypatch: pytest.MonkeyPatch) -> AsyncIterator[UsbBrick]:
    device = UsbBrick()
    monkeypatch.setattr(usb.core, "find", lambda **wanted: device if device.plugged else None)
    yield device
    device.plugged = False


@pytest.fixture
async def brick(cabled: UsbBrick) -> AsyncIterator[Brick]:
    made = Brick("usb", brick_port("usb"))
    made.start()
    await asyncio.wait_for(made.wait_ready(), 5.0)
    yield made
    await made.close()


async def test_a_brick_on_usb_says_who_it_is(brick: Brick) -> None:
    assert brick.info is not None
    assert brick.info.name == "Cabled"


async def test_a_brick_on_usb_moves(brick: Brick, cabled: UsbBrick) -> None:
    await brick.move({Output.B: (60, 90)})
    cabled.nxt.catch_up()
    assert cabled.nxt.motors[1].state(1).tacho_deg >= 90


async def test_a_question_over_usb_takes_a_few_milliseconds(brick: Brick) -> None:
    loop = asyncio.get_running_loop()
    begin_s = loop.time()
    for _ in range(20):
        await brick.output(Output.B)
    assert (loop.time() - begin_s) / 20 < 0.03


async def test_a_cable_pulled_out_of_usb_is_told_and_the_device_let_go(brick: Brick, cabled: UsbBrick) -> None:
    cabled.plugged = False
    with pytest.raises(BusOff, match="No such device"):
        await brick.output(Output.B)
    await asyncio.sleep(0.1)
    assert brick.node_state is NodeState.ABSENT
    assert cabled.disposed == 1


@pytest.mark.parametrize(
    ("found", "reason"),
    [
        (lambda **wanted: None, "no brick on USB"),
        (lambda **wanted: _raise(usb.core.NoBackendError("No backend available")), "No backend available"),
        (lambda **wanted: _raise(usb.core.USBError("Access denied", -3, 13)), "Access denied"),
    ],
)
async def test_no_brick_no_libusb_or_no_permission_is_told(
    found: Any, reason: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(usb.core, "find", found)
    with pytest.raises(BusOff, match=reason) as refused:
        brick_port("usb")(lambda _: None)
    assert refused.value.remedy


async def test_a_missing_pyusb_is_told_with_the_extra_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delitem(sys.modules, "drivers.nxt.usb_port", raising=False)
    monkeypatch.setitem(sys.modules, "usb", None)
    monkeypatch.setitem(sys.modules, "usb.core", None)
    with pytest.raises(BusOff, match="pyusb is missing") as refused:
        brick_port("usb")(lambda _: None)
    assert "canhelm[usb]" in (refused.value.remedy or "")


def _raise(error: Exception) -> None:
    raise error
