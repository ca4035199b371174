"""The EPOS driver against its twin: enabling, stopping, faults."""

from __future__ import annotations

import asyncio
import math

import msgspec
import pytest

from canhelm.errors import DeviceFault, Refused, Timeout
from drivers.contract import DriveState, NodeState
from drivers.epos.codec import RPDO1
from drivers.epos.objects import OBJECTS
from drivers.epos.state_machine import Mode, State
from drivers.epos.transitions import differing_bits
from vcan_tests.drivers.bench import Bench, bench, driving, max2d

CONFIG = max2d().drives["front_left"]


def axis_speed(b: Bench, name: str = "front_left") -> float:
    return b.network.world.axes[name].speed_rad_s


# --- enabling --------------------------------------------------------------------------------------------------------


async def test_no_drive_is_enabled_by_the_boot_up() -> None:
    async with bench() as b:
        assert {drive.state for drive in b.devices.drives.values()} == {DriveState.DISABLED}


async def test_enabling_reaches_operation_enabled() -> None:
    async with bench() as b:
        await b.drive().enable()
        assert b.drive().state is DriveState.ENABLED
        assert b.network.drives["front_left"].control.state is State.OPERATION_ENABLED


@pytest.mark.parametrize("name", ["target_velocity", "velocity_mode_setting_value", "current_mode_setting_value"])
async def test_a_stale_target_is_never_executed(name: str) -> None:
    async with bench() as b:
        await b.drive().sdo.write(OBJECTS[name], 2000)
        await b.drive().enable()
        await asyncio.sleep(0.5)
        assert axis_speed(b) == pytest.approx(0.0, abs=0.5)


async def test_a_stale_target_and_mode_together_move_nothing() -> None:
    async with bench() as b:
        await b.drive().sdo.write(OBJECTS["mode_of_operation"], Mode.VELOCITY)
        await b.drive().sdo.write(OBJECTS["velocity_mode_setting_value"], 2000)
        await b.drive().enable()
        await asyncio.sleep(0.5)
        assert axis_speed(b) == pytest.approx(0.0, abs=0.5)


async def test_a_target_before_enabling_is_not_followed() -> None:
    async with bench() as b:
        b.drive().command_speed(1.0)
        await b.drive().enable()
        await asyncio.sleep(0.5)
        assert axis_speed(b) == pytest.approx(0.0, abs=0.5)


async def test_a_target_is_followed_at_the_rim() -> None:
    async with bench() as b:
        await driving(b)
        assert b.drive().speed_m_s == pytest.approx(0.4, abs=0.01)
        assert b.drive("rear_right").speed_m_s == pytest.approx(0.4, abs=0.01)


async def test_velocity_mode_drives_too() -> None:
    profile = max2d()
    drives = {name: msgspec.structs.replace(drive, mode="velocity") for name, drive in profile.drives.items()}
    async with bench(msgspec.structs.replace(profile, drives=drives)) as b:
        await asyncio.gather(*(drive.enable() for drive in b.devices.drives.values()))
        for speed in (0.1, 0.2, 0.3):
            for drive in b.devices.drives.values():
                drive.command_speed(speed)
            await asyncio.sleep(0.3)
        assert b.drive().speed_m_s == pytest.approx(0.3, abs=0.02)


@pytest.mark.parametrize(("asked", "taken"), [(9.0, 2.0), (-9.0, -2.0), (math.nan, 0.0), (math.inf, 2.0)])
async def test_targets_are_held_within_the_top_speed(asked: float, taken: float) -> None:
    async with bench() as b:
        await b.drive().enable()
        b.drive().command_speed(asked)
        assert b.drive().target_speed_m_s == taken


async def test_without_cycles_enabling_says_that_no_reading_comes() -> None:
    async with bench() as b:
        b.cycle.stop()
        with pytest.raises(Timeout, match="no reading came"):
            await b.drive().enable()


async def test_a_drive_that_stays_behind_names_state_and_bits() -> None:
    async with bench(powered=False) as b:
        twin = b.network.drives["front_left"].dictionary
        twin.readers[twin.address("statusword")] = lambda: int(State.SWITCHED_ON)
        b.network.power_on()
        await asyncio.sleep(0.5)
        with pytest.raises(Timeout, match=r"switched on \(statusword 0x0123\).*bit 2 \(operation_enabled\)"):
            await b.drive().enable()


def test_differing_bits_are_named() -> None:
    assert "bit 4 (voltage_enabled)" in differing_bits(0x0123, State.OPERATION_ENABLED)


async def test_a_quick_stop_interrupts_enabling() -> None:
    async with bench() as b:
        for moment_s in (0.001, 0.01, 0.03, 0.05):
            enabling = asyncio.ensure_future(b.drive().enable())
            await asyncio.sleep(moment_s)
            b.drive().quick_stop()
            with pytest.raises(Refused, match="stopped in the meantime"):
                await enabling
            await asyncio.sleep(0.1)
            assert b.drive().state is not DriveState.ENABLED


# --- stopping --------------------------------------------------------------------------------------------------------


async def test_a_quick_stop_is_on_the_bus_at_once_and_not_undone_by_the_cycle() -> None:
    async with bench() as b:
        await driving(b)
        frames: list[tuple[int, bytes]] = []
        b.port.taps.append(lambda can_id, data, _: frames.append((can_id, data)))
        b.drive().quick_stop()
        await asyncio.sleep(0.002)
        assert (0x403, bytes.fromhex("02 00 03")) in frames
        assert (0x203, bytes(RPDO1.pack(0x0002, 0))) in frames
        states = set()
        for _ in range(100):
            await asyncio.sleep(0.01)
            states.add(b.drive().state)
        assert states <= {DriveState.ENABLED, DriveState.QUICK_STOP}
        assert b.drive().state is DriveState.QUICK_STOP


async def test_a_quick_stop_brings_the_wheel_to_rest_by_its_ramp() -> None:
    async with bench() as b:
        await driving(b)
        for drive in b.devices.drives.values():
            drive.quick_stop()
        await asyncio.sleep(0.4 / CONFIG.quick_stop_m_s2 + 0.15)
        assert b.drive().speed_m_s == pytest.approx(0.0, abs=0.01)


async def test_after_a_quick_stop_enabling_goes_on_with_a_zero_target() -> None:
    async with bench() as b:
        await driving(b)
        for drive in b.devices.drives.values():
            drive.quick_stop()
        await asyncio.sleep(1.0)
        await b.drive().enable()
        await asyncio.sleep(0.3)
        assert b.drive().state is DriveState.ENABLED
        assert b.drive().speed_m_s == pytest.approx(0.0, abs=0.01)


async def test_disabling_switches_the_power_stage_off() -> None:
    async with bench() as b:
        await b.drive().enable()
        await b.drive().disable()
        assert b.drive().state is DriveState.DISABLED
        assert not b.network.drives["front_left"].control.state.power_stage_on


# --- faults ----------------------------------------------------------------------------------------------------------


async def test_a_fault_is_told_with_code_words_and_cure() -> None:
    async with bench() as b:
        await b.drive().enable()
        b.network.drives["front_left"].trigger_fault(0x2310)
        await asyncio.sleep(0.05)
        fault = b.drive().fault
        assert fault is not None
        assert (fault.code, fault.node) == (0x2310, 3)
        assert "over-current (0x2310)" in fault.message
        assert fault.remedy
        assert b.drive().state is DriveState.FAULT
        with pytest.raises(DeviceFault, match="over-current"):
            await b.drive().enable()


async def test_a_reset_clears_the_fault_and_does_not_enable() -> None:
    async with bench() as b:
        await b.drive().enable()
        b.network.drives["front_left"].trigger_fault(0x2310)
        await asyncio.sleep(0.05)
        await b.drive().reset_fault()
        await asyncio.sleep(0.1)
        assert b.drive().fault is None
        assert b.drive().state is DriveState.DISABLED
        await b.drive().enable()


async def test_a_fault_whose_cause_stays_cannot_be_reset_until_it_is_gone() -> None:
    async with bench() as b:
        twin = b.network.drives["front_left"]
        twin.trigger_fault(0x3220, lasting=True)
        await asyncio.sleep(0.05)
        with pytest.raises(DeviceFault, match="under-voltage"):
            await b.drive().reset_fault()
        twin.clear_cause(0x3220)
        await b.drive().reset_fault()
        assert b.drive().state is DriveState.DISABLED


async def test_a_fault_at_boot_up_is_cleared() -> None:
    async with bench(powered=False) as b:
        b.network.power_on()
        await asyncio.sleep(0.0765)
        b.network.drives["front_left"].trigger_fault(0x2310)
        await asyncio.sleep(0.5)
        assert b.drive().node_state is NodeState.READY
        assert b.drive().state is DriveState.DISABLED
        assert b.drive().fault is None


async def test_a_lost_drive_is_unknown_and_what_waits_for_it_ends() -> None:
    async with bench() as b:
        b.network.power_off(3)
        enabling = asyncio.ensure_future(b.drive().enable())
        with pytest.raises(Exception, match="node 3"):
            await enabling
        await asyncio.sleep(0.3)
        assert b.drive().state is DriveState.UNKNOWN


async def test_a_drive_that_comes_back_stands_still_until_it_is_enabled() -> None:
    async with bench() as b:
        await driving(b)
        b.network.power_off(3)
        await asyncio.sleep(0.05)
        b.network.power_on(3)
        await asyncio.sleep(1.0)
        assert b.drive().node_state is NodeState.READY
        assert b.drive().state is DriveState.DISABLED
        assert b.drive().target_speed_m_s == 0.0


async def test_a_drive_that_leaves_operation_by_itself_is_a_fault() -> None:
    async with bench() as b:
        await b.drive().enable()
        b.intruder.send(0x403, bytes.fromhex("06 00 03"))
        await asyncio.sleep(0.03)
        fault = b.drive().fault
        assert fault is not None
        assert "left operation enabled by itself" in fault.message
        await asyncio.sleep(0.1)
        assert b.drive().state is DriveState.DISABLED
