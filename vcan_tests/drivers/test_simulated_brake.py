"""The simulated brake and its times."""

from __future__ import annotations

import asyncio

from drivers.simulated.brake import SimulatedBrake
from profiles.schema import BrakeConfig


def make_brake(*, energise_to_release: bool = True) -> tuple[SimulatedBrake, list[tuple[bool, float]]]:
    """A brake that opens in 50 ms and closes in 30 ms, and what it did when."""
    moves: list[tuple[bool, float]] = []
    config = BrakeConfig(
        kind="steering",
        drive="bench",
        energise_to_release=energise_to_release,
        open_time_s=0.05,
        close_time_s=0.03,
    )
    return SimulatedBrake(config, lambda engaged: moves.append((engaged, asyncio.get_running_loop().time()))), moves


async def test_without_current_a_power_to_release_brake_is_engaged() -> None:
    brake, _ = make_brake()
    assert brake.engaged


async def test_without_current_a_power_to_engage_brake_is_released() -> None:
    brake, _ = make_brake(energise_to_release=False)
    assert not brake.engaged


async def test_it_opens_and_closes_after_its_times() -> None:
    brake, moves = make_brake()
    brake.set_coil(True)
    await asyncio.sleep(0.1)
    brake.set_coil(False)
    await asyncio.sleep(0.1)
    assert moves == [(False, 0.05), (True, 0.13)]


async def test_current_for_too_short_a_time_moves_nothing() -> None:
    brake, moves = make_brake()
    brake.set_coil(True)
    await asyncio.sleep(0.04)
    brake.set_coil(False)
    await asyncio.sleep(0.1)
    assert moves == []


async def test_the_opening_begins_anew_after_an_interruption() -> None:
    brake, moves = make_brake()
    brake.set_coil(True)
    await asyncio.sleep(0.04)
    brake.set_coil(False)
    brake.set_coil(True)
    await asyncio.sleep(0.1)
    assert [(engaged, round(time_s, 9)) for engaged, time_s in moves] == [(False, 0.09)]


async def test_a_power_to_engage_brake_engages_with_current() -> None:
    brake, moves = make_brake(energise_to_release=False)
    brake.set_coil(True)
    await asyncio.sleep(0.1)
    assert moves == [(True, 0.03)]
