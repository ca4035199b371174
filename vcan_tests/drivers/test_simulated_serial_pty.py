"""The serial side of the simulated EPOS behind a pseudo terminal, in real time."""

from __future__ import annotations

import asyncio
import os
import termios

import pytest

from drivers.simulated.serial_wire import SerialPty
from vcan_tests.drivers.simulated_serial_bench import FAIL, OK, STATUSWORD, SerialBench


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
