"""The station notes where a robot is driven, and makes a path of it, whichever pages come and go."""

from __future__ import annotations

import asyncio
import math
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import msgspec
import pytest

from canhelm.errors import DaemonNotRunning, Refused, UsageError
from daemon.loops.odometry import Pose
from daemon.station import paths, recording
from daemon.station.recording import MAX_POSES, Recording
from daemon.station.robots import Robot as Offered
from profiles.loader import load
from vcan_tests.robot import Robot, running_robot

pytestmark = pytest.mark.real_time


PROFILE = load("semitrailer").profile
PATIENT = msgspec.structs.replace(
    PROFILE, network=msgspec.structs.replace(PROFILE.network, guard_time_ms=1000, life_time_factor=4)
)
"""Its drives forgive a machine that has other things to do."""


@asynccontextmanager
async def offered(folder: Path) -> AsyncIterator[tuple[Offered, Robot]]:
    socket = folder / "semitrailer.sock"
    async with running_robot(PATIENT, socket=socket) as robot:
        yield Offered("semitrailer", socket, folder / "semitrailer"), robot


async def driven_m(robot: Robot) -> float:
    """Drive ahead; how far it went, once that was noted."""
    assert robot.app.vehicle.place is not None
    before_m = robot.app.vehicle.place.x_m
    await robot.call("drive.path", path={"pieces": [{"line_m": 0.5}]})
    await asyncio.sleep(0.3)
    return robot.app.vehicle.place.x_m - before_m


async def stop(station_robot: Offered, *, keep: bool = False) -> dict[str, Any]:
    return await recording.stop(station_robot, {"keep": keep})


async def test_a_driven_way_becomes_a_path(tmp_path: Path) -> None:
    async with offered(tmp_path) as (here, robot):
        await recording.start(here, {})
        way_m = await driven_m(robot)
        told = await stop(here)
    assert told["length_m"] == pytest.approx(way_m, abs=0.03)
    assert told["length_m"] > 0.3
    assert told["pieces"] == len(told["path"]["pieces"])
    assert told["trouble"] == ""


async def test_another_page_that_begins_a_recording_goes_on_with_the_one_under_way(tmp_path: Path) -> None:
    async with offered(tmp_path) as (here, robot):
        await recording.start(here, {})
        way_m = await driven_m(robot)
        again = await recording.start(here, {})
        assert again["poses"] > 5
        assert (await stop(here))["length_m"] == pytest.approx(way_m, abs=0.03)


async def test_pages_that_begin_at_once_have_one_recording(tmp_path: Path) -> None:
    async with offered(tmp_path) as (here, _):
        await asyncio.gather(*(recording.start(here, {}) for _ in range(3)))
        listening = [task for task in asyncio.all_tasks() if task.get_name() == "recording of semitrailer"]
        assert len(listening) == 1
        with pytest.raises(UsageError, match="hardly moved"):
            await stop(here)
        assert (await recording.look(here, {})) == {"recording": False, "poses": 0}


async def test_a_kept_one_is_among_the_paths(tmp_path: Path) -> None:
    async with offered(tmp_path) as (here, robot):
        await recording.start(here, {})
        await driven_m(robot)
        told = await stop(here, keep=True)
    assert [path["name"] for path in (await paths.list_paths(here, {}))["paths"]] == [told["name"]]


async def test_what_was_noted_before_the_daemon_was_lost_is_kept_and_the_loss_told(tmp_path: Path) -> None:
    async with offered(tmp_path) as (here, robot):
        await recording.start(here, {})
        way_m = await driven_m(robot)
        assert robot.app.server is not None
        await robot.app.server.close()
        await asyncio.sleep(0.1)
        told = await stop(here)
    assert told["length_m"] == pytest.approx(way_m, abs=0.03)
    assert told["trouble"]


async def test_nothing_that_is_recorded_cannot_be_ended(tmp_path: Path) -> None:
    with pytest.raises(Refused, match="nothing is being recorded"):
        await stop(Offered("turtle", tmp_path / "turtle.sock", tmp_path))


async def test_without_a_daemon_nothing_begins(tmp_path: Path) -> None:
    here = Offered("turtle", tmp_path / "turtle.sock", tmp_path)
    with pytest.raises(DaemonNotRunning):
        await recording.start(here, {})
    assert (await recording.look(here, {}))["recording"] is False


def test_a_robot_that_rests_fills_nothing(tmp_path: Path) -> None:
    noted = Recording(Offered("turtle", tmp_path, tmp_path))
    for _ in range(100):
        noted.note({"pose": {"x_m": 1.0, "y_m": 0.001, "yaw_deg": 0.2}})
    assert len(noted.poses) == 1


def test_a_trailer_is_noted_beside_its_truck(tmp_path: Path) -> None:
    noted = Recording(Offered("semitrailer", tmp_path, tmp_path))
    noted.note(
        {
            "pose": {"x_m": 1.0, "y_m": 0.0, "yaw_deg": 0.0},
            "trailer": {"x_m": 0.4, "y_m": 0.0, "yaw_deg": 90.0},
        }
    )
    assert noted.poses == [(Pose(1.0, 0.0, 0.0), Pose(0.4, 0.0, math.pi / 2))]


def test_a_way_without_end_is_noted_up_to_a_bound(tmp_path: Path) -> None:
    noted = Recording(Offered("turtle", tmp_path, tmp_path))
    for step in range(MAX_POSES + 5):
        noted.note({"pose": {"x_m": 0.02 * step, "y_m": 0.0, "yaw_deg": 0.0}})
    assert len(noted.poses) == MAX_POSES
    assert noted.trouble is not None


def test_drives_without_a_vehicle_have_no_way(tmp_path: Path) -> None:
    with pytest.raises(Refused, match="does not know where it is"):
        Recording(Offered("bench", tmp_path, tmp_path)).note({"pose": None})
