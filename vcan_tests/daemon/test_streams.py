"""Values that are good for a while, and what each vehicle makes of ``drive.set``."""

from __future__ import annotations

import asyncio
import math
from typing import Any

import msgspec
import pytest

from canhelm.errors import CanhelmError, LimitExceeded, Refused, UsageError
from daemon.runtime.streams import STREAM_END_S, Streamed
from profiles.loader import load
from vcan_tests.daemon.nxt_twin import body_of, pose_of
from vcan_tests.robot import running_robot


async def test_a_value_is_good_until_it_is_too_old() -> None:
    stream = Streamed("left", 0.2)
    await asyncio.sleep(0.2)
    assert stream.newest() == "left"
    await asyncio.sleep(0.01)
    assert stream.newest() is None
    assert stream.age_ms == 210


async def test_a_new_value_is_good_from_its_own_time_on() -> None:
    stream = Streamed("left", 0.2)
    await asyncio.sleep(0.3)
    stream.take("right", 0.1)
    await asyncio.sleep(0.09)
    assert stream.newest() == "right"
    await asyncio.sleep(0.06)
    assert stream.newest() is None


async def test_a_value_that_equals_the_last_one_is_the_same_object() -> None:
    first, second = [1.0], [1.0]
    stream = Streamed(first, 0.2)
    stream.take(second, 0.2)
    assert stream.newest() is first


async def test_a_stream_is_over_some_time_after_its_last_value() -> None:
    stream = Streamed("left", 0.2)
    for later_s, over in ((0.2 + STREAM_END_S, False), (0.01, True)):
        await asyncio.sleep(later_s)
        stream.newest()
        assert stream.over == over


@pytest.mark.parametrize(
    ("name", "params", "error"),
    [
        ("max2d", {"yaw_rate_deg_s": 5.0}, Refused),
        ("max2d", {"direction_deg": 70.0, "steering_deg": 20.0}, LimitExceeded),
        ("turtle", {"steering_deg": 5.0}, Refused),
        ("ackermann", {"direction_deg": 5.0, "steering_deg": 5.0}, UsageError),
        ("ackermann", {"steering_deg": 46.0}, LimitExceeded),
        ("ackermann", {"yaw_rate_deg_s": 5.0}, Refused),
        ("semitrailer", {"steering_deg": 33.0}, LimitExceeded),
        ("semitrailer", {"speed_m_s": -0.5}, LimitExceeded),
        ("semitrailer", {"direction_deg": 5.0}, Refused),
        ("nxt", {"steering_deg": 5.0}, Refused),
        ("nxt", {"yaw_rate_deg_s": 50.0}, LimitExceeded),
        ("nxt", {"speed_m_s": 0.2}, LimitExceeded),
    ],
)
async def test_what_a_vehicle_cannot_do_is_refused(
    name: str, params: dict[str, Any], error: type[CanhelmError]
) -> None:
    async with running_robot(load(name).profile) as robot:
        with pytest.raises(error):
            await robot.call("drive.set", **{"speed_m_s": 0.1, "valid_for_ms": 200.0, **params})
        assert not robot.app.supervisor.motions


async def test_two_wheels_follow_a_speed_and_a_yaw_rate_and_stop_when_they_are_too_old() -> None:
    async with running_robot(load("nxt").profile) as robot:
        for _ in range(40):
            await robot.call("drive.set", speed_m_s=0.1, yaw_rate_deg_s=30.0, valid_for_ms=200.0)
            await asyncio.sleep(0.1)
        way_m, turned_rad = 0.1 * 3.9, math.radians(30.0) * 3.6
        assert pose_of(robot).yaw_rad == pytest.approx(turned_rad, abs=0.2)
        assert abs(pose_of(robot).y_m) < way_m
        await asyncio.sleep(1.5)
        assert all(abs(motor.speed_rad_s) < 0.05 for motor in body_of(robot).brick.motors)
        assert robot.app.supervisor.motions
        await robot.until(lambda: not robot.app.supervisor.motions, timeout_s=2.0)


async def test_wheels_that_cannot_do_both_keep_the_curve_and_go_slower() -> None:
    nxt = load("nxt").profile
    limits = msgspec.structs.replace(nxt.limits, wheel_speed_m_s=0.17)
    async with running_robot(msgspec.structs.replace(nxt, limits=limits)) as robot:
        for _ in range(20):
            await robot.call("drive.set", speed_m_s=0.17, yaw_rate_deg_s=45.0, valid_for_ms=200.0)
            await asyncio.sleep(0.1)
        assert robot.app.supervisor.active_limits == ("wheel_speed",)
        right, left = robot.app.supervisor.command.wheel_speed_m_s
        wanted = 0.0585 * math.radians(45.0)
        assert (right, left) == pytest.approx((0.17, 0.17 * (0.17 - wanted) / (0.17 + wanted)), rel=1e-3)


async def test_the_truck_follows_steering_and_speed() -> None:
    async with running_robot(load("semitrailer").profile) as robot:
        for _ in range(40):
            await robot.call("drive.set", speed_m_s=0.2, steering_deg=15.0, valid_for_ms=200.0)
            await asyncio.sleep(0.1)
        forward, _, rate = robot.network.world.velocity
        assert rate / forward == pytest.approx(math.tan(math.radians(15.0)) / 0.215, rel=0.05)
        assert await robot.until(lambda: robot.speed_m_s < 0.01) < 0.2 + 0.2 / 0.3 + 0.2


async def test_a_curve_of_the_paired_robot_has_both_pairs_against_each_other() -> None:
    async with running_robot(load("max2d").profile) as robot:
        for _ in range(60):
            await robot.call("drive.set", speed_m_s=0.3, steering_deg=-10.0, valid_for_ms=200.0)
            await asyncio.sleep(0.1)
        headings = [math.degrees(robot.network.world.heading_rad(pair)) for pair in ("rear", "front")]
        assert headings == pytest.approx([10.0, -10.0], abs=0.3)
        assert robot.network.world.velocity[2] < -0.1


@pytest.mark.parametrize("name", ["ackermann", "max2d", "nxt", "semitrailer", "turtle"])
async def test_the_end_of_its_lease_waits_until_a_streamed_motion_is_at_rest(name: str) -> None:
    async with running_robot(load(name).profile) as robot:
        for _ in range(40):
            await robot.call("drive.set", speed_m_s=0.15, valid_for_ms=300)
            await asyncio.sleep(0.05)
        moving, lease = robot.app.service.status()["motions"], robot.lease
        assert lease is not None
        await robot.hang_up()
        await robot.app.service.end_lease(lease, "its client ended it")
        assert ([motion["kind"] for motion in moving], robot.state) == (["drive.set"], "idle")
