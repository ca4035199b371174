"""A whole simulated MAX2D: no motor turns without a live command, at whatever moment something breaks or cuts in."""

from __future__ import annotations

import asyncio
from collections import Counter
from typing import Any

import pytest

from canhelm.errors import CanhelmError, DeviceFault, Interlock, NodeAbsent, NotReady, Refused
from drivers.contract import BrakeState
from drivers.simulated.epos import SimulatedEpos
from vcan_tests.robot import Robot, running_robot

MOMENTS_S = (0.001, 0.004, 0.008, 0.012, 0.03, 0.06)
"""From the first SDO of enabling a drive to its enabled state."""
LIFE_TIME_S = 0.3
"""Of the shipped robot."""


def _twin(robot: Robot, node: int) -> SimulatedEpos:
    twin = robot.network.node(node)
    assert isinstance(twin, SimulatedEpos)
    return twin


async def _until_front_brake_is_free(robot: Robot) -> asyncio.Task[Any]:
    steering = robot.begin("steer", pair="front", angle_deg=40.0)
    await robot.until(lambda: robot.app.devices.brakes["front"].state is BrakeState.RELEASED)
    return steering


async def test_a_drive_lost_while_its_brake_is_released_is_one_fault_and_not_endless_ones() -> None:
    async with running_robot(expect_errors=True) as robot:
        steering = await _until_front_brake_is_free(robot)
        robot.network.power_off("front_left")
        error = await steering
        assert isinstance(error, DeviceFault)
        assert "front_left" in error.message
        assert robot.fastest_wheel_m_s < 0.02
        assert len(robot.app.supervisor.log.events) < 30


@pytest.mark.parametrize("command", ["stop", "estop"])
@pytest.mark.parametrize("without_power", ["all", "rear_right", "front_left"])
async def test_a_stop_is_told_once_whichever_nodes_have_no_power(command: str, without_power: str) -> None:
    async with running_robot(expect_errors=True) as robot:
        robot.network.power_off(without_power)
        await asyncio.sleep(1.0)
        await robot.call(command)
        await asyncio.sleep(5.0)
        told = Counter(event["message"] for event in robot.app.supervisor.log.events)
        assert max(told.values()) == 1, told
        assert not [message for message in told if message.startswith("not at rest")]


@pytest.mark.parametrize("command", ["stop", "estop"])
async def test_a_stop_before_any_node_has_power_is_quiet(command: str) -> None:
    async with running_robot(expect_errors=True, powered=False, booted=False) as robot:
        await asyncio.sleep(1.0)
        before = len(robot.app.supervisor.log.events)
        await robot.call(command)
        await asyncio.sleep(5.0)
        assert len(robot.app.supervisor.log.events) - before <= 1


async def test_a_fault_of_a_drive_is_told_once() -> None:
    async with running_robot(expect_errors=True) as robot:
        _twin(robot, 2).trigger_fault(0x4210)
        await robot.until(lambda: robot.state == "fault")
        await asyncio.sleep(1.0)
        told = [event for event in robot.app.supervisor.log.events if "temperature" in event["message"]]
        assert len(told) == 1


async def test_a_brake_whose_switching_was_cancelled_can_be_switched_again() -> None:
    async with running_robot() as robot:
        brake = robot.app.devices.brakes["front"]
        releasing = asyncio.create_task(brake.release())
        await asyncio.sleep(0)
        releasing.cancel()
        await asyncio.wait([releasing])
        await asyncio.wait_for(brake.engage(), 1.0)
        assert brake.state is BrakeState.ENGAGED


@pytest.mark.parametrize("moment_s", MOMENTS_S)
async def test_an_emergency_stop_while_a_drive_is_being_enabled_leaves_it_off(moment_s: float) -> None:
    async with running_robot(expect_errors=True) as robot:
        enabling = robot.begin("motor.enable", node=1)
        second = robot.begin("motor.enable", node=1)
        await asyncio.sleep(moment_s)
        await robot.call("estop")
        await asyncio.wait([enabling, second])
        await asyncio.sleep(1.0)
        assert not _twin(robot, 1).motion.powered


@pytest.mark.parametrize("moment_s", MOMENTS_S)
async def test_a_stop_while_a_move_is_being_prepared_keeps_it_from_beginning(moment_s: float) -> None:
    async with running_robot() as robot:
        await robot.call("motor.enable", node=1)
        axis = robot.network.world.axes["rear_right"]
        before_rad = axis.position_rad
        moving = robot.begin("motor.position", node=1, position_qc=20_000, relative=True, velocity_rpm=1.0)
        await asyncio.sleep(moment_s)
        await robot.call("stop")
        assert isinstance(await moving, Refused)
        await asyncio.sleep(1.0)
        assert abs(axis.position_rad - before_rad) < 0.02
        await robot.call("motor.disable", node=1)


@pytest.mark.parametrize("moment_s", [0.01, 0.03, 0.05, 0.07, 0.09])
@pytest.mark.parametrize("how", ["stop", "hang up"])
async def test_a_stop_while_a_brake_opens_is_a_stop_and_no_fault(how: str, moment_s: float) -> None:
    async with running_robot() as robot:
        supervisor, brakes = robot.app.supervisor, robot.app.devices.brakes.values()
        steering = asyncio.create_task(robot.call("steer", pair="front", angle_deg=20.0))
        await robot.until(lambda: any(brake.state == "releasing" for brake in brakes))
        await asyncio.sleep(moment_s)
        if how == "stop":
            await supervisor.stop("by a person")
        else:
            supervisor.close_lease(robot.lease or "")
        with pytest.raises(Refused):
            await steering
        await robot.until(lambda: robot.state == "idle" and all(brake.state == "engaged" for brake in brakes), 5.0)


async def test_an_emergency_stop_during_a_reset_stays_latched() -> None:
    async with running_robot(expect_errors=True) as robot:
        _twin(robot, 2).trigger_fault(0x4210)
        await robot.until(lambda: robot.state == "fault")
        resetting = robot.begin("reset")
        await asyncio.sleep(0.05)
        await robot.call("estop")
        assert isinstance(await resetting, Refused)
        assert robot.state == "estop"
        assert (await robot.call("reset"))["state"] == "idle"


async def test_a_reset_right_after_an_emergency_stop_returns_when_the_vehicle_can_be_driven_again() -> None:
    async with running_robot(expect_errors=True) as robot:
        driving = robot.begin("drive.parallel", angle_deg=0.0, speed_m_s=0.4, duration_s=5.0)
        await robot.until(lambda: robot.speed_m_s > 0.38)
        await robot.call("estop")
        assert (await robot.call("reset"))["state"] == "idle"
        await driving
        await robot.call("steer", pair="front", angle_deg=1.0)


async def test_a_wheel_that_settles_when_its_torque_goes_is_waited_for_at_the_end(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    async with running_robot() as robot:
        last = robot.app.devices.drives["front_right"]
        disable = last.disable

        async def disable_and_settle() -> None:
            await disable()
            last.speed_m_s = 0.02  # until its next reading

        monkeypatch.setattr(last, "disable", disable_and_settle)
        driving = robot.begin("drive.parallel", angle_deg=0.0, speed_m_s=0.3, duration_s=60.0)
        await robot.until(lambda: robot.speed_m_s > 0.28)
        assert await robot.app.supervisor.close() == ()
        await asyncio.wait([driving])


async def test_nothing_begins_while_the_daemon_goes_down() -> None:
    async with running_robot() as robot:
        enabling = robot.begin("motor.enable", node=1)
        await asyncio.sleep(0.004)
        closing = asyncio.create_task(robot.app.supervisor.close())
        await asyncio.wait([enabling, closing])
        with pytest.raises(NotReady, match="going down"):
            await robot.call("steer", pair="front", angle_deg=1.0)
        assert not _twin(robot, 1).motion.powered


async def test_a_pair_is_not_steered_without_the_reading_of_its_encoder() -> None:
    async with running_robot(powered=False, booted=False) as robot:
        for node in (1, 2, 3, 4, 5):
            robot.network.power_on(node)
        await robot.until(lambda: robot.app.devices.brakes["front"].state is BrakeState.ENGAGED)
        with pytest.raises(NodeAbsent, match="front"):
            await robot.call("steer", pair="front", angle_deg=10.0)
        assert robot.network.world.heading_rad("front") == 0.0


@pytest.mark.parametrize(
    ("method", "params"),
    [
        ("sdo.write", {"node": 1, "object": "current_mode_setting_value", "value": 500}),
        ("nmt", {"command": "reset", "node": "all"}),
    ],
)
async def test_the_network_is_left_alone_while_a_motion_prepares_itself(method: str, params: dict[str, Any]) -> None:
    async with running_robot() as robot:
        moving = robot.begin("motor.current", node=1, current_ma=500.0, duration_s=0.2)
        await asyncio.sleep(0.002)
        with pytest.raises(Interlock):
            await robot.app.service.call(method, params, None)
        assert not isinstance(await moving, CanhelmError)


async def test_a_move_whose_client_hangs_up_while_it_is_enabled_does_not_begin() -> None:
    async with running_robot() as robot:
        position_rad = robot.network.world.axes["rear_right"].position_rad
        moving = robot.begin("motor.position", node=1, position_qc=20_000, relative=True, velocity_rpm=500.0)
        await asyncio.sleep(0.01)
        assert robot.lease is not None
        robot.app.service.close_lease(robot.lease)
        assert isinstance(await moving, Refused)
        assert abs(robot.network.world.axes["rear_right"].position_rad - position_rad) < 0.02


async def test_a_lease_that_has_run_out_holds_no_new_motion() -> None:
    async with running_robot() as robot:
        lease = robot.app.service.open_lease("test")
        await asyncio.sleep(robot.app.service.lease_timeout_s + 0.1)
        with pytest.raises(Refused, match="has run out"):
            await robot.app.service.call("motor.velocity", {"node": 1, "velocity_rpm": 100.0}, lease)


async def test_a_value_of_a_stream_grows_old_while_the_daemon_hangs() -> None:
    async with running_robot() as robot:
        for _ in range(40):
            await robot.call("drive.set", direction_deg=0.0, speed_m_s=0.3, valid_for_ms=100)
            await asyncio.sleep(0.05)
        robot.app.cycle.stop()
        await asyncio.sleep(0.15)
        robot.app.cycle.start()
        await asyncio.sleep(0.02)
        (motion,) = robot.app.service.status()["motions"]
        assert motion["value_age_ms"] >= 200
        await robot.call("stop")


async def test_the_second_brake_is_not_released_where_a_drive_was_enabled_while_the_first_one_opened() -> None:
    async with running_robot() as robot:
        releasing = robot.begin("brake.release", pair="all")
        enabling = robot.begin("motor.enable", node="rear_left")
        assert isinstance(await releasing, Interlock)
        assert [brake.state for brake in robot.app.devices.brakes.values()].count(BrakeState.ENGAGED) == 1
        assert not isinstance(await enabling, CanhelmError)
        await robot.call("motor.disable", node="rear_left")


@pytest.mark.parametrize("seed", range(3))
async def test_a_robot_whose_daemon_dies_stands_after_the_life_time_and_its_quick_stop_ramp(seed: int) -> None:
    async with running_robot(seed=seed, expect_errors=True) as robot:
        drives = robot.app.profile.drives.values()
        driving = robot.begin("drive.parallel", angle_deg=0.0, speed_m_s=0.5, duration_s=60.0)
        await robot.until(lambda: robot.speed_m_s > 0.49)
        await robot.app.bus.close()
        ramp_s = 0.5 / min(drive.quick_stop_m_s2 for drive in drives)
        await asyncio.sleep(LIFE_TIME_S + ramp_s + 0.05)
        assert robot.fastest_wheel_m_s < 0.01
        await driving


@pytest.mark.parametrize("moment_s", [0.17, 0.19, 0.21, 0.24, 0.27, 0.29, 0.31])
async def test_a_turning_pair_whose_daemon_dies_stands_likewise(moment_s: float) -> None:
    async with running_robot(expect_errors=True) as robot:
        profile = robot.app.profile
        speed_m_s = profile.limits.steering_rim_speed_m_s
        steering = robot.begin("steer", pair="front", angle_deg=80.0)
        await robot.until(lambda: robot.fastest_wheel_m_s > 0.9 * speed_m_s)
        await asyncio.sleep(moment_s)
        await robot.app.bus.close()
        ramp_s = speed_m_s / min(drive.quick_stop_m_s2 for drive in profile.drives.values())
        await asyncio.sleep(LIFE_TIME_S + ramp_s + 0.05)
        assert robot.fastest_wheel_m_s < 0.01
        await steering
