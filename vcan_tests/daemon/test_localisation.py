"""A vehicle that goes by the bearings of its scanner."""

from __future__ import annotations

import asyncio
import math
from pathlib import Path
from typing import Any

import pytest
from msgspec.structs import replace

from canhelm.errors import ConfigError, NotReady, UsageError
from daemon.loops.localisation import composed
from daemon.loops.odometry import Pose
from drivers.simulated.semitrailer import SemitrailerWorld
from profiles.loader import load
from profiles.localisation import SimulatedScannerConfig
from profiles.schema import Profile
from vcan_tests.daemon.reflectors import true_bearing
from vcan_tests.robot import Robot, running_robot


def lab(**simulated: Any) -> Profile:
    """The semi-trailer among reflectors, with this scanner; with none where nothing is given."""
    profile = load("semitrailer_lab").profile
    assert profile.simulation is not None
    eye = SimulatedScannerConfig(**simulated) if simulated else None
    return replace(profile, simulation=replace(profile.simulation, scanner=eye))


def error_m(robot: Robot) -> float:
    """Distance between where the vehicle is and where the daemon believes it to be."""
    x, y, _ = robot.network.world.pose
    told = robot.app.service.status()["localisation"]
    return math.hypot(told["x_m"] - x, told["y_m"] - y)


async def test_a_vehicle_knows_its_place_after_the_first_scan() -> None:
    async with running_robot(lab(rate_hz=10.0, noise_deg=0.1), booted=False, powered=False) as robot:
        world = robot.network.world
        assert isinstance(world, SemitrailerWorld)
        world.place((0.5, -0.4, 0.6), 0.2, 0.0)
        robot.network.power_on("all")
        await robot.until(lambda: robot.state == "idle")
        await asyncio.sleep(0.5)
        assert robot.app.service.status()["localisation"]["state"] == "fixed"
        assert error_m(robot) < 0.02


async def test_a_path_waits_for_the_first_fix() -> None:
    line = {"pieces": [{"line_m": 1.0}]}
    async with running_robot(lab(rate_hz=0.5), booted=False, powered=False) as robot:
        world = robot.network.world
        assert isinstance(world, SemitrailerWorld)
        world.place((0.5, -0.4, 0.6), 0.0, 0.0)
        robot.network.power_on("all")
        await robot.until(lambda: robot.state == "idle")
        assert robot.app.service.status()["localisation"]["state"] == "waiting"
        result = await robot.call("drive.path", path=line)
        assert (result["x_m"], result["y_m"]) == pytest.approx((0.5 + math.cos(0.6), -0.4 + math.sin(0.6)), abs=0.03)


async def test_a_path_is_refused_where_no_scan_ever_tells_the_place() -> None:
    async with running_robot(lab()) as robot:
        with pytest.raises(NotReady, match="no scan has shown three reflectors"):
            await robot.call("drive.path", path={"pieces": [{"line_m": 1.0}]})


async def test_a_scanner_on_the_trailer_keeps_the_truck_in_place_while_it_drives() -> None:
    line = {"pieces": [{"line_m": 1.5, "drive": "backward"}]}
    async with running_robot(lab(rate_hz=10.0, noise_deg=0.1, hidden_share=0.3, delay_ms=40.0)) as robot:
        await asyncio.sleep(0.5)
        driving = asyncio.create_task(robot.call("drive.path", path=line))
        errors: list[float] = []
        robot.app.supervisor.observers.append(lambda: errors.append(error_m(robot)))
        await driving
        assert max(errors) < 0.03


async def test_any_program_may_send_the_bearings() -> None:
    async with running_robot(lab()) as robot:
        localisation = robot.app.profile.localisation
        assert localisation is not None
        assert robot.app.service.status()["localisation"]["state"] == "waiting"
        world = robot.network.world
        assert isinstance(world, SemitrailerWorld)
        x, y, yaw = world.trailer_pose
        mounted = localisation.scanner
        eye = composed(Pose(x, y, yaw), Pose(mounted.x_m, mounted.y_m, math.radians(mounted.rotation_deg)))
        sent = [
            {"reflector": name, "bearing_deg": math.degrees(true_bearing(eye, (mark.x_m, mark.y_m)))}
            for name, mark in localisation.reflectors.items()
        ]
        told = await robot.call("localisation.bearings", bearings=sent, age_ms=0.0)
        assert (told["used"], told["rejected"], told["state"]) == (len(sent), 0, "fixed")
        assert error_m(robot) < 0.005
        await asyncio.sleep(2.0)
        assert robot.app.service.status()["localisation"]["state"] == "odometry"


@pytest.mark.parametrize("value", [[{"bearing": 1}], ["a"], [{"bearing_deg": "a"}], [{"bearing_deg": math.nan}]])
async def test_bearings_that_are_none_are_refused(value: list[object]) -> None:
    async with running_robot(lab()) as robot:
        with pytest.raises(UsageError, match=r"localisation\.bearings"):
            await robot.call("localisation.bearings", bearings=value, age_ms=0.0)


@pytest.mark.parametrize(
    ("robot", "more", "told"),
    [
        ("max2d", "  scanner: {on: trailer}", "there is no trailer"),
        ("turtle", "", "no vehicle with an odometry"),
        ("max2d", "  scanner: {on: roof}", "one of trailer, vehicle"),
    ],
)
def test_what_cannot_be_localised_is_named_with_file_and_line(tmp_path: Path, robot: str, more: str, told: str) -> None:
    marks = "{a: {x_m: 0, y_m: 1}, b: {x_m: 1, y_m: 1}, d: {x_m: 2, y_m: 0}}"
    text = (
        f"schema_version: 1\nextends: robots/{robot}\nlocalisation:\n  bearing_noise_deg: 0.1\n  reflectors: {marks}\n"
    )
    path = tmp_path / "lab1.yaml"
    path.write_text(text + more + "\n", encoding="utf-8")
    with pytest.raises(ConfigError, match=told):
        load(path)
