"""The frames of a bus, gathered for all who record them."""

from __future__ import annotations

import asyncio

import pytest

from daemon.runtime.gathering import WAITING_BYTES, Gathering
from drivers.bus.candump import PACKED_BYTES, unpack_frames
from drivers.simulated.bus import SimulatedBus, SimulatedPort


@pytest.fixture
def port() -> SimulatedPort:
    return SimulatedBus().port("master")


def numbers(packed: bytes | bytearray) -> list[int]:
    return [can_id for _, can_id, _ in unpack_frames(packed)]


async def send(port: SimulatedPort, *can_ids: int) -> None:
    for can_id in can_ids:
        port.send(can_id)
    await asyncio.sleep(0.01)


async def test_each_gets_the_frames_from_its_joining_to_its_leaving(port: SimulatedPort) -> None:
    gathering, first, second = Gathering(port), bytearray(), bytearray()
    gathering.join(first.extend)
    await send(port, 1)
    gathering.join(second.extend)
    await send(port, 2)
    gathering.leave(first.extend)
    await send(port, 3)
    gathering.leave(second.extend)
    assert (numbers(first), numbers(second)) == ([1, 2], [2, 3])


async def test_nobody_listens_to_the_bus_when_nobody_records(port: SimulatedPort) -> None:
    gathering, frames = Gathering(port), bytearray()
    gathering.join(frames.extend)
    assert len(port.taps) == 1
    gathering.leave(frames.extend)
    assert port.taps == []


async def test_many_frames_do_not_wait_until_somebody_asks(port: SimulatedPort) -> None:
    gathering, frames = Gathering(port), bytearray()
    gathering.join(frames.extend)
    for _ in range(WAITING_BYTES // PACKED_BYTES // 10 + 1):
        await send(port, *range(1, 11))
    assert frames
