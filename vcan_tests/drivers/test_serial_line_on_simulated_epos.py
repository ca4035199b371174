"""The host's line and the simulated drive's serial side, each written from the manual, on one cable."""

from __future__ import annotations

from random import Random

import pytest

from canhelm.errors import Aborted, Timeout
from drivers.epos.objects import OBJECTS
from drivers.epos.serial_frames import (
    make_initiate_segmented_read,
    make_read_object,
    make_request_can_frame,
    make_segment_read,
    make_send_nmt,
    make_write_object,
)
from drivers.epos.serial_line import SerialLine
from drivers.simulated.serial_wire import SerialNoise
from vcan_tests.drivers.simulated_serial_bench import SerialBench

BAUD = 115200
NODES = (1, 2, 3, 4)
CONSTANT = [
    entry for entry in OBJECTS.objects if entry.name.startswith(("profile_", "max_", "motor_", "current_regulator"))
]


async def a_line(noise: SerialNoise | None = None) -> tuple[SerialBench, SerialLine]:
    bench = await SerialBench.booted(BAUD, noise=noise or SerialNoise(), seed=7)
    return bench, SerialLine(bench.serial.cable, BAUD)


async def test_the_gateways_own_object_is_read() -> None:
    _, line = await a_line()
    assert (await line.request(make_read_object(0, 0x1000, 0))).data == bytes.fromhex("92 01 20 00")


async def test_an_object_of_another_node_is_read_and_written() -> None:
    _, line = await a_line()
    await line.request(make_write_object(3, 0x6083, 0, (4321).to_bytes(4, "little")))
    assert (await line.request(make_read_object(3, 0x6083, 0))).data == (4321).to_bytes(4, "little")


async def test_a_long_object_is_read_in_segments() -> None:
    _, line = await a_line()
    await line.request(make_initiate_segmented_read(2, 0x1008, 0))
    answer = await line.request(make_segment_read(0))
    assert (answer.data.rstrip(b"\0"), answer.more) == (b"EPOS", False)


async def test_a_dead_node_is_told_by_the_gateway() -> None:
    _, line = await a_line()
    with pytest.raises(Aborted, match="SDO time-out"):
        await line.request(make_read_object(77, 0x6041, 0))


async def test_a_node_is_started_and_guarded() -> None:
    _, line = await a_line()
    await line.request(make_send_nmt(2, 1))
    assert (await line.request(make_request_can_frame(0x702, 1))).data[0] & 0x7F == 5


async def test_a_gateway_that_restarts_is_used_again() -> None:
    _, line = await a_line()
    await line.request(make_send_nmt(1, 129))
    assert (await line.request(make_read_object(0, 0x1000, 0), timeout_s=10.0)).data == bytes.fromhex("92 01 20 00")


async def test_noise_brings_no_wrong_value() -> None:
    """One byte in a hundred is lost, flipped, doubled or delayed."""
    bench, line = await a_line(SerialNoise(0.0025, 0.0025, 0.0025, 0.0025))
    dice = Random(3)
    answered = 0
    for _ in range(1000):
        node, entry = dice.choice(NODES), dice.choice(CONSTANT)
        expected = bench.network.node(node).dictionary.read(entry.index, entry.sub)
        try:
            answer = await line.request(make_read_object(node, entry.index, entry.sub))
        except Timeout:
            continue
        assert answer.data[: len(expected)] == expected
        answered += 1
    assert answered > 950
