"""Disturbances on the simulated wire: error frames, repetition, a participant with another bit rate."""

from __future__ import annotations

import asyncio

import pytest

from daemon.runtime.clock import run_virtual
from drivers.bus.wire_time import frame_bits
from drivers.simulated.bus import SimulatedBus
from vcan_tests.drivers.simulated_bus_bench import BIT_S, Frame, listen


async def test_a_destroyed_frame_is_repeated_after_the_error_frame() -> None:
    bus = SimulatedBus(seed=1, disturbed=0.5)
    sender, frames = bus.port("master"), listen(bus.port("node"))
    for number in range(20):
        sender.send(0x181, bytes([number]))
    await asyncio.sleep(0.1)
    assert [data[0] for _, data, _ in frames] == list(range(20))
    assert bus.error_frames > 0
    busy = sum(frame_bits(0x181, bytes([number])) for number in range(20)) * BIT_S
    assert bus.busy_s > busy + bus.error_frames * 70e-6


async def test_a_participant_with_another_bit_rate_disturbs_others_until_it_is_error_passive() -> None:
    bus = SimulatedBus()
    sender, frames = bus.port("master"), listen(bus.port("node"))
    wrong = listen(stranger := bus.port("stranger"))
    stranger.set_bit_rate(500_000)
    for number in range(30):
        sender.send(0x181, bytes([number]))
    await asyncio.sleep(0.1)
    assert ([data[0] for _, data, _ in frames], wrong) == (list(range(30)), [])
    assert (bus.error_frames, sender.counters.error_frames) == (16, 16)


async def test_a_participant_with_another_bit_rate_never_gets_a_frame_through_and_is_bus_off() -> None:
    bus = SimulatedBus()
    frames = listen(bus.port("node"))
    stranger = bus.port("stranger")
    stranger.set_bit_rate(500_000)
    stranger.send(0x705, b"\0")
    await asyncio.sleep(0.1)
    assert (frames, bus.error_frames, stranger.connected, stranger.lost) == ([], 32, False, 1)


@pytest.mark.parametrize(("seeds", "same"), [((3, 3), True), ((3, 4), False)])
def test_disturbances_follow_from_the_seed(seeds: tuple[int, int], same: bool) -> None:
    async def run(seed: int) -> list[Frame]:
        bus = SimulatedBus(seed=seed, disturbed=0.3)
        sender, frames = bus.port("master"), listen(bus.port("node"))
        for number in range(50):
            sender.send(0x181, bytes([number]))
        await asyncio.sleep(0.1)
        return frames

    assert (run_virtual(run(seeds[0])) == run_virtual(run(seeds[1]))) is same
