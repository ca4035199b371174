"""The simulated CANopen slave: NMT, boot-up, guarding, emergencies, power. Shown on a drive."""

from __future__ import annotations

import asyncio

from hypothesis import given
from hypothesis import strategies as st

from daemon.runtime.clock import run_virtual
from drivers.bus.contract import RTR_FLAG
from vcan_tests.drivers.epos_bench import (
    FAULT,
    FAULT_REACTION,
    PRE_OPERATIONAL,
    RESET_COMMUNICATION,
    RESET_NODE,
    START,
    STOP,
    Bench,
)


async def guard_state(bench: Bench) -> int:
    return (await bench.master.guard(bench.node))[0][0] & 0x7F


async def test_power_up_ends_with_a_boot_up_message() -> None:
    bench = await Bench.booted(node=3)
    assert bench.master.heard == [(0x703, b"\0")]


async def test_the_boot_takes_its_time() -> None:
    bench = Bench()
    bench.epos.power_on()
    await asyncio.sleep(0.2)
    assert 0.05 < bench.master.times_s[0] < 0.051


async def test_a_node_without_power_is_silent() -> None:
    bench = await Bench.booted()
    bench.epos.power_off()
    assert await bench.master.guard(1) == []


async def test_a_node_that_lost_power_boots_anew() -> None:
    bench = await Bench.booted()
    bench.epos.power_off()
    await asyncio.sleep(0.1)
    bench.epos.power_on()
    await asyncio.sleep(0.06)
    assert bench.master.of(0x701) == [b"\0", b"\0"]


async def test_power_lost_while_booting_means_no_boot_up() -> None:
    bench = Bench()
    bench.epos.power_on()
    await asyncio.sleep(0.02)
    bench.epos.power_off()
    await asyncio.sleep(0.2)
    assert bench.master.heard == []


async def test_unsaved_values_are_lost_with_the_power() -> None:
    bench = await Bench.booted()
    await bench.u32(0x6083, 0, 1234)
    bench.epos.power_off()
    bench.epos.power_on()
    await asyncio.sleep(0.06)
    assert await bench.read(0x6083) == 10000


async def test_saved_values_outlive_the_power() -> None:
    bench = await Bench.booted()
    await bench.u32(0x6083, 0, 1234)
    assert await bench.u32(0x1010, 1, 0x65766173) == 0
    bench.epos.power_off()
    bench.epos.power_on()
    await asyncio.sleep(0.06)
    assert await bench.read(0x6083) == 1234


async def test_a_wrong_signature_saves_nothing() -> None:
    bench = await Bench.booted()
    assert await bench.u32(0x1010, 1, 0x12345678) == 0x08000020


async def test_defaults_come_back_with_a_restart() -> None:
    bench = await Bench.booted()
    await bench.u32(0x6083, 0, 1234)
    await bench.u32(0x1010, 1, 0x65766173)
    assert await bench.u32(0x1011, 1, 0x64616F6C) == 0
    await bench.master.nmt(RESET_NODE, 1)
    await asyncio.sleep(0.06)
    assert await bench.read(0x6083) == 10000


async def test_a_pulled_cable_silences_a_node() -> None:
    bench = await Bench.booted()
    bench.epos.port.connected = False
    assert await bench.master.guard(1) == []
    bench.epos.port.connected = True
    assert await bench.master.guard(1) == [b"\x7f"]


# NMT


async def test_commands_lead_to_their_states() -> None:
    bench = await Bench.booted()
    states = [await guard_state(bench)]
    for command in (START, STOP, PRE_OPERATIONAL):
        await bench.master.nmt(command, 1)
        states.append(await guard_state(bench))
    assert states == [127, 5, 4, 127]


async def test_node_0_means_all_and_another_node_means_another() -> None:
    bench = await Bench.booted()
    await bench.master.nmt(START, 2)
    assert await guard_state(bench) == 127
    await bench.master.nmt(START, 0)
    assert await guard_state(bench) == 5


async def test_a_reset_boots_anew() -> None:
    bench = await Bench.booted()
    for command in (RESET_NODE, RESET_COMMUNICATION):
        bench.master.heard.clear()
        await bench.master.nmt(command, 1)
        await asyncio.sleep(0.06)
        assert bench.master.of(0x701) == [b"\0"]


async def test_a_reset_of_the_communication_keeps_the_application() -> None:
    bench = await Bench.booted()
    await bench.u32(0x6083, 0, 1234)
    await bench.u16(0x100C, 0, 77)
    await bench.master.nmt(RESET_COMMUNICATION, 1)
    await asyncio.sleep(0.06)
    assert (await bench.read(0x6083), await bench.read(0x100C)) == (1234, 0)


async def test_a_stopped_node_answers_no_sdo() -> None:
    bench = await Bench.booted()
    await bench.master.nmt(STOP, 1)
    bench.master.heard.clear()
    await bench.master.send(0x601, "4000100000000000")
    assert bench.master.heard == []


async def test_bad_frames_are_counted() -> None:
    bench = await Bench.booted()
    for can_id, text in ((0x000, "01"), (0x000, "0701"), (0x601, "40"), (0x601, "")):
        await bench.master.send(can_id, text)
    assert bench.epos.counters.malformed == 4


@given(st.lists(st.tuples(st.sampled_from((0, 0x80, 0x201, 0x301, 0x401, 0x601, 0x701)), st.binary(max_size=8))))
def test_no_frame_upsets_a_node(frames: list[tuple[int, bytes]]) -> None:
    async def upset() -> int:
        bench = await Bench.booted()
        for can_id, data in frames:
            await bench.master.send(can_id, data.hex())
            await bench.master.send(can_id | RTR_FLAG)
        return bench.epos.port.receiver_errors

    assert run_virtual(upset()) == 0


# Guarding


async def test_the_toggle_bit_starts_at_0_and_alternates() -> None:
    bench = await Bench.booted()
    answers = [(await bench.master.guard(1))[0] for _ in range(3)]
    assert answers == [b"\x7f", b"\xff", b"\x7f"]


async def test_the_toggle_bit_starts_at_0_after_a_restart() -> None:
    bench = await Bench.booted()
    await bench.master.guard(1)
    await bench.master.nmt(RESET_COMMUNICATION, 1)
    await asyncio.sleep(0.06)
    assert await bench.master.guard(1) == [b"\x7f"]


async def life_guarded() -> Bench:
    """A drive that expects a request every 20 ms and gives its master up after 60 ms."""
    bench = await Bench.booted()
    await bench.u16(0x100C, 0, 20)
    await bench.u8(0x100D, 0, 3)
    return bench


async def test_life_guarding_waits_for_the_first_request() -> None:
    bench = await life_guarded()
    await asyncio.sleep(1.0)
    assert bench.emergencies() == []


async def test_a_lost_master_is_noticed_after_the_life_time() -> None:
    bench = await life_guarded()
    await bench.master.guard(1)
    await asyncio.sleep(0.055)
    assert bench.emergencies() == []
    await asyncio.sleep(0.01)
    assert bench.emergencies() == [0x8130]


async def test_a_life_time_of_0_ends_life_guarding_until_the_next_request() -> None:
    bench = await life_guarded()
    await bench.master.guard(1)
    await bench.u8(0x100D, 0, 0)
    await bench.u8(0x100D, 0, 3)
    await asyncio.sleep(0.5)
    assert bench.emergencies() == []
    await bench.master.guard(1)
    await asyncio.sleep(0.5)
    assert bench.emergencies() == [0x8130]


async def test_each_request_prolongs_the_life_time() -> None:
    bench = await life_guarded()
    for _ in range(10):
        await bench.master.guard(1)
        await asyncio.sleep(0.05)
    assert bench.emergencies() == []


async def test_a_drive_that_turns_is_braked_when_its_master_is_lost() -> None:
    bench = await life_guarded()
    await bench.u32(0x60FF, 0, 1000)
    await bench.enable(mode=3)
    await bench.master.guard(1)
    await asyncio.sleep(0.1)
    assert await bench.state() == FAULT_REACTION
    await asyncio.sleep(0.2)
    assert await bench.state() == FAULT
    assert abs(bench.rpm) < 50


async def test_a_lost_master_is_noticed_in_a_stopped_node_too() -> None:
    bench = await life_guarded()
    await bench.master.nmt(STOP, 1)
    await bench.master.guard(1)
    await asyncio.sleep(0.1)
    assert bench.emergencies() == []
    await bench.master.nmt(PRE_OPERATIONAL, 1)
    assert bench.emergencies() == [0x8130]


async def test_life_guarding_is_off_with_a_factor_of_0() -> None:
    bench = await life_guarded()
    await bench.u8(0x100D, 0, 0)
    await bench.master.guard(1)
    await asyncio.sleep(1.0)
    assert bench.emergencies() == []


# Emergencies


async def test_an_emergency_carries_code_and_error_register() -> None:
    bench = await Bench.booted(node=4)
    bench.epos.trigger_fault(0x2310)
    await asyncio.sleep(0.001)
    assert bench.master.of(0x084) == [bytes.fromhex("1023020000000000")]
    assert await bench.read(0x1001) == 0x02


async def test_the_error_history_keeps_the_five_newest() -> None:
    bench = await Bench.booted()
    for code in (0x1000, 0x2310, 0x3210, 0x4210, 0x8611, 0xFF02):
        bench.epos.trigger_fault(code)
    history = [await bench.read(0x1003, sub) for sub in range(6)]
    assert history == [5, 0xFF02, 0x8611, 0x4210, 0x3210, 0x2310]


async def test_writing_0_clears_the_error_history() -> None:
    bench = await Bench.booted()
    bench.epos.trigger_fault(0x1000)
    assert await bench.u8(0x1003, 0, 1) == 0x06090030
    assert await bench.u8(0x1003, 0, 0) == 0
    assert [await bench.read(0x1003), await bench.read(0x1003, 1)] == [0, 0]
