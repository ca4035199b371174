"""A fault leaves the last minute before it: frames, cycles and events, whole or not at all."""

from __future__ import annotations

import asyncio
import errno
import json
import os
from pathlib import Path
from typing import Any

import pytest

from canhelm.errors import CanhelmError
from daemon.runs.pictures import draw
from daemon.runs.store import DRAFT, EVENTS, FAULT, FRAMES, RECORDS, Run, RunStore, read_runs
from daemon.runs.table import read_table
from daemon.runtime.flight_recorder import KEPT_S, FlightRecorder, Slice
from drivers.bus.candump import parse_line
from vcan_tests.robot import Robot, running_robot

LONG = {"angle_deg": 0.0, "speed_m_s": 0.5, "duration_s": 30.0}


def faults(folder: Path) -> list[Run]:
    return [run for run in read_runs([folder]) if run.facts.get("kind") == FAULT]


def records(run: Run) -> list[dict[str, Any]]:
    return [json.loads(line) for line in (run.folder / RECORDS).read_text().splitlines()]


async def estop_while_driving(robot: Robot, **asked: Any) -> None:
    """A drive, and an emergency stop at speed; returns when the robot is at rest."""
    driving = asyncio.create_task(robot.call("drive.parallel", **(asked or LONG)))
    await robot.until(lambda: robot.speed_m_s > 0.45)
    robot.app.supervisor.estop("pressed by the test")
    with pytest.raises(CanhelmError):
        await driving


@pytest.fixture
async def fault(tmp_path: Path) -> Run:
    async with running_robot(runs=RunStore(tmp_path), expect_errors=True) as robot:
        await estop_while_driving(robot)
    return faults(tmp_path)[0]


async def test_a_fault_leaves_a_run_that_says_what_struck(fault: Run) -> None:
    assert (fault.facts["kind"], fault.facts["motion"], fault.facts["ended"]) == (FAULT, "drive.parallel", "estop")
    assert "pressed by the test" in fault.facts["message"]


async def test_the_fault_of_a_drive_is_newer_than_the_drive(fault: Run) -> None:
    drive, last = read_runs([fault.folder.parent])
    assert (last.number, last.begun < drive.when < last.when) == (fault.number, True)


async def test_the_last_record_has_what_was_measured_and_commanded_and_every_law_s_terms(fault: Run) -> None:
    last = records(fault)[-2]
    assert last["state"] == "active"
    assert max(last["measurement"]["wheel_speed_m_s"]) == pytest.approx(0.45, abs=0.05)
    assert len(last["command"]["wheel_speed_m_s"]) == 4
    assert (last["motions"][0]["kind"], last["motions"][0]["terms"]["phase"]) == ("drive.parallel", "driving")


async def test_what_a_motion_was_asked_for_stands_where_it_begins(fault: Run) -> None:
    (begun,) = [record["begins"] for record in records(fault) if "begins" in record]
    assert (begun["kind"], begun["asked"]) == ("drive.parallel", LONG)


async def test_the_events_before_it_are_kept(fault: Run) -> None:
    events = [json.loads(line) for line in (fault.folder / EVENTS).read_text().splitlines()]
    assert "pressed by the test" in events[-1]["message"]


async def test_the_frames_before_it_are_a_candump_log(fault: Run) -> None:
    frames = [parse_line(line) for line in (fault.folder / FRAMES).read_text().splitlines()]
    assert None not in frames
    assert {0x080, 0x201, 0x181} <= {frame.can_id for frame in frames if frame}


async def test_a_fault_is_drawn_as_a_run_is(fault: Run, tmp_path: Path) -> None:
    assert len(read_table(fault).time_s) == fault.facts["rows"]
    draw(fault, tmp_path / "fault.svg")
    assert "emergency stop" in (tmp_path / "fault.svg").read_text()


async def test_a_fault_while_nothing_moves_is_kept_as_well(tmp_path: Path) -> None:
    async with running_robot(runs=RunStore(tmp_path), expect_errors=True) as robot:
        robot.app.supervisor.estop("pressed by the test")
        await asyncio.sleep(0.1)
    assert faults(tmp_path)[0].facts["motion"] is None


async def test_a_stop_that_stays_latched_is_kept_once(tmp_path: Path) -> None:
    async with running_robot(runs=RunStore(tmp_path), expect_errors=True) as robot:
        await estop_while_driving(robot)
        robot.app.supervisor.estop("pressed again")
        await asyncio.sleep(2.0)
    assert len(faults(tmp_path)) == 1


async def test_people_are_told_which_run_it_is(tmp_path: Path) -> None:
    async with running_robot(runs=RunStore(tmp_path), expect_errors=True) as robot:
        await estop_while_driving(robot)
        told = robot.app.supervisor.log.last(20)
    assert [event["remedy"] for event in told if event["source"] == "runs"] == ["`canhelm runs show 2`"]


async def test_no_more_than_a_minute_is_kept(tmp_path: Path) -> None:
    async with running_robot(runs=RunStore(tmp_path), expect_errors=True) as robot:
        await asyncio.sleep(KEPT_S + 10.0)
        robot.app.supervisor.estop("pressed by the test")
        await asyncio.sleep(0.1)
    assert faults(tmp_path)[0].facts["duration_s"] == pytest.approx(KEPT_S, abs=1.1)


async def test_no_more_than_a_run_may_take_is_kept_and_it_is_the_newest(tmp_path: Path) -> None:
    store = RunStore(tmp_path, 8 * 500_000)
    async with running_robot(runs=store, expect_errors=True) as robot:
        await asyncio.sleep(20.0)
        robot.app.supervisor.estop("pressed by the test")
        await asyncio.sleep(0.1)
        (run,) = faults(tmp_path)
        end_s = records(run)[-1]["time_s"]
        assert asyncio.get_running_loop().time() - end_s < 0.2
    assert 200_000 < sum(map(len, kept_lines(run))) <= store.run_bytes


def kept_lines(run: Run) -> list[bytes]:
    return [(run.folder / name).read_bytes() for name in (RECORDS, FRAMES)]


async def test_a_slice_larger_than_all_room_is_let_go(tmp_path: Path) -> None:
    kept: list[Slice] = []
    async with running_robot() as robot:
        flight = FlightRecorder(robot.app.supervisor, 10, kept.extend)
        for second in range(3):
            flight.take_frames(b"x" * 100, float(second))
    assert kept == []


@pytest.mark.parametrize("step", ["fsync", "rename"])
async def test_a_crash_while_it_is_written_leaves_none_of_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, step: str
) -> None:
    def crash(*_: object) -> None:
        raise KeyboardInterrupt

    with monkeypatch.context() as patched:
        patched.setattr(os, step, crash)
        with pytest.raises(KeyboardInterrupt):
            RunStore(tmp_path).keep({RECORDS: [b"half"]})
    assert read_runs([tmp_path]) == []
    assert RunStore(tmp_path).keep({RECORDS: [b"who", b"le"]}).name == "0001"
    assert (tmp_path / "0001" / RECORDS).read_bytes() == b"whole"
    assert not (tmp_path / DRAFT).exists()


async def test_a_disk_that_is_full_at_a_fault_is_an_event(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(descriptor: int) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "fsync", full)
    async with running_robot(runs=RunStore(tmp_path), expect_errors=True) as robot:
        await estop_while_driving(robot)
        status = robot.app.service.status()
    assert "No space left" in status["runs"]["message"]
    assert [event["severity"] for event in status["events"] if event["source"] == "runs"] == ["warning"]
    assert status["state"] == "estop"
