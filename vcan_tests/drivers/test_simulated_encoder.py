"""The simulated CiA 406 encoder."""

from __future__ import annotations

import asyncio
from math import pi, radians
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from daemon.runtime.clock import run_virtual
from drivers.bus.contract import RTR_FLAG
from drivers.simulated.bus import SimulatedBus
from drivers.simulated.encoder import SimulatedEncoder
from profiles.schema import EncoderConfig
from vcan_tests.drivers.epos_bench import BenchWorld, RawMaster

START, SYNC = 1, 0x080
TPDO1, TPDO2 = 0x185, 0x285


class EncoderBench:
    """An encoder of 4096 counts whose heading the test sets."""

    def __init__(self, **config: Any) -> None:
        medium = SimulatedBus()
        self.world = BenchWorld()
        settings = EncoderConfig(**{"node": 5, "counts_per_turn": 4096, "zero_counts": 2048} | config)
        self.encoder = SimulatedEncoder(medium.port("encoder"), settings, "rear", self.world, 0.05)
        self.master = RawMaster(medium)

    @classmethod
    async def booted(cls, **config: Any) -> EncoderBench:
        """An encoder that has power and has sent its boot-up message."""
        bench = cls(**config)
        bench.encoder.power_on()
        await asyncio.sleep(0.06)
        return bench

    async def read(self, index: int, sub: int = 0) -> int:
        """Read an object."""
        return await self.master.read(5, index, sub)

    def positions(self, can_id: int) -> list[int]:
        """Position values heard in a PDO."""
        return [int.from_bytes(data, "little") for data in self.master.of(can_id)]


async def test_it_says_what_it_is() -> None:
    single, multi = await EncoderBench.booted(), await EncoderBench.booted(total_counts=8 * 4096)
    assert [await single.read(0x1000), await single.read(0x6502)] == [0x00010196, 1]
    assert [await multi.read(0x1000), await multi.read(0x6502)] == [0x00020196, 8]
    assert [await multi.read(0x6501), await multi.read(0x6002)] == [4096, 32768]


@pytest.mark.parametrize(("direction", "counts"), [(1, 2048 + 1024), (-1, 2048 - 1024)])
async def test_counts_grow_in_the_direction_of_the_profile(direction: int, counts: int) -> None:
    bench = await EncoderBench.booted(direction=direction)
    bench.world.heading = pi / 2
    assert await bench.read(0x6004) == counts


async def test_the_position_wraps_at_its_range() -> None:
    bench = await EncoderBench.booted(zero_counts=0)
    bench.world.heading = radians(-90)
    assert await bench.read(0x6004) == 3072


@given(st.floats(-1.5, 1.5))
def test_the_position_is_the_heading_to_half_a_count(heading_rad: float) -> None:
    async def counts() -> int:
        bench = await EncoderBench.booted()
        bench.world.heading = heading_rad
        return await bench.read(0x6004)

    assert abs(run_virtual(counts()) - 2048 - heading_rad / (2 * pi) * 4096) <= 0.5001


async def test_code_direction_reverses_the_counts() -> None:
    bench = await EncoderBench.booted()
    bench.world.heading = pi / 2
    await bench.master.u16(5, 0x6000, 0, 1)
    assert [await bench.read(0x6004), await bench.read(0x6500)] == [2048 - 1024, 1]


async def test_scaling_changes_units_and_range() -> None:
    bench = await EncoderBench.booted(zero_counts=0)
    await bench.master.u32(5, 0x6001, 0, 360)
    await bench.master.u32(5, 0x6002, 0, 360)
    await bench.master.u16(5, 0x6000, 0, 4)
    bench.world.heading = radians(-30)
    assert await bench.read(0x6004) == 330


async def test_a_preset_makes_the_present_position_that_value() -> None:
    bench = await EncoderBench.booted()
    bench.world.heading = radians(10)
    assert await bench.master.u32(5, 0x6003, 0, 100) == 0
    assert await bench.read(0x6004) == 100
    bench.world.heading = radians(100)
    assert await bench.read(0x6004) == 1124
    assert await bench.read(0x6509) == 100 - (2048 + 114) + 4096


async def test_a_preset_beyond_the_range_is_refused() -> None:
    bench = await EncoderBench.booted()
    assert await bench.master.u32(5, 0x6003, 0, 4096) == 0x06090031


async def test_a_saved_preset_outlives_the_power_and_another_does_not() -> None:
    bench = await EncoderBench.booted()
    await bench.master.u32(5, 0x6003, 0, 100)
    await bench.master.u32(5, 0x1010, 1, 0x65766173)
    await bench.master.u32(5, 0x6003, 0, 200)
    bench.encoder.power_off()
    bench.encoder.power_on()
    await asyncio.sleep(0.06)
    assert await bench.read(0x6004) == 100


async def test_tpdo1_is_sent_once_on_start_and_then_by_the_cyclic_timer() -> None:
    bench = await EncoderBench.booted()
    await bench.master.nmt(START, 5)
    await asyncio.sleep(0.1)
    assert bench.positions(TPDO1) == [2048]
    await bench.master.u16(5, 0x6200, 0, 20)
    await asyncio.sleep(0.1)
    assert len(bench.positions(TPDO1)) == 1 + 5


async def test_the_cyclic_timer_rests_with_the_pdos() -> None:
    bench = await EncoderBench.booted()
    await bench.master.u16(5, 0x6200, 0, 20)
    await asyncio.sleep(0.1)
    assert bench.positions(TPDO1) == []


async def test_event_timer_and_cyclic_timer_are_one() -> None:
    bench = await EncoderBench.booted()
    await bench.master.u16(5, 0x1800, 5, 30)
    assert await bench.read(0x6200) == 30
    await bench.master.u16(5, 0x6200, 0, 40)
    assert await bench.read(0x1800, 5) == 40


async def test_tpdo2_is_sent_at_each_sync() -> None:
    bench = await EncoderBench.booted()
    await bench.master.nmt(START, 5)
    await bench.master.send(SYNC)
    bench.world.heading = pi / 4
    await bench.master.send(SYNC)
    assert bench.positions(TPDO2) == [2048, 2560]


async def test_tpdo1_answers_a_remote_frame() -> None:
    bench = await EncoderBench.booted()
    await bench.master.nmt(START, 5)
    await bench.master.send(TPDO1 | RTR_FLAG)
    assert bench.positions(TPDO1) == [2048, 2048]


async def test_alarms_come_and_go_with_an_emergency_each() -> None:
    bench = await EncoderBench.booted()
    bench.encoder.set_alarms(1)
    bench.encoder.set_alarms(1)
    assert [await bench.read(0x6503), await bench.read(0x1001), await bench.read(0x1003, 1)] == [1, 1, 0x5000]
    bench.encoder.set_alarms(0)
    await asyncio.sleep(0.001)
    assert bench.master.of(0x085) == [bytes.fromhex("0050010100000000"), bytes(8)]
    assert await bench.read(0x6503) == 0


async def test_guarding_and_heartbeat_tell_the_state() -> None:
    bench = await EncoderBench.booted()
    assert await bench.master.guard(5) == [b"\x7f"]
    bench.master.heard.clear()
    await bench.master.u16(5, 0x1017, 0, 50)
    await asyncio.sleep(0.12)
    assert bench.master.of(0x705) == [b"\x7f", b"\x7f"]


async def test_a_long_text_is_read_in_segments() -> None:
    bench = await EncoderBench.booted()
    await bench.master.ask(5, bytes.fromhex("4008100000000000"))
    text = b""
    for toggle in (0x60, 0x70, 0x60):
        answer = await bench.master.ask(5, bytes((toggle,)) + bytes(7))
        text += answer[1 : 8 - (answer[0] >> 1 & 7)]
    assert text == b"CiA 406 encoder"
