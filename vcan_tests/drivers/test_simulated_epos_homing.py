"""Homing of the simulated EPOS 24/5, on a shaft with an inertia."""

from __future__ import annotations

import asyncio

import pytest

from vcan_tests.drivers.epos_bench import BIT_12, BIT_13, HOMING, REFERENCED, TARGET_REACHED, Bench, enabled


async def home(bench: Bench, method: int, for_s: float = 0.0) -> None:
    """Begin to home by a method, and look on for a while."""
    await bench.u8(0x6098, 0, method)
    await bench.control(0x001F)
    await asyncio.sleep(for_s)


async def test_homing_on_the_present_position_needs_no_motion() -> None:
    bench = await enabled(HOMING)
    await bench.u32(0x2081, 0, 1000)
    await home(bench, 35, for_s=0.05)
    wanted = TARGET_REACHED | BIT_12 | REFERENCED
    assert await bench.status() & (wanted | BIT_13) == wanted
    assert abs(await bench.position() - 1000) <= 1


@pytest.mark.parametrize(("method", "turns"), [(34, 1), (33, 0)])
async def test_homing_finds_the_index(method: int, turns: int) -> None:
    bench = await Bench.booted()
    bench.world.axes["bench"].position_rad = 1.0
    await bench.enable(HOMING)
    await bench.u32(0x6099, 2, 60)
    await home(bench, method, for_s=3.0)
    assert await bench.status() & BIT_12
    assert bench.qc == pytest.approx(turns * 2000, abs=2)
    assert abs(await bench.position()) <= 2


@pytest.mark.parametrize(("method", "sign"), [(-3, 1), (-4, -1)])
async def test_homing_against_a_stop_ends_by_the_current(method: int, sign: int) -> None:
    bench = await enabled(HOMING)
    await bench.u32(0x607C, 0, -sign * 400)
    await bench.u16(0x2080, 0, 1000)
    await home(bench, method, for_s=1.0)
    assert bench.rpm * sign > 90
    bench.world.blocked = True
    stop = bench.qc
    await asyncio.sleep(0.15)
    bench.world.blocked = False
    await asyncio.sleep(2.0)
    assert await bench.status() & BIT_12
    assert (stop - bench.qc) * sign == pytest.approx(400, abs=5)
    assert abs(await bench.position()) <= 2


async def test_homing_without_its_switch_is_a_homing_error() -> None:
    bench = await enabled(HOMING)
    await home(bench, 17)
    assert await bench.status() & (BIT_12 | BIT_13) == BIT_13


async def test_an_unknown_homing_method_is_refused() -> None:
    bench = await Bench.booted()
    assert await bench.u8(0x6098, 0, 5) == 0x06090030


async def test_a_quick_stop_ends_a_homing() -> None:
    bench = await enabled(HOMING)
    await bench.u32(0x6099, 2, 10)
    await home(bench, 34, for_s=0.2)
    await bench.control(0x0002)
    await asyncio.sleep(0.2)
    await bench.control(0x000F)
    await asyncio.sleep(0.5)
    assert abs(bench.rpm) < 1
    assert not await bench.status() & BIT_12
