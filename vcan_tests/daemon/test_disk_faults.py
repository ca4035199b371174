"""Faults of the disk that a simulated robot's daemon records on: it is told, nothing that can be kept is lost."""

from __future__ import annotations

import asyncio
from pathlib import Path
from typing import Any

import pytest

from daemon.runs.store import RunStore, read_runs
from daemon.runtime import disk
from drivers.bus.candump import parse_line
from vcan_tests.robot import Robot, running_robot

DRIVE = {"angle_deg": 0.0, "speed_m_s": 0.3, "duration_s": 1.0}


def stamps_s(log: Path) -> list[float]:
    return [frame.timestamp_s for line in log.read_text().splitlines() if (frame := parse_line(line))]


def recording(robot: Robot) -> dict[str, Any]:
    status: dict[str, Any] = robot.app.service.status()["recording"]
    return status


async def test_a_full_disk_is_told_and_recording_goes_on_when_there_is_room_again(tmp_path: Path) -> None:
    log = tmp_path / "bus.log"
    async with running_robot(record=log, expect_errors=True) as robot:
        await robot.call("simulation.fault", kind="disk_full", for_s=3.0)
        await robot.call("drive.parallel", **DRIVE)
        assert recording(robot)["failing"]
        told = [event["message"] for event in robot.app.supervisor.log.events if event["source"] == "recording"]
        assert told == [f"cannot write to the log {log}: No space left on device"]
        await asyncio.sleep(4.0)
        assert (recording(robot)["failing"], recording(robot)["lost"]) == (False, 0)
        seen = robot.app.recorder
    assert seen is not None
    assert len(stamps_s(log)) == seen.frames


async def test_a_full_disk_ends_the_run_and_not_the_motion(tmp_path: Path) -> None:
    async with running_robot(runs=RunStore(tmp_path), expect_errors=True) as robot:
        driving = robot.begin("drive.parallel", **DRIVE)
        await robot.until(lambda: robot.speed_m_s > 0.2)
        await robot.call("simulation.fault", kind="disk_full")
        assert "motion" in await driving
        assert "No space left on device" in robot.app.service.status()["runs"]["message"]
        await robot.call("simulation.clear_faults")
        await robot.call("drive.parallel", **DRIVE)
        assert robot.app.service.status()["runs"]["message"] == ""
    assert read_runs([tmp_path])[-1].facts["ended"] == "done"


async def test_a_slow_disk_gets_every_frame_later_and_in_order(tmp_path: Path) -> None:
    log = tmp_path / "bus.log"
    async with running_robot(record=log) as robot:
        await robot.call("simulation.fault", kind="disk_slow", delay_s=0.5)
        before = len(stamps_s(log))
        await asyncio.sleep(0.4)
        assert len(stamps_s(log)) == before
        await asyncio.sleep(0.2)
        assert len(stamps_s(log)) > before
        await robot.call("drive.parallel", **DRIVE)
        assert robot.app.cycle.counters.late_cycles == 0
        seen = robot.app.recorder
    assert seen is not None
    assert stamps_s(log) == sorted(stamps_s(log))
    assert (len(stamps_s(log)), seen.lost) == (seen.frames, 0)


async def test_what_waits_too_long_for_a_slow_disk_is_counted_as_lost(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(disk, "PENDING_LIMIT_BYTES", 10_000)
    async with running_robot(record=tmp_path / "bus.log") as robot:
        await robot.call("simulation.fault", kind="disk_slow", delay_s=2.0, for_s=5.0)
        await robot.call("drive.parallel", **DRIVE)
        assert recording(robot)["lost"] > 0
        seen = robot.app.recorder
    assert seen is not None
    assert len(stamps_s(tmp_path / "bus.log")) == seen.frames - seen.lost
