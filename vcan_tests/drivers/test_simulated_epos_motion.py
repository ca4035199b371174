"""Profile velocity and profile position of the simulated EPOS 24/5, on a shaft with an inertia."""

from __future__ import annotations

import asyncio

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivers.simulated.epos_profile import PositionProfile
from vcan_tests.drivers.epos_bench import (
    BIT_12,
    BIT_13,
    FAULT,
    FAULT_REACTION,
    OPERATION_ENABLED,
    POSITION_PROFILE,
    TARGET_REACHED,
    VELOCITY_PROFILE,
    Bench,
    enabled,
)

# Mode 3


async def test_a_target_velocity_is_reached_by_the_acceleration_ramp() -> None:
    bench = await Bench.booted()
    await bench.u32(0x6083, 0, 4000)
    await bench.enable(VELOCITY_PROFILE)
    await bench.u32(0x60FF, 0, 2000)
    await asyncio.sleep(0.25)
    assert bench.rpm == pytest.approx(1000, abs=30)
    assert not await bench.status() & TARGET_REACHED
    await asyncio.sleep(0.5)
    assert bench.rpm == pytest.approx(2000, abs=5)
    assert await bench.status() & (TARGET_REACHED | BIT_12) == TARGET_REACHED


async def test_a_lower_target_is_reached_by_the_deceleration_ramp() -> None:
    bench = await Bench.booted()
    await bench.u32(0x6084, 0, 4000)
    await bench.enable(VELOCITY_PROFILE)
    await bench.u32(0x60FF, 0, 2000)
    await asyncio.sleep(0.5)
    await bench.u32(0x60FF, 0, 0)
    await asyncio.sleep(0.25)
    assert bench.rpm == pytest.approx(1000, abs=30)


async def test_speed_zero_is_shown_at_standstill() -> None:
    bench = await enabled(VELOCITY_PROFILE)
    assert await bench.status() & (TARGET_REACHED | BIT_12) == TARGET_REACHED | BIT_12


async def test_a_reversal_passes_zero_without_overshoot() -> None:
    bench = await enabled(VELOCITY_PROFILE)
    await bench.u32(0x60FF, 0, 1000)
    await asyncio.sleep(0.5)
    await bench.u32(0x60FF, 0, -1000)
    await asyncio.sleep(0.5)
    assert bench.rpm == pytest.approx(-1000, abs=5)
    assert int.from_bytes((await bench.read(0x606C)).to_bytes(4, "little"), "little", signed=True) + 1000 < 6


async def test_the_largest_profile_velocity_is_not_exceeded() -> None:
    bench = await Bench.booted()
    await bench.u32(0x607F, 0, 500)
    await bench.enable(VELOCITY_PROFILE)
    await bench.u32(0x60FF, 0, 2000)
    await asyncio.sleep(0.5)
    assert bench.rpm == pytest.approx(500, abs=5)


async def test_halt_stops_and_its_end_goes_on() -> None:
    bench = await enabled(VELOCITY_PROFILE)
    await bench.u32(0x60FF, 0, 1000)
    await asyncio.sleep(0.5)
    await bench.control(0x010F)
    await asyncio.sleep(0.5)
    assert abs(bench.rpm) < 1
    assert await bench.status() & TARGET_REACHED
    await bench.control(0x000F)
    await asyncio.sleep(0.5)
    assert bench.rpm == pytest.approx(1000, abs=5)


# Mode 1


async def test_a_set_point_waits_for_its_rising_edge() -> None:
    bench = await enabled(POSITION_PROFILE)
    await bench.u32(0x607A, 0, 20000)
    await asyncio.sleep(0.5)
    assert abs(bench.qc) < 2


async def test_a_move_ends_at_its_target_and_says_so() -> None:
    bench = await enabled(POSITION_PROFILE)
    await bench.u32(0x607A, 0, 20000)
    await bench.control(0x003F)
    assert await bench.status() & (TARGET_REACHED | BIT_12) == BIT_12
    await bench.control(0x000F)
    assert await bench.status() & (TARGET_REACHED | BIT_12) == 0
    await asyncio.sleep(1.0)
    assert await bench.status() & (TARGET_REACHED | BIT_12) == TARGET_REACHED
    assert abs(await bench.position() - 20000) <= 2


async def test_a_move_keeps_to_the_profile_velocity() -> None:
    bench = await enabled(POSITION_PROFILE)
    await bench.u32(0x6081, 0, 600)
    await bench.u32(0x607A, 0, 20000)
    await bench.control(0x003F)
    await asyncio.sleep(0.5)
    assert bench.rpm == pytest.approx(600, abs=5)


async def test_a_relative_move_starts_from_the_last_target() -> None:
    bench = await enabled(POSITION_PROFILE)
    await bench.u32(0x607A, 0, 2000)
    for _ in range(3):
        await bench.control(0x007F)
        await asyncio.sleep(0.5)
        await bench.control(0x000F)
    assert abs(await bench.position() - 6000) <= 2


async def test_a_second_set_point_waits_for_the_first() -> None:
    bench = await enabled(POSITION_PROFILE)
    await bench.u32(0x607A, 0, 10000)
    await bench.control(0x001F, 0x000F)
    await bench.u32(0x607A, 0, 0)
    await bench.control(0x001F, 0x000F)
    assert await bench.status() & BIT_12
    await asyncio.sleep(0.35)
    assert bench.qc > 9000
    await asyncio.sleep(1.0)
    assert abs(bench.qc) < 2
    assert not await bench.status() & BIT_12


async def test_a_set_point_at_once_replaces_the_one_under_way() -> None:
    bench = await enabled(POSITION_PROFILE)
    await bench.u32(0x607A, 0, 200000)
    await bench.control(0x001F, 0x000F)
    await asyncio.sleep(0.2)
    await bench.u32(0x607A, 0, 0)
    await bench.control(0x003F)
    await asyncio.sleep(1.0)
    assert abs(bench.qc) < 2


async def test_a_halted_move_goes_on_to_its_target() -> None:
    bench = await enabled(POSITION_PROFILE)
    await bench.u32(0x607A, 0, 20000)
    await bench.control(0x001F)
    await asyncio.sleep(0.2)
    await bench.control(0x010F)
    await asyncio.sleep(0.5)
    assert abs(bench.rpm) < 1
    assert await bench.status() & TARGET_REACHED
    await bench.control(0x000F)
    await asyncio.sleep(1.0)
    assert abs(bench.qc - 20000) < 2


async def test_a_blocked_move_is_a_following_error() -> None:
    bench = await enabled(POSITION_PROFILE)
    bench.world.blocked = True
    await bench.u32(0x607A, 0, 20000)
    await bench.control(0x001F)
    await asyncio.sleep(0.5)
    assert await bench.state() == FAULT
    assert await bench.status() & BIT_13
    assert bench.emergencies() == [0x8611]


async def test_a_target_beyond_the_limits_is_a_fault() -> None:
    bench = await enabled(POSITION_PROFILE)
    await bench.u32(0x607D, 2, 10000)
    await bench.u32(0x607A, 0, 10001)
    await bench.control(0x001F)
    await asyncio.sleep(0.1)
    assert bench.emergencies() == [0xFF09]
    assert await bench.state() == FAULT


async def test_a_move_without_a_velocity_is_a_parameter_fault() -> None:
    bench = await enabled(POSITION_PROFILE)
    await bench.u32(0x6081, 0, 0)
    await bench.u32(0x607A, 0, 1000)
    await bench.control(0x001F)
    assert bench.emergencies() == [0x6320]


async def test_mode_1_entered_in_motion_brakes_and_holds() -> None:
    bench = await enabled(VELOCITY_PROFILE)
    await bench.u32(0x60FF, 0, 1000)
    await asyncio.sleep(0.5)
    await bench.u8(0x6060, 0, POSITION_PROFILE)
    await asyncio.sleep(0.5)
    assert abs(bench.rpm) < 1
    assert await bench.state() == OPERATION_ENABLED


async def test_a_fault_in_a_move_brakes_from_the_present_speed() -> None:
    bench = await enabled(POSITION_PROFILE)
    await bench.u32(0x607A, 0, 200000)
    await bench.control(0x003F)
    await asyncio.sleep(0.5)
    bench.epos.trigger_fault(0x8130)
    assert await bench.state() == FAULT_REACTION
    await asyncio.sleep(0.05)
    assert bench.rpm == pytest.approx(500, abs=50)


# Generators


@settings(deadline=None)
@given(
    st.floats(-1e3, 1e3),
    st.floats(50.0, 1e3),
    st.floats(10.0, 1e4),
    st.floats(10.0, 1e4),
)
def test_a_trapezoid_arrives_without_overshoot_within_its_limits(
    end: float, top: float, up: float, down: float
) -> None:
    profile = PositionProfile()
    profile.aim(end, top, up, down)
    low, high = min(0.0, end), max(0.0, end)
    steps = 0
    while not profile.arrived:
        profile.step(0.01, halted=False)
        steps += 1
        assert low - 1e-6 <= profile.position <= high + 1e-6
        assert abs(profile.speed) <= top + 1e-9
        assert abs(profile.slope) <= 1.13 * max(up, down)
        assert steps < 10_000
    assert (profile.position, profile.speed) == (end, 0.0)
