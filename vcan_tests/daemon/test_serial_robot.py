"""A whole simulated MAX2D behind the serial line of one of its drives, on virtual time."""

from __future__ import annotations

import asyncio
import math
from typing import Any

import pytest

from canhelm.errors import CanhelmError, DeviceFault, Interlock
from drivers.epos.serial_bus import SerialGatewayBus
from drivers.epos.serial_plan import (
    plan,
    serial_limits,
    serial_speed_m_s,
    stopping_time_s,
    stopping_turn_rad,
    stopping_way_m,
)
from profiles.loader import load
from vcan_tests.robot import Robot, running_robot

MAX2D = load("max2d").profile
STOP_TIMEOUT_S = 15.0
"""After which systemd kills the service, see systemd/canhelm@.service."""
ANSWER_TO_A_WRITE = 7
"""Bytes of such an answer behind its operation code."""


async def test_it_boots_and_steers_to_within_a_degree() -> None:
    async with running_robot(bus="rs232") as robot:
        steered = await robot.call("steer", pair="front", angle_deg=30.0)
        assert steered["steering_error_deg"] <= 1.0
        assert math.degrees(robot.network.world.heading_rad("front")) == pytest.approx(30.0, abs=1.0)


async def test_behind_a_gateway_with_the_framing_of_later_drives_it_boots_and_steers_likewise() -> None:
    async with running_robot(bus="rs232,epos2") as robot:
        steered = await robot.call("steer", pair="front", angle_deg=30.0)
        assert steered["steering_error_deg"] <= 1.0
        assert math.degrees(robot.network.world.heading_rad("front")) == pytest.approx(30.0, abs=1.0)


@pytest.mark.parametrize("pause_s", [0.0, 0.1, 0.2, 0.3, 0.4])
async def test_an_old_reading_of_the_current_of_the_drive_on_the_line_stops_nobody(pause_s: float) -> None:
    async with running_robot(bus="rs232@38400") as robot:
        await asyncio.sleep(pause_s)
        await robot.call("drive.parallel", angle_deg=0.0, speed_m_s=-0.7, duration_s=2.0)


async def test_figure_4_16_has_its_radius_within_eight_percent() -> None:
    async with running_robot(bus="rs232") as robot:
        speed = robot.app.profile.limits.speed_m_s
        start = robot.network.world.pose
        await robot.call(
            "drive.turn", rear_deg=math.degrees(0.15), front_deg=math.degrees(-0.3), speed_m_s=speed, duration_s=3.0
        )
        x, y, yaw = robot.network.world.pose
        chord = math.hypot(x - start[0], y - start[1])
        assert chord / (2 * abs(math.sin((yaw - start[2]) / 2))) == pytest.approx(1.0027, rel=0.08)


@pytest.mark.parametrize(("baud", "slowest_hz"), [(115200, 15.0), (38400, 7.0)])
async def test_the_line_gives_at_least_the_planned_rate(baud: int, slowest_hz: float) -> None:
    async with running_robot(bus=f"rs232@{baud}") as robot:
        planned_hz = plan(MAX2D, baud).cycle_hz
        assert planned_hz > slowest_hz
        before, begin = robot.app.cycle.counters.cycles, asyncio.get_running_loop().time()
        await robot.call("drive.parallel", angle_deg=0.0, speed_m_s=0.3, duration_s=4.0)
        cycles = robot.app.cycle.counters.cycles - before
        assert cycles / (asyncio.get_running_loop().time() - begin) > planned_hz


async def _at_speed(robot: Robot, speed_m_s: float) -> asyncio.Task[dict[str, Any]]:
    driving = asyncio.create_task(robot.call("drive.parallel", angle_deg=0.0, speed_m_s=speed_m_s, duration_s=20.0))
    await robot.until(lambda: robot.speed_m_s > 0.95 * speed_m_s)
    return driving


async def test_a_pulled_cable_stops_every_wheel_within_the_stated_way() -> None:
    async with running_robot(bus="rs232", expect_errors=True) as robot:
        driving = await _at_speed(robot, 0.3)
        x, _, _ = robot.network.world.pose
        assert robot.app.wire.cable is not None
        robot.app.wire.cable.pulled = True
        took = await robot.until(lambda: robot.fastest_wheel_m_s < 0.01, 3.0)
        assert took < stopping_time_s(robot.app.profile, 0.3)
        assert robot.network.world.pose[0] - x < stopping_way_m(robot.app.profile, 0.3)
        with pytest.raises(CanhelmError):
            await driving


async def test_a_line_that_is_dead_is_told_before_the_fault_that_is_latched() -> None:
    async with running_robot(bus="rs232", expect_errors=True) as robot:
        robot.app.supervisor.fault(DeviceFault("node 2 (rear_left) was too hot"))
        assert robot.app.wire.cable is not None
        robot.app.wire.cable.pulled = True
        await robot.until(lambda: robot.app.bus.trouble is not None, 10.0)
        message = robot.app.service.status()["message"]
        assert message.startswith("the drive on rs232 does not answer (is it switched on")
        assert message.endswith("; node 2 (rear_left) was too hot; after the cause is gone: `canhelm reset`")


async def test_where_the_line_is_hung_up_nobody_asks_for_motor_power() -> None:
    async with running_robot(bus="rs232", expect_errors=True) as robot:
        bus, nodes = robot.app.bus, robot.app.devices.by_node.values()
        assert isinstance(bus, SerialGatewayBus)
        assert bus.line is not None
        bus.line.lose("the line was hung up")
        await robot.until(lambda: all(device.status_sentence.startswith("waiting for") for device in nodes))
        assert {device.status_sentence.split(": ", 1)[1] for device in nodes} == {"rs232 is gone: the line was hung up"}
        events = robot.app.supervisor.log.last(100)
        assert not any("motor power" in f"{event['message']} {event['remedy']}" for event in events)


async def test_with_its_cable_pulled_the_daemon_ends_before_the_service_would_be_killed() -> None:
    async with running_robot(bus="rs232", expect_errors=True) as robot:
        assert robot.app.wire.cable is not None
        robot.app.wire.cable.pulled = True
        began = asyncio.get_running_loop().time()
        await robot.app.close()
        assert asyncio.get_running_loop().time() - began < 0.5 * STOP_TIMEOUT_S


async def test_a_cable_pulled_while_a_pair_turns_stops_it_in_the_stated_time() -> None:
    async with running_robot(bus="rs232", expect_errors=True) as robot:
        steering = asyncio.create_task(robot.call("steer", pair="front", angle_deg=80.0))
        await robot.until(lambda: robot.network.world.heading_rad("front") > 0.3)
        before = robot.network.world.heading_rad("front")
        assert robot.app.wire.cable is not None
        robot.app.wire.cable.pulled = True
        took = await robot.until(lambda: robot.fastest_wheel_m_s < 0.01, 3.0)
        assert took < stopping_time_s(robot.app.profile, robot.app.profile.limits.steering_rim_speed_m_s)
        turned = robot.network.world.heading_rad("front") - before
        assert turned < (stopping_turn_rad(robot.app.profile) or 0.0)
        with pytest.raises(CanhelmError):
            await steering


async def test_a_drive_without_power_is_left_out_and_stops_the_vehicle() -> None:
    async with running_robot(bus="rs232", expect_errors=True) as robot:
        driving = await _at_speed(robot, 0.3)
        robot.network.power_off(3)
        await robot.until(lambda: robot.state == "fault", 2.0)
        await robot.until(lambda: robot.speed_m_s < 0.01, 3.0)
        with pytest.raises(CanhelmError, match=r"node 3 \(front_left\)"):
            await driving
        await robot.until(lambda: robot.app.devices.by_node[3].node_state == "absent", 2.0)
        robot.network.power_on(3)
        await robot.until(lambda: all(d.node_state == "ready" for d in robot.app.devices.by_node.values()), 20.0)
        assert (await robot.call("reset"))["state"] == "idle"
        await robot.call("drive.parallel", angle_deg=0.0, speed_m_s=0.2, duration_s=1.0)


async def test_a_fault_of_the_drive_on_the_line_is_told_by_its_code() -> None:
    async with running_robot(bus="rs232", expect_errors=True) as robot:
        driving = await _at_speed(robot, 0.3)
        robot.network.drives["rear_right"].trigger_fault(0x4210)
        with pytest.raises(CanhelmError, match="temperature"):
            await driving


async def test_an_alarm_of_an_encoder_is_found_by_its_error_register() -> None:
    async with running_robot(bus="rs232", expect_errors=True) as robot:
        driving = await _at_speed(robot, 0.3)
        robot.network.encoders["front"].set_alarms(1)
        with pytest.raises(CanhelmError, match="front"):
            await driving
        robot.network.encoders["front"].set_alarms(0)
        await robot.until(lambda: robot.app.devices.by_node[6].fault is None, 5.0)


def test_slower_sensing_means_a_lower_speed_with_the_same_way_to_rest() -> None:
    speed = serial_speed_m_s(1.2, 2.0, 0.01, 0.06)
    way = 1.2 * 0.02 + 1.2**2 / 4.0
    assert speed < 1.2
    assert speed * 0.18 + speed**2 / 4.0 == pytest.approx(way)


def test_the_same_rate_leaves_the_limits_as_they_are() -> None:
    shrunk = serial_limits(MAX2D.limits, 2.0, 0.01, 0.005)
    assert shrunk.speed_m_s == MAX2D.limits.speed_m_s
    assert shrunk.steering_rim_speed_m_s == MAX2D.limits.steering_rim_speed_m_s


async def test_asking_a_node_that_is_not_there_at_rest_costs_no_other_its_guarding() -> None:
    async with running_robot(bus="rs232", expect_errors=True) as robot:
        with pytest.raises(CanhelmError):
            await robot.call("sdo.read", node=99, object="0x1000")
        await asyncio.sleep(2.0)
        assert robot.state == "idle"
        assert robot.app.bus.details()["silent_nodes"] == []


async def test_a_node_outside_the_profile_is_not_asked_while_a_drive_has_power() -> None:
    async with running_robot(bus="rs232") as robot:
        driving = await _at_speed(robot, 0.3)
        with pytest.raises(Interlock, match="node 99 is not in the profile"):
            await robot.call("sdo.read", node=99, object="0x1000")
        assert not driving.done()
        await robot.call("stop")
        with pytest.raises(CanhelmError):
            await driving


async def test_one_lost_answer_does_not_break_a_write_off() -> None:
    async with running_robot(bus="rs232", expect_errors=True) as robot:
        assert robot.app.wire.cable is not None
        to_host = robot.app.wire.cable.to_host
        written = asyncio.create_task(robot.call("sdo.write", node=3, object="profile_acceleration", value=4000))
        deliver = to_host.send
        lost: list[bytes] = []

        def lose_one_answer(data: bytes, at_s: float) -> float:
            if len(data) == ANSWER_TO_A_WRITE and not lost:
                lost.append(data)
                return at_s
            return deliver(data, at_s)

        to_host.send = lose_one_answer  # type: ignore[method-assign]
        assert (await written)["value"] == 4000
        assert lost
        assert robot.state == "idle"
