"""Moves that the EPOS makes by itself, told by its driver: positions, homing, currents."""

from __future__ import annotations

import asyncio
import math

import pytest

from canhelm.errors import LimitExceeded, NotReady, Refused
from drivers.epos.objects import OBJECTS
from drivers.epos.state_machine import Mode
from vcan_tests.drivers.bench import Bench, bench, driving


async def released(b: Bench) -> None:
    """Let a single wheel turn: its pair's brake released."""
    await b.brake("front").release()


async def until_at_target(b: Bench) -> None:
    for _ in range(300):
        await asyncio.sleep(0.01)
        if b.drive().at_target:
            return
    raise AssertionError("the move did not end")


async def test_a_relative_move_ends_where_it_should() -> None:
    async with bench() as b:
        await released(b)
        await b.drive().enable()
        before = await b.drive().sdo.read_int(OBJECTS["position_actual_value"])
        await b.drive().move_to(2000, relative=True, speed_rpm=300)
        assert not b.drive().at_target
        await until_at_target(b)
        await asyncio.sleep(0.3)
        after = await b.drive().sdo.read_int(OBJECTS["position_actual_value"])
        assert after - before == pytest.approx(2000, abs=60)


async def test_two_moves_in_a_row_are_both_made() -> None:
    async with bench() as b:
        await released(b)
        await b.drive().enable()
        for target in (1500, 0):
            await b.drive().move_to(target, relative=False, speed_rpm=300)
            await until_at_target(b)
            await asyncio.sleep(0.3)
        assert await b.drive().sdo.read_int(OBJECTS["position_actual_value"]) == pytest.approx(0, abs=60)


async def test_a_move_needs_an_enabled_drive_at_rest() -> None:
    async with bench() as b:
        with pytest.raises(NotReady, match="motor enable"):
            await b.drive().move_to(100, relative=True, speed_rpm=300)
        await driving(b)
        with pytest.raises(Refused, match="still turns"):
            await b.drive().move_to(100, relative=True, speed_rpm=300)


@pytest.mark.parametrize(("position_qc", "speed_rpm"), [(100, 0.0), (100, -5.0), (100, 99_999.0), (2**31, 300.0)])
async def test_a_move_outside_its_limits_is_refused(position_qc: int, speed_rpm: float) -> None:
    async with bench() as b:
        await b.drive().enable()
        with pytest.raises(LimitExceeded):
            await b.drive().move_to(position_qc, relative=True, speed_rpm=speed_rpm)


async def test_homing_at_the_present_position_ends_at_once() -> None:
    async with bench() as b:
        await b.drive().enable()
        travel_m = b.drive().position_m
        await b.drive().home(35)
        await until_at_target(b)
        assert b.drive().position_m == pytest.approx(travel_m, abs=0.02)


async def test_a_current_turns_the_motor_and_zero_lets_it_go() -> None:
    async with bench() as b:
        await released(b)
        await b.drive().enable()
        await b.drive().set_current(0.8)
        await asyncio.sleep(0.1)
        assert b.drive().current_a == pytest.approx(0.8, abs=0.1)
        await b.drive().set_current(0.0)
        await asyncio.sleep(0.05)
        assert b.drive().current_a == pytest.approx(0.0, abs=0.05)


@pytest.mark.parametrize("current_a", [9.0, -9.0, math.nan])
async def test_a_current_above_the_continuous_one_is_refused(current_a: float) -> None:
    async with bench() as b:
        await b.drive().enable()
        with pytest.raises(LimitExceeded):
            await b.drive().set_current(current_a)


async def test_the_driving_mode_comes_back_with_a_zero_target() -> None:
    async with bench() as b:
        await b.drive().enable()
        await b.drive().set_current(0.1)
        await b.drive().use_driving_mode()
        assert b.drive().mode is Mode.PROFILE_VELOCITY
        assert await b.drive().sdo.read_int(OBJECTS["target_velocity"]) == 0
        assert await b.drive().sdo.read_int(OBJECTS["current_mode_setting_value"]) == 0


async def test_a_cyclic_target_does_not_disturb_a_move() -> None:
    async with bench() as b:
        await b.drive().enable()
        await b.drive().set_current(0.0)
        b.drive().command_speed(1.0)
        assert b.drive().target_speed_m_s == 0.0
