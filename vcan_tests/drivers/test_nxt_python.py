"""An independent client of the NXT, nxt-python, at the simulated brick on a pseudo terminal.

nxt-python is licensed under the GPL, version 3 or later. It is a tool of this test; nothing of canhelm imports it.
"""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable
from typing import Any, TypeVar

import nxt.backend.devfile
import nxt.brick
import nxt.motor
import pytest

from drivers.simulated.nxt import SimulatedNxt
from drivers.simulated.serial_wire import SerialPty

pytestmark = pytest.mark.real_time

T = TypeVar("T")


class Stranger:
    """The client, which blocks, in a thread."""

    def __init__(self, twin: SimulatedNxt, brick: Any) -> None:
        self.twin = twin
        self.brick = brick

    async def do(self, work: Callable[[Any], T]) -> T:
        return await asyncio.wait_for(asyncio.to_thread(work, self.brick), 10.0)


@pytest.fixture
async def stranger() -> AsyncIterator[Stranger]:
    twin = SimulatedNxt("Rover")
    pty = SerialPty(twin.cable)
    sock = nxt.backend.devfile.DevFileSock(pty.device)
    brick = await asyncio.to_thread(sock.connect)
    yield Stranger(twin, brick)
    sock.close()
    pty.close()


async def test_it_reads_the_battery(stranger: Stranger) -> None:
    assert await stranger.do(lambda brick: brick.get_battery_level()) == 8000


async def test_it_reads_who_the_brick_is(stranger: Stranger) -> None:
    name, address, _, free_flash = await stranger.do(lambda brick: brick.get_device_info())
    assert (name, address, free_flash) == ("Rover", "00:16:53:01:02:03", 65536)


async def test_it_reads_the_versions(stranger: Stranger) -> None:
    protocol, firmware = await stranger.do(lambda brick: brick.get_firmware_version())
    assert (protocol, firmware) == ((1, 124), (1, 31))


async def test_it_turns_a_motor_by_an_angle(stranger: Stranger) -> None:
    def turn(brick: Any) -> int:
        motor = brick.get_motor(nxt.motor.Port.B)
        motor.turn(60, 180)
        return int(motor.get_tacho().tacho_count)

    assert 180 <= await stranger.do(turn) < 330


async def test_it_runs_and_brakes_a_motor(stranger: Stranger) -> None:
    def run(brick: Any) -> None:
        motor = brick.get_motor(nxt.motor.Port.C)
        motor.run(50)
        for _ in range(10):
            brick.get_battery_level()
        motor.brake()

    await stranger.do(run)
    await asyncio.sleep(1.0)
    stranger.twin.catch_up()
    motor = stranger.twin.motors[2]
    assert motor.shaft_rad > 0.0
    assert abs(motor.speed_rad_s) < 0.1
