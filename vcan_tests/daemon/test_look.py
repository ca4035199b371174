"""What a daemon tells a map: shape, pose, headings of wheels, centre of rotation, the path and the errors beside it."""

from __future__ import annotations

import asyncio
import math
import pathlib
from typing import Any

import msgspec
import pytest

from canhelm.errors import LimitExceeded, Refused
from daemon.api.methods import METHODS
from daemon.api.parameters import Role
from daemon.loops.odometry import Pose
from daemon.loops.path import Path, Piece
from daemon.loops.path_driving import STRAYED_M, STRAYED_RAD
from daemon.runs.store import RunStore, read_runs
from daemon.runs.table import Table, read_table
from daemon.runtime.look_commands import MAX_SHOWN, told
from daemon.runtime.paired_steer_vehicle import PairedSteerVehicle
from daemon.runtime.path_building import PathBuilder
from drivers.simulated.semitrailer import SemitrailerWorld
from profiles.loader import load
from profiles.path_file import PieceSpec
from vcan_tests.robot import Robot, running_robot

ROBOTS = ("max2d", "turtle", "semitrailer", "semitrailer_lab", "ackermann", "nxt")


def shown(robot: Robot) -> dict[str, Any]:
    vehicle: dict[str, Any] = robot.app.service.status()["vehicle"]
    return vehicle


async def shape(robot: Robot) -> dict[str, Any]:
    return await robot.app.service.call("vehicle.shape", {}, None)


def test_whoever_may_watch_may_look() -> None:
    assert {METHODS[name].role for name in ("vehicle.shape", "path.active")} == {Role.WATCH}


@pytest.mark.parametrize("name", ROBOTS)
async def test_every_wheel_of_the_shape_lies_in_its_part_and_has_a_heading(name: str) -> None:
    async with running_robot(load(name).profile) as robot:
        told = await shape(robot)
        outlines = {part["name"]: part["outline_m"] for part in told["parts"]}
        for wheel in told["wheels"]:
            xs, ys = zip(*outlines[wheel["part"]], strict=True)
            assert min(xs) <= wheel["x_m"] <= max(xs)
            assert min(ys) <= wheel["y_m"] <= max(ys)
        assert shown(robot)["wheels_deg"].keys() == {wheel["name"] for wheel in told["wheels"]}
        assert told["simulated"] is True


@pytest.mark.parametrize(
    ("name", "streamed"),
    [
        ("max2d", {"direction", "steering"}),
        ("turtle", {"direction", "yaw_rate"}),
        ("semitrailer", {"steering"}),
        ("nxt", {"yaw_rate"}),
    ],
)
async def test_a_stream_takes_what_its_shape_names_and_refuses_the_rest(name: str, streamed: set[str]) -> None:
    async with running_robot(load(name).profile) as robot:
        stream = (await shape(robot))["stream"]
        assert {parameter for parameter, taken in stream.items() if taken} == streamed
        parameters = {"direction": "direction_deg", "yaw_rate": "yaw_rate_deg_s", "steering": "steering_deg"}
        for parameter in streamed:
            robot.app.vehicle.set_point({"speed_m_s": 0.05, parameters[parameter]: 5.0})
        for parameter in parameters.keys() - streamed:
            with pytest.raises(Refused):
                robot.app.vehicle.set_point({"speed_m_s": 0.05, parameters[parameter]: 5.0})


async def test_the_wheels_of_the_max2d_stand_at_their_contact_points_and_turn_about_their_pivots() -> None:
    async with running_robot() as robot:
        wheels = {wheel["name"]: wheel for wheel in (await shape(robot))["wheels"]}
        assert (wheels["front_left"]["x_m"], wheels["front_left"]["y_m"]) == (0.23, 0.235)
        assert (wheels["front_left"]["pivot_x_m"], wheels["front_left"]["pivot_y_m"]) == (0.225, 0.16)


async def test_the_rolling_lines_of_omni_wheels_have_their_levers() -> None:
    async with running_robot(load("turtle").profile) as robot:
        headings = shown(robot)["wheels_deg"]
        for wheel in (await shape(robot))["wheels"]:
            turn = math.radians(headings[wheel["name"]])
            lever = wheel["x_m"] * math.sin(turn) - wheel["y_m"] * math.cos(turn)
            assert lever == pytest.approx(0.2, abs=1e-3)


async def test_only_the_semitrailer_has_a_trailer_and_a_limit_of_bending() -> None:
    async with running_robot(load("semitrailer").profile) as robot:
        told = await shape(robot)
        assert [part["name"] for part in told["parts"]] == ["body", "trailer"]
        assert told["limits"]["bending_deg"] == 80.0
        assert max(x for x, _ in told["parts"][1]["outline_m"]) > 0.615


@pytest.mark.parametrize(("name", "drive"), [("semitrailer", "steering"), ("ackermann", "steering"), ("max2d", None)])
async def test_the_drive_of_a_steered_axle_is_named(name: str, drive: str | None) -> None:
    async with running_robot(load(name).profile) as robot:
        assert (await shape(robot))["steering"] == drive


async def test_a_car_without_reverse_says_so() -> None:
    async with running_robot(load("ackermann").profile) as robot:
        told = await shape(robot)
        assert told["limits"]["backward_m_s"] == 0.0
        assert told["path"]["smallest_radius_backward_m"] is None


@pytest.mark.parametrize(("name", "lead_m"), [("semitrailer", 0.602), ("ackermann", 0.0), ("max2d", 0.0)])
async def test_a_map_knows_how_far_the_path_jumps_where_the_driving_direction_changes(name: str, lead_m: float) -> None:
    async with running_robot(load(name).profile) as robot:
        assert (await shape(robot))["path"]["lead_m"] == pytest.approx(lead_m)


@pytest.mark.parametrize("name", ["semitrailer", "ackermann"])
async def test_an_arc_of_the_smallest_radius_is_a_path_and_a_narrower_one_is_none(name: str) -> None:
    async with running_robot(load(name).profile) as robot:
        radius = (await shape(robot))["path"]["smallest_radius_m"]
        await dry_run(robot, radius)
        with pytest.raises(LimitExceeded, match="radius"):
            await dry_run(robot, radius - 0.002)


async def dry_run(robot: Robot, radius_m: float) -> None:
    path = {"pieces": [{"arc_deg": 90.0, "radius_m": radius_m}]}
    await robot.call("drive.path", path=path, dry_run=True)


async def test_drives_without_a_vehicle_have_no_shape_and_no_pose() -> None:
    bench = msgspec.structs.replace(load("max2d").profile, vehicle=None, brakes={})
    async with running_robot(bench, booted=False) as robot:
        told = await shape(robot)
        assert (told["type"], told["parts"], told["wheels"], told["stream"], told["path"]) == (None, [], [], None, None)
        assert (shown(robot)["pose"], shown(robot)["icr"], shown(robot)["following"]) == (None, None, None)


async def test_reflectors_of_the_localisation_are_in_the_shape() -> None:
    async with running_robot(load("semitrailer_lab").profile) as robot:
        given = robot.app.profile.localisation
        assert given is not None
        assert {mark["name"] for mark in (await shape(robot))["reflectors"]} == given.reflectors.keys()


async def test_the_pose_is_where_the_robot_was_driven_to() -> None:
    async with running_robot(load("turtle").profile) as robot:
        await robot.call("drive.to", x_m=0.3, y_m=-0.2, heading_deg=30.0)
        pose = shown(robot)["pose"]
        assert (pose["x_m"], pose["y_m"], pose["yaw_deg"]) == pytest.approx((0.3, -0.2, 30.0), abs=0.3)


async def test_steered_pairs_point_to_their_centre_of_rotation() -> None:
    async with running_robot() as robot:
        await robot.call("drive.turn", rear_deg=-15.0, front_deg=15.0, speed_m_s=0.3, duration_s=1.0)
        vehicle = robot.app.vehicle
        assert isinstance(vehicle, PairedSteerVehicle)
        icr, rear = shown(robot)["icr"], math.radians(shown(robot)["wheels_deg"]["rear_left"])
        along = (icr["x_m"] + 0.225) * math.cos(rear) + icr["y_m"] * math.sin(rear)
        assert along == pytest.approx(-vehicle.geometry.contact_lead_m, abs=1e-3)
        assert icr["y_m"] == pytest.approx(0.225 / math.tan(math.radians(15.0)), rel=0.05)


async def test_straight_ahead_there_is_no_centre_of_rotation() -> None:
    async with running_robot(load("turtle").profile) as robot:
        driving = robot.begin("drive.parallel", angle_deg=20.0, speed_m_s=0.3, duration_s=1.0)
        await robot.until(lambda: robot.speed_m_s > 0.2)
        assert shown(robot)["icr"] is None
        await driving


async def test_a_turn_on_the_spot_has_its_centre_in_the_middle() -> None:
    async with running_robot(load("turtle").profile) as robot:
        turning = robot.begin("drive.rotate", rate_deg_s=40.0, duration_s=2.0)
        await asyncio.sleep(1.5)
        icr = shown(robot)["icr"]
        assert math.hypot(icr["x_m"], icr["y_m"]) < 0.02
        await turning


async def test_backwards_the_semitrailer_tells_its_errors_and_the_limits_of_its_law() -> None:
    async with running_robot(load("semitrailer").profile) as robot:
        path = {"pieces": [{"line_m": 0.5}, {"arc_deg": 40, "radius_m": 2.0}]}
        driving = robot.begin("drive.path", path=path, backward=True)
        await robot.until(lambda: (shown(robot)["following"] or {"progress_m": 0.0})["progress_m"] > 1.0)
        told = shown(robot)["following"]
        world = robot.network.world
        assert isinstance(world, SemitrailerWorld)
        assert told["length_m"] == pytest.approx(0.5 + math.radians(40) * 2.0, abs=1e-3)
        assert told["backward"] is True
        assert abs(told["error_m"]) < 0.05
        assert told["limits"]["error_m"] == STRAYED_M
        assert told["limits"]["heading_error_deg"] == pytest.approx(math.degrees(STRAYED_RAD))
        guard_deg = told["limits"]["bending_error_deg"]
        assert 0.0 < guard_deg < 77.0
        wanted = abs(math.degrees(world.bending_rad) - told["bending_error_deg"])
        assert guard_deg + wanted == pytest.approx(77.0, abs=1.0)
        await driving
        assert shown(robot)["following"] is None


async def test_the_max2d_tells_its_distance_from_a_path_that_it_drives_in_pieces() -> None:
    async with running_robot() as robot:
        driving = robot.begin("drive.path", path={"pieces": [{"line_m": 0.6}, {"arc_deg": 40, "radius_m": 0.8}]})
        await robot.until(lambda: (shown(robot)["following"] or {"progress_m": 0.0})["progress_m"] > 0.4)
        told = shown(robot)["following"]
        assert abs(told["error_m"]) < 0.02
        assert abs(told["heading_error_deg"]) < 3.0
        assert told["bending_error_deg"] is None
        assert set(told["limits"].values()) == {None}
        await driving


async def test_the_path_that_is_followed_is_told_where_it_lies() -> None:
    async with running_robot(load("semitrailer").profile) as robot:
        driving = robot.begin("drive.path", path={"pieces": [{"line_m": 0.5}, {"arc_deg": 40, "radius_m": 2.0}]})
        await robot.until(lambda: bool(robot.app.supervisor.motions))
        active = await robot.app.service.call("path.active", {}, None)
        (motion,) = robot.app.supervisor.motions
        assert active["motion"] == motion
        assert active["path"]["start"] == {"x_m": 0.0, "y_m": 0.0, "heading_deg": 0.0}
        assert active["path"]["pieces"] == [
            {"from_m": [0.0, 0.0], "drive": "forward", "line_m": 0.5},
            {"from_m": [0.5, 0.0], "drive": "forward", "arc_deg": 40.0, "radius_m": 2.0},
        ]
        await driving
        assert (await robot.app.service.call("path.active", {}, None))["path"] is None


def test_a_told_path_built_again_is_the_same() -> None:
    lead = 0.6
    there = Piece(1.0, 2.0, 0.5, 1.2, 0.4)
    end, heading = there.point(1.2), there.heading(1.2)
    behind = (end[0] - lead * math.cos(heading), end[1] - lead * math.sin(heading))
    back = Piece(*behind, heading + math.pi, 0.8, 0.0, backward=True)
    path = Path([there, back], lead)
    spec = told(path)
    start = spec["start"]
    begin = Pose(start["x_m"], start["y_m"], math.radians(start["heading_deg"]))
    builder = PathBuilder(begin, lead, False, math.inf, math.inf)
    for piece in spec["pieces"]:
        builder.add(PieceSpec(**piece))
    again = builder.finished(0.0)
    for one, other in zip(path.pieces, again.pieces, strict=True):
        assert one.point(one.length_m) == pytest.approx(other.point(other.length_m), abs=1e-4)
        assert one.backward == other.backward


def test_of_a_very_long_path_the_first_pieces_are_told() -> None:
    path = Path([Piece(0.01 * number, 0.0, 0.0, 0.01) for number in range(MAX_SHOWN + 5)])
    assert len(told(path)["pieces"]) == MAX_SHOWN


async def test_errors_beside_the_path_and_their_limits_are_columns_of_the_run(tmp_path: pathlib.Path) -> None:
    async with running_robot(load("semitrailer").profile, runs=RunStore(tmp_path)) as robot:
        await robot.call("drive.path", path={"pieces": [{"arc_deg": 30, "radius_m": 2.0}]})
    (run,) = read_runs([tmp_path], None)
    table = read_table(run)
    assert max(map(abs, known(table, "path.error_m"))) < 0.02
    assert 0.0 < max(map(abs, known(table, "path.heading_error_deg"))) < 2.0
    assert set(known(table, "path.error_limit_m")) == {STRAYED_M}
    assert len(known(table, "path.bending_error_deg")) == len(known(table, "path.error_m"))


def known(table: Table, column: str) -> list[float]:
    return [value for value in table.numbers[column] if not math.isnan(value)]
