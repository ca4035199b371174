"""A whole simulated robot on an NXT brick: poses, moves, refusals, stops, a lost connection."""

from __future__ import annotations

import asyncio
import math
from typing import Any

import pytest

from canhelm.errors import CanhelmError, LimitExceeded, NotReady, Refused, Timeout, UsageError
from daemon.loops.odometry import Pose
from drivers.nxt import requests
from vcan_tests.daemon.nxt_twin import NXT, body_of, miss, pose_of, turning, twin_of
from vcan_tests.robot import Robot, running_robot

LEFT_BEND = Pose(0.2, 0.2, math.pi / 2)


async def test_it_drives_to_a_place_and_heading() -> None:
    async with running_robot(NXT, seed=3) as robot:
        result = await robot.call("drive.to", x_m=0.4, y_m=0.1, heading_deg=90.0)
        away_m, turned_deg = miss(robot, Pose(0.4, 0.1, math.pi / 2))
        assert (result["result"], robot.state) == ("arrived", "idle")
        assert away_m < 0.005
        assert turned_deg < 3.0


async def test_it_drives_back_to_where_it_began() -> None:
    async with running_robot(NXT, seed=3) as robot:
        await robot.call("nxt.line", distance_m=0.2)
        result = await robot.call("drive.to", x_m=0.0, y_m=0.0, heading_deg=0.0)
        assert result["error_m"] <= 0.003
        assert miss(robot, Pose())[0] < 0.01


async def test_a_pose_as_seen_from_the_robot_adds_to_where_it_stands() -> None:
    async with running_robot(NXT, seed=3) as robot:
        for _ in range(2):
            await robot.call("nxt.goto", x_m=0.2, y_m=0.2, heading_deg=90.0)
        away_m, turned_deg = miss(robot, Pose(0.0, 0.4, math.pi))
        assert away_m < 0.01
        assert turned_deg < 5.0


async def test_an_open_loop_line_overshoots_by_what_its_motors_coast() -> None:
    async with running_robot(NXT, seed=3) as robot:
        result = await robot.call("nxt.line", distance_m=0.5, power=30)
        assert all(20 < error < 60 for error in result["tacho_errors_deg"][0])
        assert pose_of(robot).x_m == pytest.approx(result["x_m"], abs=0.005)


@pytest.mark.parametrize(("side", "sign"), [("left", 1), ("right", -1)])
async def test_an_open_loop_bend_ends_near_its_end(side: str, sign: int) -> None:
    async with running_robot(NXT, seed=3) as robot:
        await robot.call("nxt.bend", radius_m=0.2, angle_deg=90.0, side=side, power=30)
        away_m, turned_deg = miss(robot, Pose(0.2, sign * 0.2, sign * math.pi / 2))
        assert away_m < 0.04
        assert turned_deg < 12.0


async def test_a_move_under_feedback_ends_at_its_end() -> None:
    async with running_robot(NXT, seed=3) as robot:
        await robot.call("nxt.bend", radius_m=0.2, angle_deg=90.0, feedback=True)
        assert miss(robot, LEFT_BEND)[0] < 0.005


async def test_a_bend_backward_ends_behind() -> None:
    async with running_robot(NXT, seed=3) as robot:
        await robot.call("nxt.bend", radius_m=0.2, angle_deg=90.0, backward=True, feedback=True)
        assert miss(robot, Pose(-0.2, 0.2, -math.pi / 2))[0] < 0.005


async def test_several_moves_are_driven_one_after_the_other() -> None:
    async with running_robot(NXT, seed=3) as robot:
        result = await robot.call("nxt.moves", moves=["line 0.2", "bend 0.2 90", "line -0.1"])
        assert len(result["tacho_errors_deg"]) == 3
        assert miss(robot, Pose(0.4, 0.1, math.pi / 2))[0] < 0.08


async def test_an_open_loop_way_to_a_pose_turns_drives_and_turns() -> None:
    async with running_robot(NXT, seed=3) as robot:
        result = await robot.call("nxt.goto", x_m=0.0, y_m=0.3, heading_deg=0.0, feedback=False, power=20)
        assert len(result["tacho_errors_deg"]) == 3
        assert miss(robot, Pose(0.0, 0.3))[0] < 0.05


async def test_moves_of_two_calls_do_not_add_up_what_they_overshoot() -> None:
    async with running_robot(NXT, seed=3) as robot:
        for _ in range(4):
            await robot.call("nxt.line", distance_m=0.1, power=30)
        assert 0.4 < pose_of(robot).x_m < 0.43


async def test_a_robot_that_was_pushed_does_not_drive_that_way_back() -> None:
    async with running_robot(NXT, seed=3) as robot:
        await robot.call("nxt.line", distance_m=0.1, power=30)
        for motor in body_of(robot).brick.motors:
            motor.speed_rad_s = 8.0
        await asyncio.sleep(1.0)
        pushed = pose_of(robot).x_m
        await robot.call("nxt.line", distance_m=0.2, power=30)
        assert pose_of(robot).x_m - pushed > 0.2


async def test_compensation_makes_a_row_of_lines_worse() -> None:
    errors = []
    for compensate in (False, True):
        async with running_robot(NXT, seed=3) as robot:
            result = await robot.call("nxt.moves", moves=["line 0.2"] * 5, power=40, compensate=compensate)
            errors.append(max(abs(error) for pair in result["tacho_errors_deg"][1:] for error in pair))
    assert errors[1] > 1.5 * errors[0]


async def test_one_motor_turns_at_a_velocity() -> None:
    async with running_robot(NXT, seed=3) as robot:
        result = await robot.call("motor.velocity", node="right", velocity_rpm=30.0, duration_s=2.0)
        assert result["wheel_travel_m"] == pytest.approx(2.0 * 0.5 * math.tau * 0.028, rel=0.15)


@pytest.mark.parametrize(
    ("method", "params", "refusal"),
    [
        ("nxt.line", {"distance_m": 0.5, "power": 90}, LimitExceeded),
        ("drive.to", {"x_m": 1.0, "y_m": 0.0, "speed_m_s": 2.0}, LimitExceeded),
        ("drive.to", {"x_m": 99999.0, "y_m": 0.0}, LimitExceeded),
        ("nxt.goto", {"x_m": 0.0, "y_m": -101.0}, LimitExceeded),
        ("drive.to", {"x_m": 1.0, "y_m": 0.0, "end_vx_m_s": 0.1}, UsageError),
        ("drive.to", {"x_m": 1.0, "y_m": 0.0, "planner": "published"}, UsageError),
        ("nxt.moves", {"moves": ["hop 3"]}, UsageError),
        ("nxt.moves", {"moves": ["bend 0.2"]}, UsageError),
        ("nxt.moves", {"moves": [7]}, UsageError),
        ("nxt.moves", {"moves": [""]}, UsageError),
        ("nxt.moves", {"moves": ["line nan"]}, UsageError),
        ("nxt.moves", {"moves": ["line 1e9"]}, UsageError),
        ("nxt.moves", {"moves": [], "feedback": True}, UsageError),
        ("motor.velocity", {"node": "right", "velocity_rpm": 500.0, "duration_s": 1.0}, LimitExceeded),
        ("motor.position", {"node": "right", "position_qc": 90}, Refused),
        ("motor.current", {"node": "right", "current_ma": 100.0, "duration_s": 1.0}, Refused),
        ("drive.turn", {"rear_deg": 1.0, "front_deg": 1.0, "speed_m_s": 0.1, "duration_s": 1.0}, Refused),
    ],
)
async def test_what_cannot_be_is_refused_and_nothing_moves(
    method: str, params: dict[str, Any], refusal: type[CanhelmError]
) -> None:
    async with running_robot(NXT, seed=3) as robot:
        with pytest.raises(refusal) as refused:
            await robot.call(method, **params)
        assert refused.value.remedy
        assert pose_of(robot) == Pose()


async def test_with_an_empty_battery_nothing_begins() -> None:
    async with running_robot(NXT, seed=3) as robot:
        twin_of(robot).brick.battery_v = 6.0
        await robot.call("nxt.battery")
        with pytest.raises(NotReady, match="has only 6"):
            await robot.call("nxt.line", distance_m=0.1)


async def test_the_battery_and_the_brick_are_told() -> None:
    async with running_robot(NXT, seed=3) as robot:
        battery, info = await robot.call("nxt.battery"), await robot.call("nxt.info")
        assert (battery["battery_v"], battery["low"]) == (8.0, False)
        assert (info["firmware"], info["sleep_limit_s"]) == ("1.31", 600.0)


async def test_another_brick_is_unknown() -> None:
    async with running_robot(NXT, seed=3) as robot:
        with pytest.raises(CanhelmError, match="no brick 'other'"):
            await robot.call("nxt.info", brick="other")


async def test_a_goal_that_is_not_reached_in_time_is_a_timeout() -> None:
    async with running_robot(NXT, seed=3) as robot:
        with pytest.raises(Timeout, match=r"not reached in 1 s: 0\.\d+ m and"):
            await robot.call("nxt.goto", x_m=1.0, y_m=0.0, heading_deg=0.0, timeout_s=1.0)
        assert robot.state == "idle"


async def begin(robot: Robot, method: str, **params: Any) -> asyncio.Task[dict[str, Any]]:
    """A motion that is well under way."""
    motion = asyncio.create_task(robot.call(method, **params))
    await robot.until(lambda: turning(robot))
    await asyncio.sleep(0.8)
    return motion


MOTIONS = [("nxt.line", {"distance_m": 1.0}), ("drive.to", {"x_m": 1.0, "y_m": 0.0})]


@pytest.mark.parametrize(("method", "params"), MOTIONS)
async def test_a_stop_ends_a_motion_and_the_motors(method: str, params: dict[str, Any]) -> None:
    async with running_robot(NXT, seed=3) as robot:
        motion = await begin(robot, method, **params)
        await robot.call("stop")
        with pytest.raises(Refused, match="stop was commanded"):
            await motion
        assert not turning(robot)
        assert robot.state == "idle"


@pytest.mark.parametrize(("method", "params"), MOTIONS)
async def test_a_client_that_falls_silent_loses_its_motion(method: str, params: dict[str, Any]) -> None:
    async with running_robot(NXT, seed=3) as robot:
        motion = await begin(robot, method, **params)
        await robot.fall_silent()
        with pytest.raises(Refused, match="ran out"):
            await motion
        assert not turning(robot)


async def test_an_emergency_stop_is_latched() -> None:
    async with running_robot(NXT, seed=3, expect_errors=True) as robot:
        motion = await begin(robot, "nxt.line", distance_m=1.0)
        await robot.call("estop")
        with pytest.raises(CanhelmError, match="emergency stop"):
            await motion
        await robot.until(lambda: not turning(robot))
        assert robot.state == "estop"
        await robot.call("reset")
        assert robot.state == "idle"


@pytest.mark.parametrize(("method", "params"), MOTIONS)
async def test_a_lost_connection_is_a_fault_within_a_second_and_nothing_starts_again(
    method: str, params: dict[str, Any]
) -> None:
    async with running_robot(NXT, seed=3, expect_errors=True) as robot:
        motion = await begin(robot, method, **params)
        twin_of(robot).link.drop()
        assert await robot.until(lambda: robot.state == "fault", timeout_s=1.0) < 1.0
        with pytest.raises(CanhelmError, match="gone: out of reach"):
            await motion
        await robot.until(lambda: twin_of(robot).brick.carried_out[requests.GetDeviceInfo] == 2)
        await asyncio.sleep(1.0)
        assert robot.state == "fault"
        assert not turning(robot)
        await robot.call("reset")
        assert robot.state == "idle"
        await robot.call("nxt.line", distance_m=0.1)


async def test_a_brick_that_is_switched_off_at_rest_is_waited_for() -> None:
    async with running_robot(NXT, seed=3, expect_errors=True) as robot:
        await robot.call("nxt.line", distance_m=0.2)
        before = robot.app.devices.drives["right"].position_m
        await robot.call("simulation.power", node="nxt", on=False)
        await robot.until(lambda: robot.state == "waiting")
        await robot.call("simulation.power", node="nxt", on=True)
        await robot.until(lambda: robot.state == "idle")
        await asyncio.sleep(0.5)
        assert robot.app.devices.drives["right"].position_m == pytest.approx(before, abs=1e-3)


async def test_a_daemon_that_stands_still_lets_the_speeds_run_out() -> None:
    async with running_robot(NXT, seed=3, expect_errors=True) as robot:
        motion = await begin(robot, "drive.to", x_m=1.0, y_m=0.0)
        robot.app.cycle.stop()
        await asyncio.sleep(2.0)
        assert not turning(robot)
        robot.app.cycle.start()
        await robot.call("stop")
        with pytest.raises(Refused):
            await motion


async def test_going_down_in_a_move_stops_the_motors() -> None:
    async with running_robot(NXT, seed=3) as robot:
        motion = await begin(robot, "nxt.line", distance_m=1.0)
        await robot.app.supervisor.close()
        assert not turning(robot)
        with pytest.raises(Refused, match="going down"):
            await motion


async def test_it_goes_down_at_the_very_moment_at_which_a_target_comes() -> None:
    async with running_robot(NXT, seed=3) as robot:
        (motors,) = robot.app.devices._motor_cycles
        await robot.until(lambda: bool(motors._given._waiters))
        motors._given.set()
        async with asyncio.timeout(2.0):
            await motors.close()


async def test_the_status_tells_of_the_brick_and_its_motors() -> None:
    async with running_robot(NXT, seed=3) as robot:
        status = robot.app.service.status()
        assert [node["name"] for node in status["nodes"]] == ["right", "left"]
        assert status["bricks"][0]["battery_v"] == 8.0
        assert status["vehicle"]["type"] == "differential"
