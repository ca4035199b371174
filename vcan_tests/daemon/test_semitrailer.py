"""A whole simulated semi-trailer: paths, manoeuvres, refusals, guards and stops, over the simulated bus."""

from __future__ import annotations

import asyncio
import math
from typing import Any

import msgspec
import pytest

from canhelm.errors import EmergencyStop, LimitExceeded, Refused, UsageError
from daemon.loops.odometry import Pose
from daemon.loops.path import Path, Piece
from daemon.loops.path_speed import SpeedTuning
from daemon.runtime.path_motions import FollowedPath, PathMotion
from daemon.runtime.semitrailer_vehicle import SemitrailerVehicle
from drivers.simulated.semitrailer import SemitrailerWorld
from profiles.loader import load
from profiles.path_file import load_path_file
from vcan_tests.robot import Robot, running_robot

PROFILE = load("semitrailer").profile


def world_of(robot: Robot) -> SemitrailerWorld:
    world = robot.network.world
    assert isinstance(world, SemitrailerWorld)
    world.advance(asyncio.get_running_loop().time())
    return world


def vehicle_of(robot: Robot) -> SemitrailerVehicle:
    assert isinstance(robot.app.vehicle, SemitrailerVehicle)
    return robot.app.vehicle


def shipped(name: str) -> Any:
    return msgspec.to_builtins(load_path_file(name).spec)


def pieces(*given: dict[str, Any]) -> dict[str, Any]:
    return {"pieces": list(given)}


@pytest.mark.parametrize(
    ("name", "x_m", "y_m", "heading_deg"),
    [("park-parallel", -2.475, -0.5019, 0.0), ("park-perpendicular", -0.802, -2.7, 90.0)],
)
async def test_parking_ends_within_three_centimetres_and_two_degrees(
    name: str, x_m: float, y_m: float, heading_deg: float
) -> None:
    async with running_robot(PROFILE) as robot:
        result = await robot.call("drive.path", path=shipped(name))
        x, y, yaw = world_of(robot).trailer_pose
        assert math.hypot(x - x_m, y - y_m) < 0.03
        assert math.degrees(yaw) == pytest.approx(heading_deg, abs=2.0)
        assert math.degrees(world_of(robot).bending_rad) == pytest.approx(0.0, abs=2.0)
        assert result["end_error_m"] < 0.005
        assert robot.state == "idle"


async def test_a_circle_backwards_is_driven_by_both_laws() -> None:
    for law in ("cascade", "published"):
        async with running_robot(PROFILE) as robot:
            path = pieces({"arc_deg": 120, "radius_m": 1})
            result = await robot.call("drive.path", path=path, backward=True, law=law)
            assert result["end_error_m"] < 0.005
            assert math.degrees(world_of(robot).trailer_pose[2]) == pytest.approx(120.0, abs=1.5)


async def test_a_dry_run_tells_and_moves_nothing() -> None:
    async with running_robot(PROFILE) as robot:
        told = await robot.call("drive.path", path=shipped("eight"), dry_run=True)
        assert (told["pieces"], told["sections"], told["least_radius_m"]) == (2, 1, 1.2)
        assert told["length_m"] == pytest.approx(4 * math.pi * 1.2, abs=1e-3)
        assert not robot.app.supervisor.motions


async def test_each_step_tells_which_limit_is_active() -> None:
    async with running_robot(PROFILE) as robot:
        seen: set[str] = set()

        def look() -> None:
            for motion in robot.app.supervisor.motions.values():
                assert isinstance(motion, PathMotion)
                seen.update(motion.progress().get("limits_active", ()))

        robot.app.supervisor.observers.append(look)
        result = await robot.call("drive.path", path=shipped("reverse"))
        assert {"commanded_speed", "approach_to_end", "speed_for_steering", "steering_rate"} <= seen
        assert set(result["limits_s"]) <= seen


@pytest.mark.parametrize(
    ("path", "told"),
    [
        (pieces({"line_m": 1}, {"line_m": 1, "from_m": [1, 0.1]}), "beside the end"),
        (pieces({"line_m": 1}, {"arc_deg": 90, "radius_m": 0.4}), "has a radius of 0.400 m"),
        (pieces({"line_m": 1}, {"line_m": 0.1, "drive": "backward"}), "too short"),
    ],
)
async def test_a_bad_path_is_refused_by_its_piece_and_nothing_moves(path: dict[str, Any], told: str) -> None:
    async with running_robot(PROFILE) as robot:
        with pytest.raises((UsageError, LimitExceeded), match=told) as caught:
            await robot.call("drive.path", path=path)
        assert caught.value.object == "pieces[1]"
        assert not robot.app.supervisor.motions


@pytest.mark.parametrize("path", [{}, {"pieces": []}, {"pieces": [{"line": 1}]}, {"pieces": [3]}, {"start": 1}])
async def test_what_is_no_path_is_refused(path: dict[str, Any]) -> None:
    async with running_robot(PROFILE) as robot:
        with pytest.raises(UsageError):
            await robot.call("drive.path", path=path)


async def test_a_path_that_begins_elsewhere_is_refused() -> None:
    async with running_robot(PROFILE) as robot:
        with pytest.raises(Refused, match=r"begins 2\.00 m away"):
            await robot.call("drive.path", path={"start": {"x_m": 2}, "pieces": [{"line_m": 1}]})


async def test_a_dry_run_refuses_a_beginning_that_a_drive_would_refuse() -> None:
    async with running_robot(PROFILE) as robot:
        with pytest.raises(Refused, match=r"begins 2\.00 m away"):
            await robot.call("drive.path", path={"start": {"x_m": 2}, "pieces": [{"line_m": 1}]}, dry_run=True)


async def test_a_dry_run_needs_no_healthy_robot() -> None:
    async with running_robot(PROFILE, expect_errors=True) as robot:
        robot.app.supervisor.estop("pressed")
        told = await robot.call("drive.path", path=shipped("line"), dry_run=True)
        assert told["pieces"] == 1
        with pytest.raises(EmergencyStop):
            await robot.call("drive.path", path=shipped("line"))


async def test_an_endless_circle_has_an_end_error_of_none_when_it_is_stopped() -> None:
    async with running_robot(PROFILE) as robot:
        vehicle, circle = vehicle_of(robot), Path([Piece(0.0, 0.0, 0.0, math.inf, 0.8)])
        motion = FollowedPath(vehicle, circle, SpeedTuning(0.3, 0.3, 0.3), published=False).motion(None)
        robot.app.supervisor.admit(motion)
        await robot.until(lambda: world_of(robot).pose[1] > 0.2)
        motion.stop("enough")
        await motion.closed.wait()
        assert motion.progress()["error_m"] == pytest.approx(0.0, abs=0.02)


async def test_a_speed_beyond_the_limit_is_refused() -> None:
    async with running_robot(PROFILE) as robot:
        with pytest.raises(LimitExceeded, match="beyond the limit"):
            await robot.call("drive.path", path=shipped("line"), speed_m_s=3.0)


async def test_a_path_may_come_in_parts() -> None:
    async with running_robot(PROFILE) as robot:
        kept = None
        for _ in range(3):
            kept = (await robot.call("path.add", pieces=[{"line_m": 0.3}] * 2, kept=kept))["kept"]
        result = await robot.call("drive.path", path=pieces({"line_m": 0.2}), kept=kept)
        assert result["x_m"] == pytest.approx(2.0, abs=0.002)
        with pytest.raises(UsageError, match="no pieces are kept"):
            await robot.call("drive.path", path=pieces({"line_m": 1}), kept=kept)


async def test_a_hundred_thousand_pieces_are_taken_while_the_cycle_goes_on() -> None:
    async with running_robot(PROFILE) as robot:
        part = [{"line_m": 0.01}, {"arc_deg": 0.3, "radius_m": 2}] * 500
        kept = None
        for _ in range(100):
            kept = (await robot.call("path.add", pieces=part, kept=kept))["kept"]
        told = await robot.call("drive.path", path=pieces({"line_m": 1}), kept=kept, dry_run=True)
        assert told["pieces"] == 100_001


async def test_bent_too_far_it_does_not_begin_to_drive_and_says_so() -> None:
    async with running_robot(PROFILE, booted=False, powered=False, expect_errors=True) as robot:
        world_of(robot).place((0.0, 0.0, 0.0), math.radians(78.0))
        robot.network.power_on("all")
        await robot.until(lambda: robot.state == "idle")
        with pytest.raises(LimitExceeded, match="jackknife guard"):
            await robot.call("drive.path", path=pieces({"line_m": 2}), backward=True)
        assert not world_of(robot).touching
        assert robot.state == "idle"


async def test_a_client_that_hangs_stops_the_drive() -> None:
    async with running_robot(PROFILE) as robot:
        driving = asyncio.create_task(robot.call("drive.path", path=shipped("line")))
        await robot.until(lambda: world_of(robot).pose[0] > 0.5)
        await robot.hang_up()
        with pytest.raises(Refused, match="lease"):
            await driving
        assert robot.speed_m_s < 0.01


async def test_while_it_drives_another_path_is_refused() -> None:
    async with running_robot(PROFILE) as robot:
        driving = asyncio.create_task(robot.call("drive.path", path=shipped("line")))
        await robot.until(lambda: world_of(robot).pose[0] > 0.2)
        with pytest.raises(Refused, match=r"motion 1 \(drive\.path, held by .*\) is running"):
            await robot.call("drive.path", path=shipped("line"))
        await driving


async def test_from_outside_it_is_told_where_it_is() -> None:
    async with running_robot(PROFILE) as robot:
        vehicle_of(robot).locate(Pose(5.0, 1.0, math.pi / 2))
        await robot.call(
            "drive.path", path={"start": {"x_m": 5, "y_m": 1, "heading_deg": 90}, "pieces": [{"line_m": 1}]}
        )
        status = robot.app.service.status()["vehicle"]
        assert status["odometry"]["y_m"] == pytest.approx(2.0, abs=0.002)
        assert status["trailer"]["y_m"] == pytest.approx(2.0 - 0.602, abs=0.002)
        assert status["jackknife_margin_deg"] == pytest.approx(80.0, abs=0.2)


async def test_a_robot_that_steers_otherwise_has_no_paths_of_this_kind() -> None:
    async with running_robot(load("turtle").profile) as robot:
        with pytest.raises(Refused, match=r"has no drive\.path"):
            await robot.call("drive.path", path=shipped("line"))


async def test_of_paths_in_parts_the_oldest_one_makes_room() -> None:
    async with running_robot(PROFILE) as robot:
        names = [(await robot.call("path.add", pieces=[{"line_m": 1}]))["kept"] for _ in range(3)]
        with pytest.raises(UsageError, match="no pieces are kept"):
            await robot.call("path.add", pieces=[{"line_m": 1}], kept=names[0])
        assert (await robot.call("path.add", pieces=[{"line_m": 1}], kept=names[2]))["pieces"] == 2
