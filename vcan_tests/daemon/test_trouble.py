"""A whole simulated MAX2D: what it does when something breaks."""

from __future__ import annotations

import asyncio

import pytest

from canhelm.errors import CanhelmError, DeviceFault, EmergencyStop, NotReady
from drivers.epos.objects import OBJECTS
from drivers.simulated.epos import SimulatedEpos
from vcan_tests.robot import Robot, running_robot

TWO_GUARDING_PERIODS_S = 0.2


async def _drive(robot: Robot) -> asyncio.Task[dict[str, object]]:
    driving = asyncio.create_task(robot.call("drive.parallel", angle_deg=0.0, speed_m_s=0.6, duration_s=20.0))
    await robot.until(lambda: robot.speed_m_s > 0.58)
    return driving


async def test_a_client_that_renews_no_more_has_its_motion_stopped() -> None:
    async with running_robot() as robot:
        driving = await _drive(robot)
        await robot.fall_silent()
        took = await robot.until(lambda: robot.speed_m_s < 0.01)
        assert took < robot.app.service.lease_timeout_s + 0.6 / 0.8 + 0.3
        with pytest.raises(CanhelmError, match="lease"):
            await driving


async def test_a_drive_switched_off_and_on_stops_the_vehicle_and_drives_again_after_reset() -> None:
    async with running_robot(expect_errors=True) as robot:
        driving = await _drive(robot)
        robot.network.power_off(3)
        detected = await robot.until(lambda: robot.state == "fault")
        assert detected < TWO_GUARDING_PERIODS_S
        assert "a fault that is gone" not in robot.app.service.status()["message"]
        await robot.until(lambda: robot.speed_m_s < 0.01, 3.0)
        robot.network.power_on(3)
        with pytest.raises(DeviceFault, match="front_left"):
            await driving
        assert "front_left" in robot.app.service.status()["message"]
        await robot.until(lambda: robot.app.devices.by_node[3].node_state == "ready")
        assert (await robot.call("reset"))["state"] == "idle"
        await robot.call("drive.parallel", angle_deg=0.0, speed_m_s=0.3, duration_s=1.0)


async def test_one_reset_recovers_all_four_drives_after_a_contactor_opened() -> None:
    async with running_robot(expect_errors=True) as robot:
        driving = await _drive(robot)
        for node in (1, 2, 3, 4):
            robot.network.power_off(node)
        await robot.until(lambda: robot.state == "fault")
        await asyncio.sleep(1.0)
        for node in (1, 2, 3, 4):
            robot.network.power_on(node)
        with pytest.raises(DeviceFault):
            await driving
        await robot.until(lambda: all(d.node_state == "ready" for d in robot.app.devices.by_node.values()))
        assert (await robot.call("reset"))["state"] == "idle"
        await robot.call("drive.parallel", angle_deg=0.0, speed_m_s=0.3, duration_s=1.0)


async def test_motor_power_that_comes_late_is_waited_for_by_name() -> None:
    async with running_robot(powered=False, booted=False) as robot:
        await asyncio.sleep(30.0)
        assert robot.state == "waiting"
        assert (
            "waiting for node 3 (front_left): no boot-up; is motor power on?" in robot.app.service.status()["message"]
        )
        robot.network.power_on("all")
        assert await robot.until(lambda: robot.state == "idle") < 5.0


async def test_a_stale_target_in_a_drive_is_never_executed() -> None:
    async with running_robot() as robot:
        sdo = robot.app.master.sdo(1)
        await sdo.write(OBJECTS["target_velocity"], 3000)
        await sdo.write(OBJECTS["velocity_mode_setting_value"], 3000)
        assert await sdo.read(OBJECTS["target_velocity"]) == 3000
        before = robot.network.world.axes["rear_right"].position_rad
        await robot.call("motor.enable", node=1)
        await asyncio.sleep(1.0)
        assert abs(robot.network.world.axes["rear_right"].position_rad - before) < 0.02
        await robot.call("motor.disable", node=1)


async def test_the_emergency_stop_is_latched_until_a_reset() -> None:
    async with running_robot(expect_errors=True) as robot:
        driving = await _drive(robot)
        await robot.call("estop")
        with pytest.raises(EmergencyStop):
            await driving
        await robot.until(lambda: not robot.app.supervisor.anything_enabled, 3.0)
        assert robot.speed_m_s < 0.01
        with pytest.raises(EmergencyStop):
            await robot.call("steer", pair="front", angle_deg=1.0)
        assert (await robot.call("reset"))["state"] == "idle"
        await robot.call("steer", pair="front", angle_deg=1.0)


async def test_a_fault_of_a_drive_stops_the_vehicle_and_says_cause_and_cure() -> None:
    async with running_robot(expect_errors=True) as robot:
        driving = await _drive(robot)
        drive = robot.network.node(2)
        assert isinstance(drive, SimulatedEpos)
        drive.trigger_fault(0x4210)
        await robot.until(lambda: robot.speed_m_s < 0.01, 3.0)
        with pytest.raises(DeviceFault, match="temperature"):
            await driving
        with pytest.raises(NotReady, match="fault"):
            await robot.call("steer", pair="front", angle_deg=1.0)
        assert (await robot.call("reset"))["state"] == "idle"


async def test_a_fault_that_was_reset_at_its_drive_is_told_as_gone() -> None:
    async with running_robot(expect_errors=True) as robot:
        drive = robot.network.node(2)
        assert isinstance(drive, SimulatedEpos)
        drive.trigger_fault(0x4210)
        await robot.until(lambda: robot.state == "fault")
        await robot.call("motor.reset", node=2)
        message = robot.app.service.status()["message"]
        assert message.startswith("stopped by a fault that is gone: node 2")
        assert "`canhelm reset`" in message


async def test_a_stop_says_which_drives_are_still_enabled() -> None:
    async with running_robot() as robot:
        await robot.call("motor.enable", node=1)
        answer = await robot.call("stop")
        assert (answer["state"], answer["enabled"]) == ("active", ["rear_right"])
        assert "`canhelm motor disable rear_right`" in answer["message"]
        await robot.call("motor.disable", node=1)
        assert await robot.call("stop") == {"state": "idle"}


async def test_a_daemon_that_hangs_is_lost_to_its_drives_which_stop_by_themselves() -> None:
    async with running_robot(expect_errors=True) as robot:
        driving = await _drive(robot)
        robot.app.cycle.stop()
        await asyncio.sleep(0.3 + 0.6 / 2.0 + 0.3)
        assert robot.fastest_wheel_m_s < 0.01
        robot.app.cycle.start()
        with pytest.raises(CanhelmError):
            await driving


async def test_garbage_on_the_bus_is_counted_and_shown() -> None:
    async with running_robot(expect_errors=True) as robot:
        assert robot.app.medium is not None
        stranger = robot.app.medium.port("stranger")
        for can_id, data in (
            (0x181, b"\x01"),
            (0x7FF, b"\x00" * 8),
            (0x581, b"\xff"),
            (0x084, b""),
            (0x701, b"\x05\x05"),
        ):
            stranger.send(can_id, data)
        await asyncio.sleep(0.1)
        bus = robot.app.service.status()["bus"]
        assert bus["malformed"] + bus["unknown"] + bus["late_answers"] >= 5
        await robot.call("steer", pair="front", angle_deg=5.0)
        await stranger.close()


@pytest.mark.parametrize("command", ["preop", "stop"])
async def test_a_node_held_by_command_comes_back_by_command_without_a_fault(command: str) -> None:
    async with running_robot(expect_errors=True) as robot:
        await robot.call("nmt", command=command, node=3)
        await asyncio.sleep(2.0)
        assert robot.state == "waiting"
        assert "nmt start front_left" in robot.app.service.status()["message"]
        await robot.call("nmt", command="start", node=3)
        await robot.until(lambda: robot.state == "idle", 3.0)


async def test_a_reset_of_a_healthy_robot_does_not_wait_for_its_motion() -> None:
    async with running_robot() as robot:
        motion = await robot.call("drive.parallel", angle_deg=0.0, speed_m_s=0.2, duration_s=5.0, wait=False)
        begin = asyncio.get_running_loop().time()
        await robot.call("reset")
        assert asyncio.get_running_loop().time() == begin
        await robot.call("motion.stop", motion=motion["motion"])
