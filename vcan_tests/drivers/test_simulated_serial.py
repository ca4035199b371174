"""The serial side of the simulated EPOS: bytes on virtual time, and one pseudo terminal in real time."""

from __future__ import annotations

import asyncio
import os
import struct
import termios
from dataclasses import replace
from random import Random

import pytest

from drivers.bus.contract import RTR_FLAG
from drivers.canopen.objects import Access
from drivers.epos.serial_frames import (
    Opcode,
    make_frame,
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
from drivers.simulated.serial_wire import SerialNoise, SerialPty
from vcan_tests.drivers.simulated_serial_bench import FAIL, OK, SerialBench, Silence

STATUSWORD = make_read_object(1, 0x6041, 0)
ENCODER_POSITION = make_read_object(5, 0x6004, 0)


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


# The pseudo terminal


async def read_exactly(fd: int, count: int) -> bytes:
    """Bytes from a terminal; it hands out what it has."""
    loop, data = asyncio.get_running_loop(), b""
    while len(data) < count:
        readable = asyncio.Event()
        loop.add_reader(fd, readable.set)
        await asyncio.wait_for(readable.wait(), 5.0)
        loop.remove_reader(fd)
        data += os.read(fd, count - len(data))
    return data


@pytest.mark.real_time
async def test_a_host_opens_the_terminal_and_reads_the_same_bytes() -> None:
    bench = await SerialBench.booted()
    pty = SerialPty(bench.serial.cable)
    fd = os.open(pty.device, os.O_RDWR | os.O_NOCTTY)
    os.write(fd, STATUSWORD[:1])
    assert await read_exactly(fd, 1) == OK
    os.write(fd, STATUSWORD[1:])
    assert await read_exactly(fd, 2) == OK + b"\0"
    os.write(fd, OK)
    assert (await read_exactly(fd, 11)).hex(" ") == "03 00 00 00 00 40 01 00 00 5d 46"
    os.close(fd)
    pty.close()
    await bench.network.close()


@pytest.mark.real_time
async def test_a_host_at_another_baud_rate_gets_garbage() -> None:
    bench = await SerialBench.booted(baud=9600)
    pty = SerialPty(bench.serial.cable)
    fd = os.open(pty.device, os.O_RDWR | os.O_NOCTTY)
    settings = termios.tcgetattr(fd)
    settings[4] = settings[5] = termios.B19200
    termios.tcsetattr(fd, termios.TCSANOW, settings)
    os.write(fd, 8 * STATUSWORD)
    assert set(await read_exactly(fd, 8)) - set(OK + FAIL)
    os.close(fd)
    pty.close()
    await bench.network.close()


@pytest.mark.real_time
async def test_closing_the_terminal_hangs_up_on_the_host() -> None:
    bench = await SerialBench.booted()
    pty = SerialPty(bench.serial.cable)
    fd = os.open(pty.device, os.O_RDWR | os.O_NOCTTY)
    pty.close()
    with pytest.raises(OSError, match="Input/output error"):
        os.write(fd, b"\x10")
    assert os.read(fd, 1) == b""
    with pytest.raises(FileNotFoundError):
        os.stat(pty.device)
    os.close(fd)
    await bench.network.close()
