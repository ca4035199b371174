"""A whole simulated MAX2D follows paths in pieces, stop and steer, over the simulated bus."""

from __future__ import annotations

import asyncio
import math
from typing import Any

import pytest

from canhelm.errors import LimitExceeded, Refused, UsageError
from daemon.runtime.path_in_pieces import PathInPieces
from vcan_tests.robot import Robot, running_robot

BEND = [{"line_m": 0.5}, {"arc_deg": 60, "radius_m": 0.8}, {"line_m": 0.5}]


async def follow(robot: Robot, pieces: list[dict[str, Any]], **params: Any) -> dict[str, Any]:
    asked = {"backward": False, "speed_m_s": 0.5, "law": "cascade", "kept": None, "dry_run": False, **params}
    start = asked.pop("start", None)
    path = {"pieces": pieces} if start is None else {"pieces": pieces, "start": start}
    return await robot.call("drive.path", path=path, **asked)


def pose_of(robot: Robot) -> tuple[float, float, float]:
    robot.network.world.advance(asyncio.get_running_loop().time())
    return robot.network.world.pose


async def test_the_pieces_and_their_deviations_are_told_before_anything_moves() -> None:
    async with running_robot() as robot:
        told = await follow(robot, [*BEND, {"arc_deg": 30, "radius_m": 0.2}], dry_run=True)
        assert [piece["kind"] for piece in told["pieces"]] == ["line", "arc", "line", "line"]
        assert [piece["deviation_m"] for piece in told["pieces"]][:3] == [0.0, 0.0, 0.0]
        assert 0.001 < told["pieces"][3]["deviation_m"] <= 0.01
        assert told["deviation_m"] == told["pieces"][3]["deviation_m"]
        assert told["stops"] == 3
        assert robot.speed_m_s == 0.0
        assert not robot.app.supervisor.motions


async def test_it_follows_lines_and_arcs_and_tells_the_driven_deviation() -> None:
    async with running_robot() as robot:
        result = await follow(robot, BEND)
        x, y, yaw = pose_of(robot)
        end_x = 0.5 + 0.8 * math.sin(math.pi / 3) + 0.25
        end_y = 0.4 + 0.5 * math.sin(math.pi / 3)
        assert math.hypot(x - end_x, y - end_y) < 0.08
        assert math.degrees(yaw) == pytest.approx(60, abs=3)
        assert result["driven_deviation_m"] < 0.01
        assert result["error_m"] < 0.005
        assert [piece["deviation_m"] for piece in result["pieces"]] == [0.0, 0.0, 0.0]
        assert max(piece["driven_deviation_m"] for piece in result["pieces"]) == result["driven_deviation_m"]
        assert robot.state == "idle"


async def test_a_narrow_bend_is_driven_at_angles_with_the_yaw_as_it_was() -> None:
    async with running_robot() as robot:
        result = await follow(robot, [{"line_m": 0.3}, {"arc_deg": -60, "radius_m": 0.2}])
        x, y, yaw = pose_of(robot)
        assert (x, y) == pytest.approx((0.3 + 0.2 * math.sin(math.pi / 3), -0.1), abs=0.02)
        assert math.degrees(yaw) == pytest.approx(0.0, abs=1.5)
        assert result["deviation_m"] <= 0.01
        assert result["driven_deviation_m"] < result["deviation_m"] + 0.005


async def test_backward_it_drives_the_path_the_other_way_along_its_body() -> None:
    async with running_robot() as robot:
        await follow(robot, [{"line_m": 0.5}], backward=True)
        assert pose_of(robot) == pytest.approx((-0.5, 0.0, 0.0), abs=0.02)


async def test_a_path_that_begins_elsewhere_is_refused() -> None:
    async with running_robot() as robot:
        with pytest.raises(Refused, match="m from the robot"):
            await follow(robot, BEND, start={"x_m": 1.0})


async def test_the_semitrailers_published_law_is_refused() -> None:
    async with running_robot() as robot:
        with pytest.raises(Refused, match="published law"):
            await follow(robot, BEND, law="published")


async def test_a_gap_in_the_path_is_refused_with_its_piece() -> None:
    async with running_robot() as robot:
        with pytest.raises(UsageError) as refusal:
            await follow(robot, [{"line_m": 0.5}, {"from_m": [0.6, 0.0], "line_to_m": [1.0, 0.0]}])
        assert refusal.value.object == "pieces[1]"


async def test_a_stop_on_the_way_ends_the_path() -> None:
    async with running_robot() as robot:
        driving = asyncio.create_task(follow(robot, BEND))
        await robot.until(lambda: pose_of(robot)[0] > 0.8)
        (motion,) = robot.app.supervisor.motions.values()
        assert isinstance(motion, PathInPieces)
        assert motion.progress()["piece"] == "2 of 3"
        await robot.call("stop")
        with pytest.raises(Refused, match="stop was commanded"):
            await driving
        assert pose_of(robot)[0] < 1.3
        assert robot.state == "idle"


async def test_a_speed_beyond_the_limit_is_refused_and_not_capped() -> None:
    async with running_robot() as robot:
        with pytest.raises(LimitExceeded, match=r"9 m/s is beyond the vehicle's limit") as caught:
            await follow(robot, BEND, speed_m_s=9.0, dry_run=True)
        assert caught.value.limit == f"speed_m_s {robot.app.profile.limits.speed_m_s:g}"


async def test_a_dry_run_refuses_a_beginning_that_a_drive_would_refuse() -> None:
    async with running_robot() as robot:
        with pytest.raises(Refused, match=r"begins 0\.10 m from the robot"):
            await follow(robot, BEND, start={"x_m": 0.1}, dry_run=True)


async def test_pieces_are_told_by_the_numbers_of_the_file() -> None:
    async with running_robot() as robot:
        way: list[dict[str, Any]] = [{"waypoints_m": [[1, 0], [1, 1]], "radius_m": 0.8}, {"line_m": 0.5}]
        told = await follow(robot, way, dry_run=True)
        assert told["pieces"][0]["path_pieces"][0] == 0
        assert told["pieces"][-1]["path_pieces"][1] == 1
