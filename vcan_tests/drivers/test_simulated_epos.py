"""Device control of the simulated EPOS 24/5: dictionary, states, faults, stops, inputs and outputs."""

from __future__ import annotations

import asyncio

import pytest

from drivers.epos.objects import OBJECTS
from vcan_tests.drivers.epos_bench import (
    DISABLE_VOLTAGE,
    ENABLE,
    FAULT,
    FAULT_REACTION,
    OPERATION_ENABLED,
    QUICK_STOP,
    QUICK_STOP_ACTIVE,
    READY_TO_SWITCH_ON,
    REFRESH,
    RESET,
    SHUTDOWN,
    SWITCH_ON,
    SWITCH_ON_DISABLED,
    SWITCHED_ON,
    Bench,
)

VELOCITY_MODE = 3


async def running(speed_rpm: int = 1000) -> Bench:
    """A drive that turns at a speed in mode 3."""
    bench = await Bench.booted()
    await bench.u32(0x60FF, 0, speed_rpm)
    await bench.enable(VELOCITY_MODE)
    await asyncio.sleep(0.5)
    assert abs(bench.rpm - speed_rpm) < 5
    return bench


# Dictionary


async def test_every_object_of_the_firmware_exists_and_no_later_one() -> None:
    bench = await Bench.booted()
    existing = {(entry.index, entry.sub) for entry in OBJECTS.objects if entry.firmware == "2011h"}
    assert existing == set(bench.epos.dictionary.objects)
    assert await bench.master.ask(1, bytes.fromhex("4017100000000000")) == bytes.fromhex("8017100000000206")
    assert await bench.master.ask(1, bytes.fromhex("4018100300000000")) == bytes.fromhex("8018100311000906")


async def test_every_readable_object_answers_a_read() -> None:
    bench = await Bench.booted()
    for entry in bench.epos.dictionary.objects.values():
        answer = await bench.master.ask(1, bytes((0x40, entry.index & 0xFF, entry.index >> 8, entry.sub)) + bytes(4))
        assert answer[0] != 0x80 or entry.access.value == "wo", entry.name


async def test_it_says_who_it_is() -> None:
    bench = await Bench.booted()
    identity = [await bench.read(*address) for address in ((0x1000, 0), (0x1018, 1), (0x2003, 1), (0x2003, 2))]
    assert identity == [0x200192, 0xFB, 0x2011, 0x6210]


@pytest.mark.parametrize("mode", [0, 2, -4, -5, -6])
async def test_a_mode_that_it_does_not_have_is_refused(mode: int) -> None:
    bench = await Bench.booted()
    assert await bench.u8(0x6060, 0, mode) == 0x06090030


@pytest.mark.parametrize("mode", [6, 3, 1, -1, -2, -3])
async def test_the_mode_display_follows_the_mode(mode: int) -> None:
    bench = await Bench.booted()
    await bench.u8(0x6060, 0, mode)
    assert await bench.read(0x6061) == mode & 0xFF


# States


async def test_it_is_at_switch_on_disabled_after_the_boot() -> None:
    bench = await Bench.booted()
    assert await bench.status() == SWITCH_ON_DISABLED


async def test_the_way_to_operation_enabled_leads_over_refresh() -> None:
    bench = await Bench.booted()
    states = []
    for word in (SHUTDOWN, SWITCH_ON, ENABLE):
        await bench.control(word)
        states.append(await bench.state())
    await asyncio.sleep(0.01)
    states.append(await bench.state())
    assert states == [READY_TO_SWITCH_ON, SWITCHED_ON, REFRESH, OPERATION_ENABLED]


async def test_enable_operation_out_of_ready_passes_switched_on() -> None:
    bench = await Bench.booted()
    await bench.control(SHUTDOWN, ENABLE)
    await asyncio.sleep(0.01)
    assert await bench.state() == OPERATION_ENABLED


async def test_enable_operation_out_of_switch_on_disabled_does_nothing() -> None:
    bench = await Bench.booted()
    await bench.control(ENABLE)
    assert await bench.state() == SWITCH_ON_DISABLED


async def test_a_word_written_during_refresh_counts_after_it() -> None:
    bench = await Bench.booted()
    await bench.control(SHUTDOWN, ENABLE, DISABLE_VOLTAGE)
    assert await bench.state() == REFRESH
    await asyncio.sleep(0.01)
    assert await bench.state() == SWITCH_ON_DISABLED


@pytest.mark.parametrize(
    ("word", "state"),
    [
        (SWITCH_ON, SWITCHED_ON),
        (SHUTDOWN, READY_TO_SWITCH_ON),
        (DISABLE_VOLTAGE, SWITCH_ON_DISABLED),
        (QUICK_STOP, QUICK_STOP_ACTIVE),
    ],
)
async def test_each_command_leads_out_of_operation_enabled(word: int, state: int) -> None:
    bench = await running()
    await bench.control(word)
    assert await bench.state() == state


async def test_a_disabled_drive_coasts() -> None:
    bench = await running()
    await bench.control(DISABLE_VOLTAGE)
    await asyncio.sleep(0.5)
    assert await bench.state() == SWITCH_ON_DISABLED
    assert bench.rpm == pytest.approx(1000, abs=5)


async def test_a_quick_stop_brakes_by_its_ramp_and_stays_active() -> None:
    bench = await Bench.booted()
    await bench.u32(0x6085, 0, 5000)
    await bench.u32(0x60FF, 0, 1000)
    await bench.enable(VELOCITY_MODE)
    await asyncio.sleep(0.5)
    await bench.control(QUICK_STOP)
    await asyncio.sleep(0.1)
    assert bench.rpm == pytest.approx(500, abs=30)
    await asyncio.sleep(0.5)
    assert abs(bench.rpm) < 1
    assert await bench.status() & 0x457F == QUICK_STOP_ACTIVE | 0x0400


async def test_enable_operation_resumes_after_a_quick_stop() -> None:
    bench = await running()
    await bench.control(QUICK_STOP)
    await asyncio.sleep(0.5)
    await bench.control(ENABLE)
    await asyncio.sleep(0.5)
    assert bench.rpm == pytest.approx(1000, abs=5)


async def test_a_stale_target_acts_as_soon_as_the_drive_is_enabled_again() -> None:
    bench = await running()
    await bench.control(DISABLE_VOLTAGE)
    bench.world.blocked = True
    await asyncio.sleep(1.0)
    bench.world.blocked = False
    await bench.control(SHUTDOWN, ENABLE)
    await asyncio.sleep(0.5)
    assert bench.rpm == pytest.approx(1000, abs=5)


async def test_targets_are_forgotten_with_the_power() -> None:
    bench = await running()
    bench.epos.power_off()
    bench.epos.power_on()
    await asyncio.sleep(0.06)
    assert await bench.read(0x60FF) == 0


async def test_the_position_starts_at_0_at_each_restart() -> None:
    bench = await running()
    assert await bench.position() > 10000
    await bench.control(DISABLE_VOLTAGE)
    bench.world.blocked = True
    await bench.master.nmt(129, 1)
    await asyncio.sleep(0.06)
    assert await bench.position() == 0


async def test_power_lost_in_motion_leaves_the_shaft_coasting() -> None:
    bench = await running()
    bench.epos.power_off()
    await asyncio.sleep(0.5)
    bench.world.advance(asyncio.get_running_loop().time())
    assert bench.rpm == pytest.approx(1000, abs=5)


# Faults


async def test_a_fault_of_class_d_cuts_the_power_at_once() -> None:
    bench = await running()
    bench.epos.trigger_fault(0x2310)
    assert await bench.state() == FAULT
    await asyncio.sleep(0.5)
    assert bench.rpm == pytest.approx(1000, abs=5)


async def test_a_fault_of_class_q_brakes_first() -> None:
    bench = await running()
    bench.epos.trigger_fault(0x81FD)
    assert await bench.state() == FAULT_REACTION
    await asyncio.sleep(0.2)
    assert await bench.state() == FAULT
    assert abs(bench.rpm) < 30


async def test_a_fault_of_class_q_without_power_is_a_fault_at_once() -> None:
    bench = await Bench.booted()
    bench.epos.trigger_fault(0x81FD)
    assert await bench.state() == FAULT


async def test_a_fault_during_refresh_prevents_the_enabling() -> None:
    bench = await Bench.booted()
    await bench.control(SHUTDOWN, ENABLE)
    bench.epos.trigger_fault(0x2310)
    await asyncio.sleep(0.05)
    assert await bench.state() == FAULT


async def test_a_fault_is_reset_by_the_rising_edge_only() -> None:
    bench = await Bench.booted()
    await bench.control(RESET)
    bench.epos.trigger_fault(0x2310)
    await bench.control(RESET)
    assert await bench.state() == FAULT
    await bench.control(DISABLE_VOLTAGE, RESET)
    assert await bench.state() == SWITCH_ON_DISABLED


async def test_a_reset_clears_the_error_register_but_not_the_history() -> None:
    bench = await Bench.booted()
    bench.epos.trigger_fault(0x2310)
    await bench.control(RESET)
    assert [await bench.read(0x1001), await bench.read(0x1003, 1)] == [0, 0x2310]


async def test_a_fault_is_not_reset_while_its_cause_lasts() -> None:
    bench = await Bench.booted()
    bench.epos.set_supply_voltage(9.0)
    await bench.control(RESET, DISABLE_VOLTAGE)
    assert await bench.state() == FAULT
    bench.epos.set_supply_voltage(24.0)
    await bench.control(RESET)
    assert await bench.state() == SWITCH_ON_DISABLED


@pytest.mark.parametrize(("voltage_v", "code"), [(9.0, 0x3220), (30.0, 0x3210)])
async def test_a_supply_out_of_range_is_a_fault(voltage_v: float, code: int) -> None:
    bench = await Bench.booted()
    bench.epos.set_supply_voltage(voltage_v)
    bench.epos.set_supply_voltage(voltage_v)
    await asyncio.sleep(0.001)
    assert bench.emergencies() == [code]


async def test_a_supply_that_is_low_at_the_start_is_a_fault_after_the_boot() -> None:
    bench = Bench()
    bench.epos.power_on()
    bench.epos.set_supply_voltage(9.0)
    await asyncio.sleep(0.06)
    assert bench.emergencies() == [0x3220]


async def test_a_changed_encoder_resolution_raises_the_sensor_fault() -> None:
    bench = await Bench.booted()
    await bench.u16(0x2210, 1, 500)
    assert bench.emergencies() == []
    await bench.u16(0x2210, 1, 1000)
    assert bench.emergencies() == [0x7320]


async def test_a_wrong_encoder_resolution_makes_a_wrong_speed() -> None:
    bench = await Bench.booted()
    await bench.u16(0x2210, 1, 1000)
    await bench.control(RESET, DISABLE_VOLTAGE)
    await bench.u32(0x60FF, 0, 500)
    await bench.enable(VELOCITY_MODE)
    await asyncio.sleep(0.5)
    assert bench.rpm == pytest.approx(1000, abs=5)


# Inputs and outputs


async def test_an_output_sinks_current_when_its_bit_is_0_and_the_mask_drives_it() -> None:
    bench = await Bench.booted()
    seen = [bench.epos.outputs.sinking(4)]
    for sub, value in ((1, 0x1000), (2, 0x1000), (1, 0), (3, 0x1000), (1, 0x1000), (2, 0)):
        await bench.u16(0x2078, sub, value)
        seen.append(bench.epos.outputs.sinking(4))
    assert seen == [False, False, False, True, False, True, False]


async def test_an_output_follows_the_function_that_it_is_given() -> None:
    bench = await Bench.booted()
    await bench.u16(0x2078, 2, 0x2000)
    assert [bench.epos.outputs.sinking(number) for number in (3, 4)] == [True, False]
    await bench.u16(0x2079, 4, 13)
    assert bench.epos.outputs.sinking(4)


async def test_the_ready_function_tells_of_a_fault() -> None:
    bench = await Bench.booted()
    await bench.u16(0x2079, 1, 0)
    await bench.u16(0x2078, 2, 1)
    assert not bench.epos.outputs.sinking(1)
    bench.epos.trigger_fault(0x2310)
    assert bench.epos.outputs.sinking(1)
    await bench.control(RESET)
    assert not bench.epos.outputs.sinking(1)


async def test_a_drive_without_power_sinks_nothing_and_tells_so() -> None:
    bench = await Bench.booted()
    changes: list[bool] = []
    bench.epos.outputs.connect(4, changes.append)
    await bench.u16(0x2078, 2, 0x1000)
    bench.epos.power_off()
    assert changes == [True, False]


async def test_inputs_show_by_function_mask_and_polarity() -> None:
    bench = await Bench.booted()
    bench.epos.set_digital_input(1, True)
    bench.epos.set_digital_input(4, True)
    assert await bench.read(0x2071, 1) == 0x8004
    await bench.u16(0x2071, 3, 0x0004)
    assert await bench.read(0x2071, 1) == 0x8000
    await bench.u16(0x2071, 2, 0)
    assert await bench.read(0x2071, 1) == 0


async def test_a_limit_switch_acts_only_when_it_is_executed() -> None:
    bench = await running()
    bench.epos.set_digital_input(6, True)
    assert await bench.state() == OPERATION_ENABLED
    await bench.u16(0x2071, 4, 0x0003)
    bench.epos.set_digital_input(5, True)
    assert await bench.state() == FAULT_REACTION
    assert bench.emergencies() == [0xFF07]


async def test_the_position_marker_captures_the_wanted_edge() -> None:
    bench = await running()
    await bench.u16(0x2070, 1, 3)
    await bench.u16(0x2071, 2, 0x0008)
    await bench.u8(0x2074, 2, 1)
    bench.epos.set_digital_input(1, True)
    captured = await bench.read(0x2074, 1)
    bench.epos.set_digital_input(1, False)
    assert 0 < await bench.position() - captured < 200
    assert await bench.read(0x2074, 1) == captured


async def test_analog_inputs_show_their_voltage() -> None:
    bench = await Bench.booted()
    bench.epos.set_analog_input(2, 1234)
    assert await bench.read(0x207C, 2) == 1234
