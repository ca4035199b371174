"""Modes without a profile of the simulated EPOS 24/5, on a shaft with an inertia, and the limits of its current."""

from __future__ import annotations

import asyncio
from math import pi

import pytest

from drivers.simulated.epos_profile import Regulator
from vcan_tests.drivers.epos_bench import CURRENT, FAULT, MOTOR, POSITION, VELOCITY, Bench, enabled

# Modes without a profile


async def test_mode_minus_2_jumps_to_its_setting() -> None:
    bench = await enabled(VELOCITY)
    await bench.u32(0x206B, 0, 300)
    await asyncio.sleep(0.2)
    assert bench.rpm == pytest.approx(300, abs=5)


async def test_mode_minus_1_holds_its_setting() -> None:
    bench = await enabled(POSITION)
    await bench.u32(0x2062, 0, 500)
    await asyncio.sleep(1.0)
    assert abs(bench.qc - 500) < 2


async def test_a_stale_position_setting_far_away_is_a_following_error() -> None:
    bench = await Bench.booted()
    await bench.u32(0x2062, 0, 50000)
    await bench.enable(POSITION)
    assert bench.emergencies() == [0x8611]


async def test_mode_minus_1_is_clipped_by_the_position_limits() -> None:
    bench = await enabled(POSITION)
    await bench.u32(0x607D, 2, 300)
    await bench.u32(0x2062, 0, 1500)
    await asyncio.sleep(1.0)
    assert abs(bench.qc - 300) < 2


async def test_mode_minus_3_makes_the_current_and_its_acceleration() -> None:
    bench = await enabled(CURRENT)
    await bench.u16(0x2030, 0, 500)
    start = bench.rpm
    await asyncio.sleep(0.1)
    await bench.read(0x6078)
    assert bench.world.axes["bench"].current_a == 0.5
    assert bench.rpm - start == pytest.approx(0.5 * 0.02 / 1e-4 * 0.1 * 30 / pi, rel=0.03)


async def test_a_measured_current_has_noise_that_the_seed_decides() -> None:
    values = []
    for _ in range(2):
        bench = await enabled(CURRENT)
        values.append([await bench.read(0x6078) for _ in range(20)])
    assert values[0] == values[1]
    assert len(set(values[0])) > 3


async def limited(limits: dict[int, int]) -> Bench:
    """A drive in current mode; limits of object 0x6410 by their sub-index."""
    bench = await Bench.booted()
    for sub, value in limits.items():
        await bench.u16(0x6410, sub, value)
    await bench.enable(CURRENT)
    return bench


async def test_too_much_speed_in_current_mode_is_a_fault_that_cuts_the_power() -> None:
    bench = await limited({4: 500})
    await bench.u16(0x2030, 0, 1000)
    await asyncio.sleep(0.5)
    assert bench.emergencies() == [0xFF05]
    assert await bench.state() == FAULT


# Current limit


async def test_the_output_current_limit_holds() -> None:
    bench = await limited({2: 800})
    await bench.u16(0x2030, 0, 3000)
    await asyncio.sleep(0.01)
    await bench.read(0x6041)
    assert bench.world.axes["bench"].current_a == 0.8


async def test_a_warm_winding_gets_the_continuous_current_only() -> None:
    bench = await limited({1: 1000, 2: 2000, 5: 10})
    bench.world.blocked = True
    await bench.u16(0x2030, 0, 2000)
    await asyncio.sleep(0.2)
    await bench.read(0x6041)
    assert bench.world.axes["bench"].current_a == 2.0
    await asyncio.sleep(0.2)
    assert await bench.read(0x2024) & 0x80
    assert bench.world.axes["bench"].current_a == 1.0


def test_a_winding_warms_by_its_time_constant() -> None:
    regulator = Regulator(MOTOR)
    regulator.continuous_a, regulator.output_a, regulator.winding_s = 1.0, 2.0, 1.0
    steps = 0
    while not regulator.limited:
        regulator.limit(2.0, 0.001)
        steps += 1
    assert steps == pytest.approx(288, abs=2)  # 1 = 4 (1 - exp(-t / 1 s)): t = ln(4/3) s
