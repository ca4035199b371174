"""Modes of operation of the simulated EPOS 24/5, on a shaft with an inertia."""

from __future__ import annotations

import asyncio
from math import pi

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivers.simulated.epos_profile import PositionProfile, Regulator
from vcan_tests.drivers.epos_bench import FAULT, FAULT_REACTION, MOTOR, OPERATION_ENABLED, Bench

TARGET_REACHED, BIT_12, BIT_13, REFERENCED = 0x0400, 0x1000, 0x2000, 0x8000
HOMING, VELOCITY_PROFILE, POSITION_PROFILE, POSITION, VELOCITY, CURRENT = 6, 3, 1, -1, -2, -3


async def enabled(mode: int) -> Bench:
    bench = await Bench.booted()
    await bench.enable(mode)
    return bench


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


async def test_too_much_speed_in_current_mode_is_a_fault_that_cuts_the_power() -> None:
    bench = await Bench.booted()
    await bench.u16(0x6410, 4, 500)
    await bench.enable(CURRENT)
    await bench.u16(0x2030, 0, 1000)
    await asyncio.sleep(0.5)
    assert bench.emergencies() == [0xFF05]
    assert await bench.state() == FAULT


# Current limit


async def test_the_output_current_limit_holds() -> None:
    bench = await Bench.booted()
    await bench.u16(0x6410, 2, 800)
    await bench.enable(CURRENT)
    await bench.u16(0x2030, 0, 3000)
    await asyncio.sleep(0.01)
    await bench.read(0x6041)
    assert bench.world.axes["bench"].current_a == 0.8


async def test_a_warm_winding_gets_the_continuous_current_only() -> None:
    bench = await Bench.booted()
    bench.world.blocked = True
    for sub, value in ((1, 1000), (2, 2000), (5, 10)):
        await bench.u16(0x6410, sub, value)
    await bench.enable(CURRENT)
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


# Homing


async def test_homing_on_the_present_position_needs_no_motion() -> None:
    bench = await enabled(HOMING)
    await bench.u8(0x6098, 0, 35)
    await bench.u32(0x2081, 0, 1000)
    await bench.control(0x001F)
    await asyncio.sleep(0.05)
    wanted = TARGET_REACHED | BIT_12 | REFERENCED
    assert await bench.status() & (wanted | BIT_13) == wanted
    assert abs(await bench.position() - 1000) <= 1


@pytest.mark.parametrize(("method", "turns"), [(34, 1), (33, 0)])
async def test_homing_finds_the_index(method: int, turns: int) -> None:
    bench = await Bench.booted()
    bench.world.axes["bench"].position_rad = 1.0
    await bench.enable(HOMING)
    await bench.u8(0x6098, 0, method)
    await bench.u32(0x6099, 2, 60)
    await bench.control(0x001F)
    await asyncio.sleep(3.0)
    assert await bench.status() & BIT_12
    assert bench.qc == pytest.approx(turns * 2000, abs=2)
    assert abs(await bench.position()) <= 2


@pytest.mark.parametrize(("method", "sign"), [(-3, 1), (-4, -1)])
async def test_homing_against_a_stop_ends_by_the_current(method: int, sign: int) -> None:
    bench = await enabled(HOMING)
    await bench.u8(0x6098, 0, method)
    await bench.u32(0x607C, 0, -sign * 400)
    await bench.u16(0x2080, 0, 1000)
    await bench.control(0x001F)
    await asyncio.sleep(1.0)
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
    await bench.u8(0x6098, 0, 17)
    await bench.control(0x001F)
    assert await bench.status() & (BIT_12 | BIT_13) == BIT_13


async def test_an_unknown_homing_method_is_refused() -> None:
    bench = await Bench.booted()
    assert await bench.u8(0x6098, 0, 5) == 0x06090030


async def test_a_quick_stop_ends_a_homing() -> None:
    bench = await enabled(HOMING)
    await bench.u8(0x6098, 0, 34)
    await bench.u32(0x6099, 2, 10)
    await bench.control(0x001F)
    await asyncio.sleep(0.2)
    await bench.control(0x0002)
    await asyncio.sleep(0.2)
    await bench.control(0x000F)
    await asyncio.sleep(0.5)
    assert abs(bench.rpm) < 1
    assert not await bench.status() & BIT_12


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
