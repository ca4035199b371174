"""The CiA 406 encoder driver against its twin."""

from __future__ import annotations

import asyncio
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.contract import NodeState
from drivers.encoder.encoder import heading_of
from profiles.schema import EncoderConfig
from vcan_tests.drivers.bench import bench

SINGLE = EncoderConfig(node=5, counts_per_turn=4096, zero_counts=2048)
MIRRORED = EncoderConfig(node=5, counts_per_turn=4096, zero_counts=2048, direction=-1)


@pytest.mark.parametrize(
    ("counts", "heading_deg"), [(2048, 0.0), (3072, 90.0), (1024, -90.0), (2049, 360 / 4096), (0, -180.0)]
)
def test_headings_count_from_the_zero_position(counts: int, heading_deg: float) -> None:
    assert math.degrees(heading_of(counts, SINGLE)) == pytest.approx(heading_deg)


def test_a_mirrored_encoder_counts_the_other_way() -> None:
    assert heading_of(3072, MIRRORED) == pytest.approx(-math.pi / 2)


def test_a_zero_position_near_the_wrap_is_no_problem() -> None:
    config = EncoderConfig(node=5, counts_per_turn=4096, zero_counts=10)
    assert math.degrees(heading_of(4096 - 10, config)) == pytest.approx(-20 * 360 / 4096)


@given(st.integers(0, 2**32 - 1), st.integers(0, 4095))
def test_a_heading_is_within_half_a_turn(counts: int, zero: int) -> None:
    config = EncoderConfig(node=5, counts_per_turn=4096, zero_counts=zero)
    assert -math.pi <= heading_of(counts, config) <= math.pi


async def test_the_heading_of_the_pair_is_read_each_cycle() -> None:
    async with bench() as b:
        true_rad = b.network.world.heading_rad("front")
        assert b.encoder().heading_rad == pytest.approx(true_rad, abs=2 * math.pi / 4096)
        assert asyncio.get_running_loop().time() - b.encoder().reading_time_s <= 0.011


async def test_readings_come_once_a_cycle() -> None:
    async with bench() as b:
        nodes: list[int] = []
        b.devices.on_reading = nodes.append
        await asyncio.sleep(0.1)
        assert [nodes.count(node) for node in range(1, 7)] == [10] * 6


async def test_a_preset_makes_the_present_position_zero_and_gives_the_old_one() -> None:
    async with bench() as b:
        old = b.encoder().counts
        assert await b.encoder().preset_zero() == old
        await asyncio.sleep(0.02)
        assert b.encoder().heading_rad == 0.0


async def test_an_alarm_is_a_fault_until_the_encoder_takes_it_back() -> None:
    async with bench() as b:
        b.intruder.send(0x086, bytes.fromhex("00 50 01 00 00 00 00 00"))
        await asyncio.sleep(0.01)
        fault = b.encoder().fault
        assert fault is not None
        assert "position error (0x5000" in fault.message
        b.intruder.send(0x086, bytes(8))
        await asyncio.sleep(0.01)
        assert b.encoder().fault is None


async def test_a_lost_encoder_is_a_fault_and_comes_back() -> None:
    async with bench() as b:
        b.network.power_off(6)
        await asyncio.sleep(0.3)
        assert b.encoder().node_state is NodeState.ABSENT
        assert b.encoder().fault is not None
        b.network.power_on(6)
        await asyncio.sleep(0.6)
        assert b.encoder().node_state is NodeState.READY
        assert b.encoder().fault is None
