"""The serial side of the simulated EPOS on virtual time: its own objects, its handshake, and noise."""

from __future__ import annotations

import asyncio
import struct
from random import Random

import pytest

from drivers.epos.serial_frames import (
    Opcode,
    make_frame,
    make_read_object,
    make_segment_read,
    make_segment_write,
    make_write_object,
)
from drivers.simulated.serial import EposTiming
from drivers.simulated.serial_wire import SerialNoise
from vcan_tests.drivers.simulated_serial_bench import ENCODER_POSITION, FAIL, OK, STATUSWORD, SerialBench, Silence

# Own objects


async def test_an_object_of_the_gateway_is_read_byte_for_byte() -> None:
    bench = await SerialBench.booted()
    assert (await bench.exchange(STATUSWORD)).hex(" ") == "00 03 00 00 00 00 40 01 00 00 5d 46"


async def test_node_zero_is_the_gateway_itself() -> None:
    bench = await SerialBench.booted()
    assert await bench.ask(make_read_object(0, 0x6041, 0)) == await bench.ask(STATUSWORD)


async def test_what_is_written_is_read_back() -> None:
    bench = await SerialBench.booted()
    assert (await bench.ask(make_write_object(1, 0x60FF, 0, struct.pack("<i", -1000)))).error == 0
    assert (await bench.ask(make_read_object(1, 0x60FF, 0))).data == struct.pack("<i", -1000)


@pytest.mark.parametrize("filled", [b"\xff\0\0\0", b"\xff\xff\xff\xff"])
async def test_a_short_object_takes_zero_and_sign_extended_values(filled: bytes) -> None:
    bench = await SerialBench.booted()
    assert (await bench.ask(make_write_object(1, 0x6060, 0, filled))).error == 0
    assert (await bench.ask(make_read_object(1, 0x6060, 0))).data == b"\xff\0\0\0"


async def test_own_objects_need_no_frame_on_the_bus() -> None:
    bench = await SerialBench.booted()
    await bench.ask(STATUSWORD)
    assert bench.bus.heard == []


@pytest.mark.parametrize(
    ("request_frame", "error"),
    [
        (make_read_object(1, 0x5FFF, 0), 0x0602_0000),
        (make_read_object(1, 0x1018, 99), 0x0609_0011),
        (make_write_object(1, 0x6041, 0, b"\0\0\0\0"), 0x0601_0002),
        (make_read_object(1, 0x1008, 0), 0),
        (make_read_object(200, 0x6041, 0), 0x0F00_FFB9),
        (make_frame(0x10, bytes(8)), 0x0F00_FFBF),
        (make_segment_read(0), 0x0504_0001),
        (make_segment_write(b"abc", 0), 0x0504_0001),
    ],
)
async def test_a_refused_request_has_its_error_code(request_frame: bytes, error: int) -> None:
    bench = await SerialBench.booted()
    assert (await bench.ask(request_frame)).error == error


async def test_commands_of_later_drives_are_illegal() -> None:
    bench = await SerialBench.booted()
    assert (await bench.exchange(make_frame(0x31, b"\0\0")))[2:6] == bytes.fromhex("BFFF000F")


# Handshake


async def test_an_exchange_takes_the_time_of_its_bytes_and_the_drives_own() -> None:
    bench = await SerialBench.booted(timing=EposTiming(acknowledge_s=0.0001, answer_s=0.001))
    begin_s = asyncio.get_running_loop().time()
    await bench.exchange(STATUSWORD)
    line_bytes = 1 + 1 + 7 + 1 + 1 + 11  # the acknowledge of the frame goes out while the drive works out the answer
    assert bench.last_s - begin_s == pytest.approx(line_bytes * 10 / 115200 + 2 * 0.0001 + 0.001, abs=1e-9)


async def test_a_slow_line_takes_longer_by_its_baud_rate() -> None:
    bench = await SerialBench.booted(baud=9600)
    begin_s = asyncio.get_running_loop().time()
    await bench.exchange(STATUSWORD)
    line_bytes = 1 + 1 + 7 + 1 + 1 + 1 + 11
    assert bench.last_s - begin_s == pytest.approx(line_bytes * 10 / 9600 + 3 * 0.0001, abs=1e-9)


def test_a_baud_rate_that_no_drive_has_is_refused() -> None:
    with pytest.raises(ValueError, match="100000"):
        SerialBench(baud=100000)


async def test_the_drive_tells_its_baud_rate() -> None:
    bench = await SerialBench.booted(baud=57600)
    assert (await bench.ask(make_read_object(1, 0x2002, 0))).data[0] == 4


async def test_a_wrong_crc_is_refused_and_nothing_is_written() -> None:
    bench = await SerialBench.booted()
    frame = bytearray(make_write_object(1, 0x60FF, 0, b"\1\0\0\0"))
    frame[6] ^= 1
    assert await bench.request(bytes(frame)) == OK + FAIL
    assert (await bench.ask(make_read_object(1, 0x60FF, 0))).data == bytes(4)


async def test_an_unknown_operation_code_is_not_ready() -> None:
    bench = await SerialBench.booted()
    bench.write(b"\x7f")
    assert await bench.take(1) == FAIL


async def test_an_operation_code_while_another_node_is_asked_is_not_ready() -> None:
    bench = await SerialBench.booted()
    bench.network.power_off(5)
    assert await bench.request(ENCODER_POSITION) == OK + OK
    bench.write(b"\x10")
    assert await bench.take(1) == FAIL


async def test_a_host_that_refuses_the_answer_gets_none_and_may_ask_again_at_once() -> None:
    bench = await SerialBench.booted()
    assert await bench.request(STATUSWORD) == OK + OK
    assert await bench.take(1) == b"\0"
    bench.write(FAIL)
    assert (await bench.ask(STATUSWORD)).error == 0
    assert bench.serial.counters.resets == 0


async def test_a_host_that_does_not_acknowledge_is_waited_for_half_a_second() -> None:
    bench = await SerialBench.booted()
    await bench.request(STATUSWORD)
    await bench.take(1)
    await asyncio.sleep(0.49)
    assert bench.serial.counters.resets == 0
    await asyncio.sleep(0.02)
    assert bench.serial.counters.resets == 1
    assert (await bench.ask(STATUSWORD)).error == 0


async def test_half_a_request_is_forgotten_after_half_a_second() -> None:
    bench = await SerialBench.booted()
    bench.write(STATUSWORD[:1])
    await bench.take(1)
    bench.write(STATUSWORD[1:4])
    await asyncio.sleep(0.51)
    assert (await bench.ask(STATUSWORD)).error == 0


async def test_bytes_in_place_of_an_acknowledge_are_ignored() -> None:
    bench = await SerialBench.booted()
    await bench.request(STATUSWORD)
    await bench.take(1)
    bench.write(b"\x10")
    with pytest.raises(Silence):
        await bench.take(1, limit_s=0.1)


# Noise


async def test_noise_strikes_the_same_bytes_by_its_seed() -> None:
    noise = SerialNoise(lose=0.1, flip=0.1, duplicate=0.1, delay=0.1)
    heard = []
    for seed in (1, 1, 2):
        bench = await SerialBench.booted(noise=noise, seed=seed)
        for _ in range(20):
            bench.write(STATUSWORD)
            await asyncio.sleep(1.1)
        heard.append(bytes(bench.heard))
    assert heard[0] == heard[1] != heard[2]


@pytest.mark.parametrize(
    ("noise", "count"), [(SerialNoise(lose=1.0), 0), (SerialNoise(duplicate=1.0), 2), (SerialNoise(delay=1.0), 1)]
)
async def test_each_kind_of_noise_does_what_it_says(noise: SerialNoise, count: int) -> None:
    bench = await SerialBench.booted(noise=noise)
    bench.serial.cable.to_host.send(b"O", 0.0)
    await asyncio.sleep(0.1)
    assert bytes(bench.heard) == b"O" * count


async def test_a_flipped_byte_has_one_wrong_bit() -> None:
    bench = await SerialBench.booted(noise=SerialNoise(flip=1.0))
    bench.serial.cable.to_host.send(b"O", 0.0)
    assert ((await bench.take(1))[0] ^ 0x4F).bit_count() == 1


async def test_a_pulled_cable_loses_bytes_both_ways() -> None:
    bench = await SerialBench.booted()
    bench.serial.cable.pulled = True
    bench.write(b"\x10")
    with pytest.raises(Silence):
        await bench.take(1)
    bench.serial.cable.pulled = False
    assert (await bench.ask(STATUSWORD)).error == 0


async def test_no_bytes_make_the_drive_stumble() -> None:
    """Half of them are frames with a right CRC, so that random commands are carried out, too."""
    bench = await SerialBench.booted(timing=EposTiming(forwarding_timeout_s=0.01))
    trouble: list[str] = []
    asyncio.get_running_loop().set_exception_handler(lambda _, context: trouble.append(context["message"]))
    random = Random(1)
    for _ in range(2000):
        if random.random() < 0.5:
            bench.write(random.randbytes(random.randrange(1, 20)))
        else:
            frame = make_frame(random.choice(tuple(Opcode)), random.randbytes(2 * random.randrange(1, 8)))
            bench.write(frame[:1])
            await asyncio.sleep(0.001)
            bench.write(frame[1:])
        await asyncio.sleep(random.choice((0.005, 0.02, 0.6)))
        bench.write(OK)
    bench.network.power_off(1)
    bench.network.power_on(1)
    await asyncio.sleep(0.6)
    bench.heard.clear()
    assert (await bench.ask(STATUSWORD)).error == 0
    assert trouble == []
    assert bench.serial.counters.requests > 500
