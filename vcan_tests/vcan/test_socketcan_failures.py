"""SocketCAN on a real kernel: interfaces that fail, and the error states of a controller."""

from __future__ import annotations

import asyncio
import logging
import socket
import struct

import pytest

from canhelm.errors import BusOff
from drivers.bus.can_link import IS_BUS_OFF, read_link
from drivers.bus.socketcan import SocketCanBus
from drivers.bus.socketcan_frames import make_frame
from vcan_tests.kernel.slcan_adapter import SlcanAdapter
from vcan_tests.vcan.socketcan_bench import BIT_RATE, ip, opened, until

pytestmark = [pytest.mark.vcan, pytest.mark.timeout(60)]


def error_frame(classes: int, data: bytes) -> bytes:
    return struct.pack("=IB3x8s", 0x2000_0000 | classes, 8, data)


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


async def test_an_interface_that_was_bus_off_before_it_was_opened_is_told_so() -> None:
    with SlcanAdapter(bit_rate=BIT_RATE) as adapter:
        adapter.report_state("bus-off", tx_errors=255)
        await until(lambda: read_link("can0").state == IS_BUS_OFF)
        async with opened("can0") as bus:
            assert (bus.down, bus.details()["bus_offs"]) == ("bus-off", 1)
            adapter.down()
            adapter.up()
            await until(lambda: bus.down is None)


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
