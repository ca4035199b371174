"""A whole simulated MAX2D: what it does when it is driven as it should be."""

from __future__ import annotations

import asyncio
import logging
import math

import pytest

from canhelm.errors import Interlock, LimitExceeded, NodeAbsent, Refused, UsageError
from vcan_tests.robot import running_robot


async def test_a_powered_robot_boots_to_idle_with_both_brakes_engaged() -> None:
    async with running_robot() as robot:
        status = robot.app.service.status()
        assert [node["node_state"] for node in status["nodes"]] == ["ready"] * 6
        assert [brake["state"] for brake in status["brakes"]] == ["engaged", "engaged"]


async def test_a_pair_is_steered_to_within_a_fifth_of_a_degree_and_its_drives_are_off_afterwards() -> None:
    async with running_robot() as robot:
        await robot.call("steer", pair="front", angle_deg=30.0)
        assert math.degrees(robot.network.world.heading_rad("front")) == pytest.approx(30.0, abs=0.2)
        assert math.degrees(robot.network.world.heading_rad("rear")) == pytest.approx(0.0, abs=0.1)
        assert robot.state == "idle"


async def test_parallel_movement_ends_where_speed_times_duration_says() -> None:
    async with running_robot() as robot:
        await robot.call("drive.parallel", angle_deg=60.0, speed_m_s=0.5, duration_s=4.0)
        x, y, yaw = robot.network.world.pose
        assert (x, y) == pytest.approx((1.0, math.sqrt(3)), abs=0.02 * 2.0)
        assert yaw == pytest.approx(0.0, abs=math.radians(1))


async def test_odometry_agrees_with_the_truth_on_an_arc() -> None:
    async with running_robot() as robot:
        await robot.call("drive.turn", rear_deg=8.0, front_deg=-16.0, speed_m_s=0.4, duration_s=4.0)
        x, y, yaw = robot.network.world.pose
        odometry = robot.app.service.status()["vehicle"]["odometry"]
        assert (odometry["x_m"], odometry["y_m"]) == pytest.approx((x, y), abs=0.12)
        assert odometry["yaw_deg"] == pytest.approx(math.degrees(yaw), abs=6.0)


async def test_one_motor_turns_at_its_speed_for_its_time() -> None:
    async with running_robot() as robot:
        before = robot.network.world.axes["rear_right"].position_rad
        await robot.call("motor.velocity", node=1, velocity_rpm=-250.0, duration_s=2.0)
        turned_rad = robot.network.world.axes["rear_right"].position_rad - before
        assert turned_rad == pytest.approx(-250 * math.tau / 60 * 2.0, rel=0.1)
        assert robot.fastest_wheel_m_s < 0.01


async def test_an_enabled_motor_stays_enabled_after_its_motion() -> None:
    async with running_robot() as robot:
        await robot.call("motor.enable", node="rear_left")
        await robot.call("motor.velocity", node="rear_left", velocity_rpm=200.0, duration_s=0.5)
        assert robot.app.devices.drives["rear_left"].state == "enabled"
        assert robot.state == "active"
        await robot.call("motor.disable", node="rear_left")
        assert robot.state == "idle"


async def test_a_profile_position_move_turns_the_motor_by_its_counts() -> None:
    async with running_robot() as robot:
        before = robot.network.world.axes["front_left"].position_rad
        await robot.call("motor.position", node=3, position_qc=10_000, relative=True, velocity_rpm=250.0)
        turned = robot.network.world.axes["front_left"].position_rad - before
        relaxed_rad = 0.4  # of motor shaft, 1.4 mm at the rim: the tyres unwind when the power goes off
        assert turned == pytest.approx(10_000 / 2000 * math.tau, abs=relaxed_rad)


async def test_a_current_for_a_time_turns_the_wheel_and_ends_at_rest() -> None:
    async with running_robot() as robot:
        begin = asyncio.get_running_loop().time()
        result = await robot.call("motor.current", node=1, current_ma=-2600.0, duration_s=0.6)
        assert result["position_m"] > 0.005
        assert asyncio.get_running_loop().time() - begin < 1.7
        assert robot.fastest_wheel_m_s < 0.01
        assert robot.app.devices.drives["rear_right"].state == "disabled"


async def test_a_current_too_small_to_turn_the_wheel_leaves_an_enabled_drive_enabled() -> None:
    async with running_robot() as robot:
        await robot.call("motor.enable", node=2)
        await robot.call("motor.current", node=2, current_ma=300.0, duration_s=0.2)
        await asyncio.sleep(0.1)
        drive = robot.app.devices.drives["rear_left"]
        assert (drive.state, drive.status()["mode"], drive.fault) == ("enabled", "profile velocity", None)
        await robot.call("motor.disable", node=2)


async def test_a_stream_of_values_drives_and_a_stale_one_stops() -> None:
    async with running_robot() as robot:
        for _ in range(80):
            await robot.call("drive.set", direction_deg=0.0, speed_m_s=0.3, valid_for_ms=200)
            await asyncio.sleep(0.05)
        assert robot.speed_m_s == pytest.approx(0.3, rel=0.05)
        took = await robot.until(lambda: robot.speed_m_s < 0.01)
        assert took < 0.2 + 0.3 / 0.8 + 0.3


async def test_a_stream_with_a_new_direction_comes_to_rest_steers_and_goes_on() -> None:
    async with running_robot() as robot:
        for direction in (0.0, 40.0):
            for _ in range(120):
                await robot.call("drive.set", direction_deg=direction, speed_m_s=0.3, valid_for_ms=200)
                await asyncio.sleep(0.05)
        vx, vy, _ = robot.network.world.velocity
        assert math.degrees(math.atan2(vy, vx)) == pytest.approx(40.0, abs=2.0)


async def test_stop_brings_a_drive_to_rest_by_the_quick_stop_ramp() -> None:
    async with running_robot() as robot:
        driving = asyncio.create_task(robot.call("drive.parallel", angle_deg=0.0, speed_m_s=0.8, duration_s=10.0))
        await robot.until(lambda: robot.speed_m_s > 0.78)
        begin = asyncio.get_running_loop().time()
        await robot.call("stop")
        assert asyncio.get_running_loop().time() - begin < 0.8 / 2.0 + 0.4
        assert robot.speed_m_s < 0.01
        with pytest.raises(Refused, match="stop was commanded"):
            await driving
        assert robot.state == "idle"


@pytest.mark.parametrize(
    ("method", "params", "error"),
    [
        ("drive.rotate", {"rate_deg_s": 10.0}, Refused),
        ("steer", {"pair": "front", "angle_deg": 89.0}, LimitExceeded),
        ("steer", {"pair": "middle", "angle_deg": 9.0}, UsageError),
        ("drive.parallel", {"angle_deg": 0.0, "speed_m_s": 9.0, "duration_s": 1.0}, LimitExceeded),
        ("motor.velocity", {"node": 1, "velocity_rpm": 90_000.0, "duration_s": 1.0}, LimitExceeded),
        ("motor.velocity", {"node": 99, "velocity_rpm": 90.0, "duration_s": 1.0}, NodeAbsent),
        ("motor.current", {"node": 1, "current_ma": 9000.0, "duration_s": 1.0}, LimitExceeded),
    ],
)
async def test_what_is_refused_moves_nothing(method: str, params: dict[str, object], error: type[Exception]) -> None:
    async with running_robot() as robot:
        with pytest.raises(error):
            await robot.call(method, **params)
        await asyncio.sleep(0.5)
        assert robot.network.world.pose == (0.0, 0.0, 0.0)
        assert robot.state == "idle"


async def test_both_steering_brakes_are_not_released_while_a_drive_is_enabled() -> None:
    async with running_robot() as robot:
        await robot.call("motor.enable", node=1)
        with pytest.raises(Interlock):
            await robot.call("brake.release", pair="all")
        await robot.call("motor.disable", node=1)
        released = await robot.call("brake.release", pair="all")
        assert [brake["state"] for brake in released["brakes"]] == ["released", "released"]
        await robot.call("brake.engage", pair="all")


async def test_a_single_wheel_does_not_turn_while_a_steering_brake_is_released() -> None:
    async with running_robot() as robot:
        await robot.call("brake.release", pair="front")
        with pytest.raises(Interlock):
            await robot.call("motor.velocity", node=3, velocity_rpm=100.0, duration_s=1.0)


async def test_a_second_motion_is_refused_while_one_runs() -> None:
    async with running_robot() as robot:
        first = await robot.call("drive.parallel", angle_deg=0.0, speed_m_s=0.2, duration_s=3.0, wait=False)
        with pytest.raises(Refused, match="running"):
            await robot.call("drive.parallel", angle_deg=0.0, speed_m_s=0.2, duration_s=3.0)
        assert (await robot.call("motion.wait", motion=first["motion"]))["motion"] == first["motion"]


async def test_a_position_move_beyond_the_wheels_limit_is_refused_with_unit_and_remedy() -> None:
    async with running_robot() as robot:
        with pytest.raises(LimitExceeded, match="99999 rpm is beyond") as refused:
            await robot.call("motor.position", node=1, position_qc=100, velocity_rpm=99_999.0)
        assert "rpm at the motor" in refused.value.limit
        assert refused.value.remedy is not None


async def test_a_current_beyond_the_motors_is_refused_with_a_remedy() -> None:
    async with running_robot() as robot:
        with pytest.raises(LimitExceeded, match="20000 mA") as refused:
            await robot.call("motor.current", node=1, current_ma=20_000.0)
        assert refused.value.remedy is not None


async def test_the_log_tells_whose_a_motion_was_and_how_it_ended(caplog: pytest.LogCaptureFixture) -> None:
    async with running_robot() as robot:
        with caplog.at_level(logging.INFO):
            await robot.call("drive.parallel", angle_deg=0.0, speed_m_s=0.2, duration_s=0.5)
            moving = asyncio.create_task(robot.call("motor.velocity", node=1, velocity_rpm=100.0))
            await robot.until(lambda: bool(robot.app.supervisor.motions))
            await robot.call("stop")
            await asyncio.wait([moving])
    told = [message for message in caplog.messages if message.startswith("motion ")]
    assert told[0] == "motion 1 (drive.parallel) begins, held by test"
    assert told[1] == "motion 1 (drive.parallel) is over: done"
    assert told[3].startswith("motion 2 (motor.velocity) is over: the motion was stopped: ")
    assert isinstance(moving.exception(), Refused)
