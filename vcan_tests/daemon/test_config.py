"""Settings of drives: read, compared, written, kept; a drive at factory settings, a wrong one, a replaced one."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest
from msgspec.structs import replace

from canhelm.errors import Aborted, Interlock, NodeAbsent, Refused, Timeout, UsageError
from drivers.epos.objects import OBJECTS
from drivers.simulated.epos import SimulatedEpos
from profiles.loader import load
from profiles.schema import Gains
from vcan_tests.robot import Robot, running_robot

MOTOR_TYPE, ACCELERATION, HOMING, OUTPUT_MASK = "0x6402", "0x6083", "0x2080", "0x2078/2"
BOTH = ("config.apply", "config.restore")


def twin(robot: Robot, node: int) -> SimulatedEpos:
    found = robot.network.node(node)
    assert isinstance(found, SimulatedEpos)
    return found


def make_factory_new(robot: Robot, node: int) -> None:
    """Replace a drive that is off by one from the shelf: its DIP switches set, nothing else."""
    twin(robot, node).dictionary.forget()


async def power_cycle(robot: Robot, node: int) -> None:
    """Off, noticed, on, and ready again."""
    robot.network.power_off(node)
    await robot.until(lambda: robot.state == "waiting")
    robot.network.power_on(node)
    await until_idle(robot)


async def until_idle(robot: Robot) -> None:
    """Idle, with the brakes engaged."""
    brakes = robot.app.devices.brakes.values()
    await robot.until(lambda: robot.state == "idle" and all(brake.state == "engaged" for brake in brakes))


def by_object(result: dict[str, Any], key: str = "changes") -> dict[str, dict[str, Any]]:
    return {change["object"]: change for change in result[key]}


async def diff(robot: Robot, node: int, values: dict[str, int] | None = None, **params: Any) -> dict[str, Any]:
    return await robot.call("config.diff", node=node, values=values, **({"product_code": None} | params))


async def backup(robot: Robot, node: int) -> dict[str, int]:
    values: dict[str, int] = (await robot.call("config.dump", node=node))["values"]
    return values


async def change(robot: Robot, method: str = "config.apply", **params: Any) -> dict[str, Any]:
    defaults = {"values": None, "product_code": None, "dry_run": False, "save": False}
    return await robot.call(method, **(defaults | params))


# --- a drive at factory settings, one with wrong motor data, one replaced ---------------------------------------------


async def test_a_drive_at_factory_settings_is_refused_until_the_profile_was_saved_in_it() -> None:
    async with running_robot(powered=False, booted=False, expect_errors=True) as robot:
        make_factory_new(robot, 3)
        robot.network.power_on("all")
        await robot.until(lambda: robot.app.devices.by_node[3].node_state.value == "refused")
        told = robot.app.devices.by_node[3].status_sentence
        assert "0x6402 (motor_type) is 10 (0xA), expected 11 (0xB)" in told
        assert "`canhelm config apply 3 --save`" in told
        result = await change(robot, node=3, save=True)
        assert (result["saved"], result["restarted"], result["node_state"]) == (True, True, "ready")
        await until_idle(robot)
        await robot.call("motor.velocity", node=3, velocity_rpm=100.0, duration_s=0.2)


async def test_wrong_motor_data_is_told_and_mended_in_one_command() -> None:
    async with running_robot(powered=False, booted=False, expect_errors=True) as robot:
        twin(robot, 2).dictionary.commission({"motor_type": 1, "position_sensor_type": 2})
        robot.network.power_on("all")
        await robot.until(lambda: robot.app.devices.by_node[2].node_state.value == "refused")
        differences = by_object(await diff(robot, 2), "differences")
        assert (differences[MOTOR_TYPE]["was"], differences[MOTOR_TYPE]["wanted"]) == (1, 11)
        assert (differences["0x2210/2"]["was"], differences["0x2210/2"]["wanted"]) == (2, 1)
        await change(robot, node=2, save=True)
        await until_idle(robot)


async def test_a_replaced_drive_is_made_like_the_old_one_in_one_command() -> None:
    async with running_robot(expect_errors=True) as robot:
        await robot.call("sdo.write", node=4, object=HOMING, value=777)
        old = await backup(robot, 4)
        robot.network.power_off(4)
        await robot.until(lambda: robot.state == "waiting")
        make_factory_new(robot, 4)
        robot.network.power_on(4)
        await robot.until(lambda: robot.app.devices.by_node[4].node_state.value == "refused")
        result = await change(robot, "config.restore", node=4, values=old)
        assert (result["saved"], result["node_state"]) == (True, "ready")
        await power_cycle(robot, 4)
        assert await backup(robot, 4) == old


# --- what is written -------------------------------------------------------------------------------------------------


async def test_a_dry_run_shows_every_write_and_writes_nothing() -> None:
    async with running_robot() as robot:
        before = await backup(robot, 1)
        preview = await change(robot, node=1, values={HOMING: 650}, dry_run=True)
        assert by_object(preview)[HOMING]["wanted"] == 650
        assert await backup(robot, 1) == before
        done = await change(robot, node=1, values={HOMING: 650})
        assert by_object(done).keys() == by_object(preview).keys()
        assert (await backup(robot, 1))[HOMING] == 650


async def test_what_was_not_saved_is_gone_after_a_restart() -> None:
    async with running_robot(expect_errors=True) as robot:
        await change(robot, node=1, values={HOMING: 650})
        await power_cycle(robot, 1)
        assert (await backup(robot, 1))[HOMING] == 500


async def test_nothing_is_applied_while_a_drive_is_enabled() -> None:
    async with running_robot() as robot:
        await robot.call("motor.enable", node=2)
        with pytest.raises(Interlock):
            await change(robot, node=1, values={HOMING: 650})
        assert (await backup(robot, 1))[HOMING] == 500
        await robot.call("motor.disable", node=2)


async def test_a_setting_that_counts_from_the_start_is_refused_without_saving() -> None:
    async with running_robot() as robot:
        with pytest.raises(Refused, match="after saving and a restart"):
            await change(robot, node=1, values={MOTOR_TYPE: 10})
        assert robot.state == "idle"


async def test_node_id_and_bit_rate_are_never_changed() -> None:
    async with running_robot() as robot:
        result = await change(robot, node=1, values={"0x2000": 9, "0x2001": 3, HOMING: 650})
        assert "0x2000 (node_id_software) stays 1, not 9" in result["notes"][0]
        assert by_object(result).keys() >= {HOMING}
        after = await backup(robot, 1)
        assert (after["0x2000"], after["0x2001"]) == (1, 0)


async def test_a_value_that_does_not_fit_is_refused_before_anything_is_written() -> None:
    async with running_robot() as robot:
        with pytest.raises(UsageError, match="0x6410/1"):
            await change(robot, node=1, values={HOMING: 650, "0x6410/1": 9000})
        assert (await backup(robot, 1))[HOMING] == 500


async def test_settings_of_another_hardware_are_refused() -> None:
    async with running_robot() as robot:
        with pytest.raises(Refused, match="product 0x64102011"):
            await change(robot, node=1, values={HOMING: 650}, product_code=0x6410_2011)


async def test_a_comparison_with_the_settings_of_another_hardware_is_refused_like_writing_them() -> None:
    async with running_robot() as robot:
        with pytest.raises(Refused, match="product 0x64102011") as refused:
            await diff(robot, 1, {HOMING: 650}, product_code=0x6410_2011)
        assert (refused.value.value, refused.value.limit) == ("0x62102011", "0x64102011")


async def test_a_file_that_was_cut_short_is_told_when_it_is_compared_and_when_it_is_applied() -> None:
    async with running_robot() as robot:
        whole = await backup(robot, 1)
        half = dict(list(whole.items())[:40])
        told = "40 of the 96 settings of an EPOS 24/5 were given (is the file whole?)"
        assert (await diff(robot, 1, half))["notes"] == [told]
        assert (await change(robot, node=1, values=half, dry_run=True))["notes"] == [told]
        assert (await diff(robot, 1, whole))["notes"] == []


@pytest.mark.parametrize("node", [1, 2])
async def test_right_after_a_dump_comparing_applying_and_restoring_agree_that_nothing_is_to_be_written(
    node: int,
) -> None:
    async with running_robot() as robot:
        old = await backup(robot, node)
        previews = [await change(robot, method, node=node, values=old, dry_run=True) for method in BOTH]
        assert (await diff(robot, node, old))["differences"] == []
        assert [preview["changes"] for preview in previews] == [[], []]


async def test_applying_what_a_drive_has_already_does_not_take_it_out_of_operation() -> None:
    async with running_robot() as robot:
        old = await backup(robot, 1)
        result = await change(robot, node=1, values=old)
        assert (result["changes"], result["status"]) == ([], "node 1 (rear_right) is ready")
        assert not [event for event in robot.app.supervisor.log.last(9) if "left operation" in event["message"]]


async def test_the_outputs_beside_those_of_a_brake_are_compared_and_written() -> None:
    async with running_robot() as robot:
        old = await backup(robot, 1)
        wanted = old | {OUTPUT_MASK: 1 << 13}
        found = by_object(await diff(robot, 1, wanted), "differences")
        assert (found[OUTPUT_MASK]["was"], found[OUTPUT_MASK]["wanted"]) == (1 << 12, 1 << 12 | 1 << 13)
        await change(robot, node=1, values=wanted)
        await until_idle(robot)
        assert twin(robot, 1).dictionary.number("digital_output_functions_mask") == 1 << 12 | 1 << 13


async def test_settings_that_the_profile_decides_are_marked() -> None:
    async with running_robot() as robot:
        preview = await change(robot, node=1, values={ACCELERATION: 1}, dry_run=True)
        assert "the profile sets it to" in by_object(preview)[ACCELERATION]["note"]


async def test_saving_never_keeps_the_output_of_a_brake_switched_on() -> None:
    async with running_robot(expect_errors=True) as robot:
        assert twin(robot, 1).dictionary.number("digital_output_functions_mask") == 1 << 12
        await change(robot, node=1, values={HOMING: 650}, save=True)
        await until_idle(robot)
        robot.network.power_off(1)
        twin(robot, 1).dictionary.restart()
        assert twin(robot, 1).dictionary.number("digital_output_functions_mask") == 0


async def test_objects_of_later_firmware_are_probed_and_left_out() -> None:
    async with running_robot() as robot:
        later = {entry.address for entry in OBJECTS.objects if entry.firmware == "later"}
        assert not later & (await backup(robot, 1)).keys()
        result = await change(robot, node=1, values={"0x6067": 5}, dry_run=True)
        assert "0x6067 (position_window) is absent" in result["notes"][0]


async def test_a_robot_drives_on_after_its_settings_were_changed() -> None:
    async with running_robot() as robot:
        await change(robot, node=3, values=await backup(robot, 3), save=True)
        await until_idle(robot)
        driven = await robot.call("drive.parallel", angle_deg=0.0, speed_m_s=0.3, duration_s=1.0)
        assert driven["motion"]


async def test_reading_an_object_that_the_firmware_lacks_says_so() -> None:
    async with running_robot() as robot:
        with pytest.raises(Aborted, match=r"does not have 0x6067 \(position_window\): it came with later firmware"):
            await robot.call("sdo.read", node=1, object="position_window")
        with pytest.raises(Aborted, match="refused access"):
            await robot.call("sdo.read", node=1, object="0x2025")


async def test_an_object_is_read_with_type_and_unit() -> None:
    async with running_robot() as robot:
        found = await robot.call("sdo.read", node=1, object="0x6410/5")
        assert (found["value"], found["type"], found["unit"]) == (40, "u16", "100 ms")


async def test_a_drive_that_is_being_booted_is_waited_for() -> None:
    async with running_robot(powered=False, booted=False) as robot:
        robot.network.power_on("all")
        await robot.until(lambda: robot.app.devices.by_node[1].node_state.value == "configuring")
        result = await change(robot, node=1, values={HOMING: 650})
        assert result["node_state"] == "ready"
        assert (await backup(robot, 1))[HOMING] == 650


@pytest.mark.parametrize("after_s", [0.02, 0.1, 0.16, 0.2])
async def test_a_drive_that_goes_away_while_it_is_changed_is_told_and_comes_back_by_itself(after_s: float) -> None:
    async with running_robot(expect_errors=True) as robot:
        asyncio.get_running_loop().call_later(after_s, robot.network.power_off, 1)
        with pytest.raises((NodeAbsent, Timeout)):
            await change(robot, node=1, values={HOMING: 650, ACCELERATION: 7}, save=True)
        robot.network.power_on(1)
        await until_idle(robot)
        assert not (await diff(robot, 1))["differences"]


async def test_gains_that_the_profile_gives_are_written_at_each_boot_and_the_others_left_alone() -> None:
    profile = load("max2d").profile
    drives = {
        name: replace(drive, gains=Gains(velocity_p=1500, velocity_i=0)) for name, drive in profile.drives.items()
    }
    async with running_robot(replace(profile, drives=drives)) as robot:
        values = await backup(robot, 2)
        assert (values["0x60F9/1"], values["0x60F9/2"], values["0x60F6/1"]) == (1500, 0, 0)
        assert not (await diff(robot, 2))["differences"]


@pytest.mark.parametrize("node", [1, 2, 3, 4])
async def test_after_its_boot_a_drive_is_what_the_profile_expects(node: int) -> None:
    async with running_robot() as robot:
        found = await diff(robot, node)
        assert (found["compared"] > 30, found["differences"]) == (True, [])


@pytest.mark.parametrize("node", [1, 3])
async def test_settings_are_read_over_a_serial_line_as_over_can(node: int) -> None:
    async with running_robot(bus="rs232") as robot, asyncio.timeout(30.0):
        found = await diff(robot, node)
        assert (len(await backup(robot, node)), found["differences"]) == (96, [])
