"""The simulated EPOS as a gateway: what it passes on to the bus, objects of any length, NMT and bare frames."""

from __future__ import annotations

import asyncio
from dataclasses import replace

import pytest

from drivers.bus.contract import RTR_FLAG
from drivers.canopen.objects import Access
from drivers.epos.serial_frames import (
    make_initiate_segmented_read,
    make_initiate_segmented_write,
    make_read_object,
    make_request_can_frame,
    make_segment_read,
    make_segment_write,
    make_send_can_frame,
    make_send_nmt,
    make_write_object,
)
from drivers.simulated.serial import EposTiming
from vcan_tests.drivers.simulated_serial_bench import ENCODER_POSITION, OK, STATUSWORD, SerialBench, Silence

# Forwarding


async def test_a_forwarded_read_is_an_sdo_on_the_bus() -> None:
    bench = await SerialBench.booted()
    answer = await bench.ask(ENCODER_POSITION)
    position = bench.network.encoders["rear"].dictionary.read(0x6004, 0)
    assert answer.data == position
    assert bench.bus.heard == [
        (0x605, bytes.fromhex("4004600000000000")),
        (0x585, bytes.fromhex("43046000") + position),
    ]


async def test_a_forwarded_write_leaves_the_size_to_the_node() -> None:
    bench = await SerialBench.booted()
    assert (await bench.ask(make_write_object(2, 0x6060, 0, b"\3\0\0\0"))).error == 0
    assert bench.bus.of(0x602) == [bytes.fromhex("2260600003000000")]
    assert (await bench.ask(make_read_object(2, 0x6060, 0))).data == b"\3\0\0\0"


async def test_a_forwarded_abort_comes_back_as_the_error() -> None:
    bench = await SerialBench.booted()
    assert (await bench.ask(make_read_object(2, 0x5FFF, 0))).error == 0x0602_0000


async def test_a_forwarded_exchange_takes_the_can_frames_longer() -> None:
    bench = await SerialBench.booted()
    begin_s = asyncio.get_running_loop().time()
    await bench.exchange(ENCODER_POSITION)
    assert 0.0002 < bench.last_s - begin_s - (22 * 10 / 115200 + 0.0012) < 0.0003


async def test_a_node_that_does_not_answer_costs_the_forwarding_timeout() -> None:
    bench = await SerialBench.booted(timing=EposTiming(forwarding_timeout_s=0.3))
    bench.network.power_off(5)
    begin_s = asyncio.get_running_loop().time()
    assert (await bench.ask(ENCODER_POSITION)).error == 0x0504_0000
    assert 0.3 < bench.last_s - begin_s < 0.31


async def test_a_late_answer_is_not_taken_for_the_next_one() -> None:
    bench = await SerialBench.booted()
    bench.network.power_off(5)
    assert (await bench.ask(ENCODER_POSITION)).error == 0x0504_0000
    await bench.request(make_read_object(5, 0x1001, 0))
    await bench.bus.send(0x585, "4304600011223344")
    await bench.bus.send(0x585, "4F01100007000000")
    assert await bench.take(1) == b"\0"
    bench.write(OK)
    assert (await bench.take(11))[5:9] == b"\7\0\0\0"


async def test_a_long_object_is_too_long_for_the_short_read_of_another_node() -> None:
    bench = await SerialBench.booted()
    node = bench.network.node(5)
    node.dictionary.values[0x1008, 0] = "an encoder"
    assert (await bench.ask(make_read_object(5, 0x1008, 0))).error == 0x0607_0012
    assert bench.bus.of(0x605)[-1] == bytes.fromhex("8008100012000706")


async def test_a_stopped_gateway_is_in_the_wrong_state() -> None:
    bench = await SerialBench.booted()
    await bench.exchange(make_send_nmt(1, 2))
    assert (await bench.ask(STATUSWORD)).error == 0x0F00_FFC0
    assert (await bench.ask(ENCODER_POSITION)).error == 0x0F00_FFC0


async def test_a_gateway_cut_off_from_the_bus_still_has_its_own_objects() -> None:
    bench = await SerialBench.booted()
    bench.node.port.connected = False
    assert (await bench.ask(ENCODER_POSITION)).error == 0x0504_0000
    assert (await bench.ask(STATUSWORD)).error == 0


# Objects of any length


async def read_segmented(bench: SerialBench, node: int, index: int, sub: int) -> list[bytes]:
    """All segments of an object."""
    assert (await bench.ask(make_initiate_segmented_read(node, index, sub))).error == 0
    segments, toggle, more = [], 0, True
    while more:
        answer = await bench.ask(make_segment_read(toggle))
        assert (answer.error, answer.toggle) == (0, toggle)
        segments.append(answer.data)
        toggle, more = toggle ^ 1, answer.more
    return segments


@pytest.mark.parametrize("node", [1, 2])
@pytest.mark.parametrize(("size", "sizes"), [(4, [4]), (5, [5]), (63, [63]), (64, [63, 1]), (150, [63, 63, 24])])
async def test_an_object_of_any_length_is_read_in_segments(node: int, size: int, sizes: list[int]) -> None:
    bench = await SerialBench.booted()
    text = "".join(chr(33 + n % 90) for n in range(size))
    bench.network.node(node).dictionary.values[0x1008, 0] = text
    segments = await read_segmented(bench, node, 0x1008, 0)
    assert [len(segment) for segment in segments] == sizes
    assert b"".join(segments) == text.encode()


@pytest.mark.parametrize("node", [1, 2])
@pytest.mark.parametrize("sizes", [[4], [8], [3, 5], [7, 1], [63, 63, 24], [0, 5]])
async def test_an_object_is_written_in_segments(node: int, sizes: list[int]) -> None:
    bench = await SerialBench.booted()
    dictionary = bench.network.node(node).dictionary
    dictionary.objects[0x1008, 0] = replace(dictionary.objects[0x1008, 0], access=Access.RW)
    data = bytes(33 + n % 90 for n in range(sum(sizes)))
    assert (await bench.ask(make_initiate_segmented_write(node, 0x1008, 0, len(data)))).error == 0
    begin = 0
    for count, size in enumerate(sizes):
        answer = await bench.ask(make_segment_write(data[begin : begin + size], count & 1))
        assert (answer.error, answer.accepted, answer.toggle) == (0, size, count & 1)
        begin += size
    assert dictionary.read(0x1008, 0) == data


@pytest.mark.parametrize("node", [1, 2])
async def test_a_wrong_toggle_bit_ends_the_transfer(node: int) -> None:
    bench = await SerialBench.booted()
    bench.network.node(node).dictionary.values[0x1008, 0] = "x" * 100
    await bench.ask(make_initiate_segmented_read(node, 0x1008, 0))
    assert (await bench.ask(make_segment_read(1))).error == 0x0503_0000
    assert (await bench.ask(make_segment_read(0))).error == 0x0504_0001


async def test_more_than_was_announced_is_too_long() -> None:
    bench = await SerialBench.booted()
    await bench.ask(make_initiate_segmented_write(1, 0x60FF, 0, 4))
    assert (await bench.ask(make_segment_write(bytes(5), 0))).error == 0x0607_0012


async def test_a_node_that_dies_within_a_transfer_ends_it_by_timeout() -> None:
    bench = await SerialBench.booted()
    bench.network.node(2).dictionary.values[0x1008, 0] = "x" * 100
    await bench.ask(make_initiate_segmented_read(2, 0x1008, 0))
    bench.network.power_off(2)
    assert (await bench.ask(make_segment_read(0))).error == 0x0504_0000


# NMT and frames


async def test_nmt_for_another_node_goes_onto_the_bus() -> None:
    bench = await SerialBench.booted()
    assert await bench.exchange(make_send_nmt(2, 1)) == b""
    await asyncio.sleep(0.001)
    assert bench.bus.heard == [(0, b"\1\2")]
    assert bench.network.node(2).nmt_state == 5
    assert bench.node.nmt_state == 127


async def test_nmt_for_all_reaches_the_gateway_too() -> None:
    bench = await SerialBench.booted()
    await bench.exchange(make_send_nmt(0, 1))
    await asyncio.sleep(0.001)
    assert {bench.network.node(node).nmt_state for node in range(1, 7)} == {5}


@pytest.mark.parametrize("command", [129, 130])
async def test_a_restarting_gateway_loses_its_acknowledge_and_is_silent_until_it_has_booted(command: int) -> None:
    bench = await SerialBench.booted()
    frame = make_send_nmt(1, command)
    bench.write(frame[:1])
    assert await bench.take(1) == OK
    bench.write(frame[1:])
    with pytest.raises(Silence):
        await bench.take(1, limit_s=0.2)
    assert (await bench.ask(STATUSWORD)).error == 0


async def test_a_gateway_without_power_says_nothing() -> None:
    bench = await SerialBench.booted()
    bench.network.power_off(1)
    bench.write(b"\x10")
    with pytest.raises(Silence):
        await bench.take(1)


async def test_a_frame_is_sent_onto_the_bus_without_an_answer() -> None:
    bench = await SerialBench.booted()
    assert await bench.exchange(make_send_can_frame(0x202, b"\x06\0")) == b""
    await asyncio.sleep(0.001)
    assert bench.bus.heard == [(0x202, b"\x06\0")]


async def test_a_remote_frame_brings_the_guard_answer_of_another_node() -> None:
    bench = await SerialBench.booted()
    assert (await bench.ask(make_request_can_frame(0x702, 1))).data == b"\x7f"
    assert (await bench.ask(make_request_can_frame(0x702, 1))).data == b"\xff"
    assert bench.bus.heard[0] == (0x702 | RTR_FLAG, b"")


async def test_nobody_answers_the_guard_request_to_the_gateway_itself() -> None:
    bench = await SerialBench.booted()
    assert (await bench.ask(make_request_can_frame(0x701, 1))).error == 0x0504_0000
