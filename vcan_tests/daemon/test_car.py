"""A whole simulated Ackermann car: headings, arcs, streams, refusals and stops, over the simulated bus."""

from __future__ import annotations

import asyncio
import math
from typing import Any

import pytest

from canhelm.errors import DeviceFault, LimitExceeded, Refused
from daemon.runtime.car_motions import CarMotion
from drivers.simulated.ackermann import AckermannWorld
from profiles.loader import load
from vcan_tests.robot import Robot, running_robot

CAR = load("ackermann").profile


def world_of(robot: Robot) -> AckermannWorld:
    world = robot.network.world
    assert isinstance(world, AckermannWorld)
    world.advance(asyncio.get_running_loop().time())
    return world


@pytest.mark.parametrize(("heading_deg", "speed_m_s"), [(57.3, 2.0), (-114.6, 1.0), (11.5, 0.5), (170.0, 0.3)])
async def test_it_steers_to_a_heading_and_drives_at_the_speed(heading_deg: float, speed_m_s: float) -> None:
    async with running_robot(CAR) as robot:
        params = {"heading_deg": heading_deg, "speed_m_s": speed_m_s, "duration_s": 8.0}
        driving = asyncio.create_task(robot.call("drive.heading", **params))
        await asyncio.sleep(7.5)
        world = world_of(robot)
        assert world.velocity[0] == pytest.approx(speed_m_s, rel=0.02)
        assert math.remainder(math.degrees(world.pose[2]) - heading_deg, 360) == pytest.approx(0.0, abs=3.0)
        result = await driving
        assert result["heading_error_deg"] == pytest.approx(0.0, abs=0.5)
        assert robot.speed_m_s < 0.03
        assert robot.state == "idle"


@pytest.mark.parametrize("front_deg", [20.0, -40.0])
async def test_an_arc_of_fixed_steering_has_the_radius_of_the_geometry(front_deg: float) -> None:
    async with running_robot(CAR) as robot:
        params = {"rear_deg": 0.0, "front_deg": front_deg, "speed_m_s": 0.5, "duration_s": 4.0}
        await robot.call("drive.turn", **params)
        x, y, yaw = world_of(robot).rear_pose
        radius = 0.45 / math.tan(math.radians(front_deg))
        assert yaw == pytest.approx(2.0 / radius, rel=0.03)
        assert math.hypot(x, y - radius) == pytest.approx(abs(radius), rel=0.03)


async def test_straight_ahead_it_goes_as_far_as_speed_times_duration() -> None:
    async with running_robot(CAR) as robot:
        await robot.call("drive.turn", rear_deg=0.0, front_deg=0.0, speed_m_s=1.0, duration_s=3.0)
        assert world_of(robot).rear_pose == pytest.approx((3.0, 0.0, 0.0), abs=0.01)


async def test_odometry_follows_the_rear_axle() -> None:
    async with running_robot(CAR) as robot:
        await robot.call("drive.heading", heading_deg=90.0, speed_m_s=0.6, duration_s=5.0)
        x, y, yaw = world_of(robot).rear_pose
        told = robot.app.vehicle.status()["odometry"]
        assert (told["x_m"], told["y_m"]) == pytest.approx((x, y), abs=0.05)
        assert told["yaw_deg"] == pytest.approx(math.degrees(yaw), abs=1.0)


@pytest.mark.parametrize(
    ("method", "params"),
    [
        ("drive.heading", {"heading_deg": 0.0, "speed_m_s": -0.5, "duration_s": 1.0}),
        ("drive.turn", {"rear_deg": 0.0, "front_deg": 10.0, "speed_m_s": -0.5, "duration_s": 1.0}),
        ("drive.set", {"direction_deg": 0.0, "speed_m_s": -0.5, "yaw_rate_deg_s": 0.0, "valid_for_ms": 300.0}),
    ],
)
async def test_reverse_is_refused(method: str, params: dict[str, float]) -> None:
    async with running_robot(CAR) as robot:
        with pytest.raises(Refused, match="no reverse gear"):
            await robot.call(method, **params)


@pytest.mark.parametrize(
    ("changes", "limit"),
    [
        ({"front_deg": 46.0}, "limit_deg 45"),
        ({"speed_m_s": 2.1}, "speed_m_s 2"),
        ({"front_deg": 40.0, "speed_m_s": 1.5}, "lateral_acceleration_m_s2 allows 1.37"),
    ],
)
async def test_what_lies_beyond_a_limit_is_refused_with_the_limit(changes: dict[str, float], limit: str) -> None:
    params = {"rear_deg": 0.0, "front_deg": 0.0, "speed_m_s": 0.5, "duration_s": 1.0, **changes}
    async with running_robot(CAR) as robot:
        with pytest.raises(LimitExceeded) as refusal:
            await robot.call("drive.turn", **params)
        assert refusal.value.limit == limit


async def test_the_rear_wheels_do_not_steer() -> None:
    async with running_robot(CAR) as robot:
        with pytest.raises(Refused, match="rear wheels"):
            await robot.call("drive.turn", rear_deg=5.0, front_deg=5.0, speed_m_s=0.5, duration_s=1.0)


async def test_the_faster_it_goes_the_less_it_steers() -> None:
    """From full speed to a heading behind: the lateral acceleration keeps its limit, and the record says so."""
    async with running_robot(CAR) as robot:
        await robot.call("drive.set", direction_deg=0.0, speed_m_s=2.0, valid_for_ms=1000.0)
        for _ in range(5):
            await asyncio.sleep(0.4)
            await robot.call("drive.set", direction_deg=0.0, speed_m_s=2.0, valid_for_ms=1000.0)
        (motion,) = robot.app.supervisor.motions.values()
        assert isinstance(motion, CarMotion)
        lateral = []
        limits: set[str] = set()
        await robot.call("drive.set", direction_deg=170.0, speed_m_s=2.0, valid_for_ms=1000.0)
        for _ in range(9):
            await asyncio.sleep(0.1)
            forward, _, rate = world_of(robot).velocity
            lateral.append(abs(forward * rate))
            assert motion.record is not None
            limits |= set(motion.record.limits_active)
        assert max(lateral) < 3.5 * 1.1
        assert "lateral_acceleration" in limits


async def test_a_stale_stream_stops_the_car() -> None:
    async with running_robot(CAR) as robot:
        for _ in range(20):
            await robot.call("drive.set", direction_deg=30.0, speed_m_s=0.5, valid_for_ms=200.0)
            await asyncio.sleep(0.1)
        assert world_of(robot).velocity[2] > 0.2
        assert await robot.until(lambda: robot.speed_m_s < 0.01) < 0.7


async def test_a_stop_on_the_way_brings_it_to_rest_by_its_ramp() -> None:
    async with running_robot(CAR) as robot:
        driving = asyncio.create_task(robot.call("drive.heading", heading_deg=0.0, speed_m_s=1.0, duration_s=9.0))
        await asyncio.sleep(2.0)
        await robot.call("stop")
        assert robot.speed_m_s < 0.03
        with pytest.raises(Refused, match="stop was commanded"):
            await driving


async def test_a_steering_that_does_not_follow_ends_the_motion() -> None:
    async with running_robot(CAR, expect_errors=True) as robot:
        world_of(robot).steering.turn = lambda dt_s: None  # type: ignore[method-assign]
        with pytest.raises(DeviceFault, match="does not follow its drive"):
            await robot.call("drive.heading", heading_deg=90.0, speed_m_s=1.0, duration_s=5.0)
        assert robot.speed_m_s < 0.5


async def test_one_motor_can_be_turned_alone() -> None:
    async with running_robot(CAR) as robot:
        await robot.call("motor.velocity", node="steering", velocity_rpm=500.0, duration_s=0.5)
        assert math.degrees(world_of(robot).steering.angle_rad) == pytest.approx(15.0, abs=2.0)


async def follow(robot: Robot, pieces: list[dict[str, Any]], **params: Any) -> dict[str, Any]:
    asked = {"backward": False, "speed_m_s": 0.5, "law": "cascade", "kept": None, "dry_run": False, **params}
    return await robot.call("drive.path", path={"pieces": pieces}, **asked)


async def test_it_follows_a_path_to_its_end() -> None:
    async with running_robot(CAR) as robot:
        result = await follow(robot, [{"line_m": 1.0}, {"arc_deg": 90, "radius_m": 0.8}, {"line_m": 1.0}])
        assert world_of(robot).rear_pose == pytest.approx((1.8, 1.8, math.pi / 2), abs=0.03)
        assert result["end_error_m"] < 0.005
        assert result["largest_error_m"] < 0.015
        assert robot.state == "idle"


async def test_on_an_eight_it_keeps_to_the_path() -> None:
    async with running_robot(CAR) as robot:
        path = [{"arc_deg": 180, "radius_m": 1.0}, {"arc_deg": -180, "radius_m": 1.0}]
        result = await follow(robot, path, speed_m_s=0.8)
        assert world_of(robot).rear_pose == pytest.approx((0.0, 4.0, 0.0), abs=0.08)
        assert result["largest_error_m"] < 0.03


async def test_beside_the_path_it_comes_back_to_it() -> None:
    async with running_robot(CAR) as robot:
        result = await follow(robot, [{"from_m": [0.0, 0.15], "line_to_m": [3.0, 0.15]}])
        assert world_of(robot).rear_pose == pytest.approx((3.0, 0.15, 0.0), abs=0.02)
        assert result["largest_error_m"] == pytest.approx(0.15, abs=0.01)


async def test_a_path_with_a_narrower_bend_than_its_steering_allows_is_refused_with_the_piece() -> None:
    async with running_robot(CAR) as robot:
        with pytest.raises(LimitExceeded, match="radius") as refusal:
            await follow(robot, [{"line_m": 1.0}, {"arc_deg": 90, "radius_m": 0.4}, {"line_m": 1.0}])
        assert refusal.value.object == "pieces[1]"


@pytest.mark.parametrize(
    ("pieces", "backward", "place"),
    [([{"line_m": 1.0}], True, None), ([{"line_m": 1.0}, {"drive": "backward", "line_m": 1.0}], False, "pieces[1]")],
)
async def test_a_path_that_goes_backwards_is_refused(
    pieces: list[dict[str, Any]], backward: bool, place: str | None
) -> None:
    async with running_robot(CAR) as robot:
        with pytest.raises(Refused, match="no reverse gear") as refusal:
            await follow(robot, pieces, backward=backward)
        assert refusal.value.object == place
