"""Every motion leaves a run: its files, its room, and a disk that fails."""

from __future__ import annotations

import asyncio
import csv
import errno
import json
import os
from itertools import groupby, pairwise
from pathlib import Path
from typing import Any

import pytest
import yaml

from canhelm.errors import CanhelmError, UsageError
from daemon.cli.doctor_status import status_findings
from daemon.runs import store as store_module
from daemon.runs.store import CYCLES, DRIVES, FRAMES, PROFILE, TERMS, Run, RunStore, choose, own_folder, read_runs
from daemon.runtime.cycle_rows import CycleRows
from drivers.bus.candump import parse_line
from profiles.loader import load
from vcan_tests.robot import Robot, running_robot

STRAIGHT = {"angle_deg": 0.0, "speed_m_s": 0.5, "duration_s": 1.0}


async def drive(folder: Path, method: str = "drive.parallel", limit_bytes: int = 10**9, **params: Any) -> Run:
    """One motion of a simulated robot; the last run that it leaves."""
    async with running_robot(runs=RunStore(folder, limit_bytes)) as robot:
        await robot.call(method, **(params or STRAIGHT))
    return read_runs([folder])[-1]


def table(run: Run) -> list[dict[str, str]]:
    with (run.folder / CYCLES).open() as file:
        return list(csv.DictReader(file))


async def test_a_motion_leaves_a_run_that_tells_what_was_asked_and_how_it_ended(tmp_path: Path) -> None:
    run = await drive(tmp_path)
    assert (run.number, run.robot, run.facts["vehicle"]) == (1, "max2d", "paired_steer")
    assert (run.facts["motion"], run.facts["asked"]) == ("drive.parallel", STRAIGHT)
    assert run.facts["ended"] == "done"
    assert run.facts["duration_s"] == pytest.approx(1.76, abs=0.2)


async def test_a_row_a_cycle_holds_commanded_and_measured_speeds(tmp_path: Path) -> None:
    rows = table(await drive(tmp_path))
    fastest = max(rows, key=lambda row: float(row["rear_left.commanded_m_s"]))
    times = [float(row["time_s"]) for row in rows]
    assert float(fastest["rear_left.commanded_m_s"]) == pytest.approx(0.5, abs=0.01)
    assert float(fastest["rear_left.speed_m_s"]) == pytest.approx(0.5, abs=0.02)
    assert all(later - earlier == pytest.approx(0.01, abs=1e-3) for earlier, later in pairwise(times))


async def test_the_last_row_is_where_the_robot_came_to_rest(tmp_path: Path) -> None:
    last = table(await drive(tmp_path))[-1]
    assert float(last["x_m"]) == pytest.approx(0.5, abs=0.01)


async def test_the_frames_of_the_motion_are_a_candump_log(tmp_path: Path) -> None:
    run = await drive(tmp_path)
    frames = [parse_line(line) for line in (run.folder / FRAMES).read_text().splitlines()]
    identifiers = {frame.can_id for frame in frames if frame}
    assert None not in frames
    assert {0x080, 0x201, 0x181} <= identifiers


async def test_the_terms_of_the_law_are_kept_step_by_step(tmp_path: Path) -> None:
    run = await drive(tmp_path)
    steps = [json.loads(line) for line in (run.folder / TERMS).read_text().splitlines()]
    phases = [phase for phase, _ in groupby(step["terms"]["phase"] for step in steps)]
    assert phases == ["enabling", "stopping", "driving", "stopping", "resting"]


async def test_a_motion_without_a_law_keeps_its_progress(tmp_path: Path) -> None:
    async with running_robot(runs=RunStore(tmp_path)) as robot:
        await robot.call("brake.engage", pair="all")
        await robot.call("motor.velocity", node="rear_left", wheel_speed_m_s=0.1, duration_s=0.5)
    run = read_runs([tmp_path])[0]
    steps = [json.loads(line) for line in (run.folder / TERMS).read_text().splitlines()]
    assert steps[10]["terms"]["target_velocity_rpm"] > 0


async def test_the_effective_profile_is_kept_and_can_be_used_again(tmp_path: Path) -> None:
    run = await drive(tmp_path)
    assert load(str(run.folder / PROFILE)).profile == load("max2d").profile


async def test_parameters_are_kept_as_they_were_read_back(tmp_path: Path) -> None:
    drives = yaml.safe_load(((await drive(tmp_path)).folder / DRIVES).read_text())
    assert drives["rear_left"]["0x2003/1 software_version"] == 0x2011
    assert drives["rear_left"]["0x6410/1 continuous_current_limit"] > 0


async def test_a_stopped_motion_says_so(tmp_path: Path) -> None:
    async with running_robot(runs=RunStore(tmp_path)) as robot:
        asked = asyncio.create_task(robot.call("drive.parallel", angle_deg=0.0, speed_m_s=0.5, duration_s=10.0))
        await robot.until(lambda: robot.speed_m_s > 0.4)
        await robot.call("motion.stop", motion="1")
        with pytest.raises(CanhelmError):
            await asked
    assert read_runs([tmp_path])[0].facts["ended"] == "stopped"


async def test_a_daemon_that_goes_down_ends_its_runs(tmp_path: Path) -> None:
    async with running_robot(runs=RunStore(tmp_path)) as robot:
        asked = asyncio.create_task(robot.call("drive.parallel", angle_deg=0.0, speed_m_s=0.5, duration_s=10.0))
        await robot.until(lambda: robot.speed_m_s > 0.4)
    with pytest.raises(CanhelmError):
        await asked
    assert "going down" in read_runs([tmp_path])[0].facts["message"]


async def test_the_oldest_runs_make_room(tmp_path: Path) -> None:
    async with running_robot(runs=RunStore(tmp_path, limit_bytes=2_000_000)) as robot:
        for _ in range(12):
            await robot.call("drive.parallel", **STRAIGHT)
    runs = read_runs([tmp_path])
    assert runs[-1].number == 12
    assert runs[0].number > 1
    assert sum(run.size_bytes for run in runs) <= 2_000_000


async def test_a_long_motion_goes_on_in_further_runs(tmp_path: Path) -> None:
    run = await drive(tmp_path, limit_bytes=3_000_000, angle_deg=0.0, speed_m_s=0.2, duration_s=8.0)
    first = read_runs([tmp_path])[0]
    assert (first.facts["ended"], first.facts["part"]) == ("continued", 1)
    assert (run.facts["ended"], run.facts["part"]) == ("done", run.number)


async def refuse_to_write(robot: Robot, monkeypatch: pytest.MonkeyPatch, number: int = errno.ENOSPC) -> dict[str, Any]:
    """A motion while the disk is full, or fails otherwise; its result."""

    def full(store: RunStore) -> Path:
        raise OSError(number, os.strerror(number))

    with monkeypatch.context() as patched:
        patched.setattr(RunStore, "begin", full)
        return await robot.call("drive.parallel", **STRAIGHT)


async def test_a_full_disk_does_not_stop_the_robot(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    async with running_robot(runs=RunStore(tmp_path)) as robot:
        result = await refuse_to_write(robot, monkeypatch)
    assert result["steering_error_deg"] == 0.0


async def test_a_full_disk_is_told_once_with_what_mends_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    async with running_robot(runs=RunStore(tmp_path)) as robot:
        await refuse_to_write(robot, monkeypatch)
        told = [event for event in robot.app.supervisor.log.events if event["source"] == "runs"]
    assert len(told) == 1
    assert (told[0]["severity"], "No space" in told[0]["message"]) == ("warning", True)
    assert "canhelm runs delete" in told[0]["remedy"]


@pytest.mark.parametrize("number", [errno.EROFS, errno.EACCES])
async def test_a_folder_that_cannot_be_written_is_told_with_the_option_for_another(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, number: int
) -> None:
    async with running_robot(runs=RunStore(tmp_path)) as robot:
        await refuse_to_write(robot, monkeypatch, number)
        status = robot.app.service.status()
    (event,) = (event for event in status["events"] if event["source"] == "runs")
    found = next(found for found in status_findings(status, status) if found.check == "runs")
    for told in (event["remedy"], found.mend):
        assert "canhelm run --runs DIR" in told
        assert "room" not in told


async def test_a_defect_of_the_recording_does_not_stop_the_robot(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def defect(rows: CycleRows) -> list[object]:
        raise ZeroDivisionError

    monkeypatch.setattr(CycleRows, "values", defect)
    async with running_robot(runs=RunStore(tmp_path), expect_errors=True) as robot:
        result = await robot.call("drive.parallel", **STRAIGHT)
        told = robot.app.service.status()["runs"]["message"]
    assert result["steering_error_deg"] == 0.0
    assert "failed inside the daemon" in told


async def test_recording_goes_on_with_the_next_motion(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    async with running_robot(runs=RunStore(tmp_path)) as robot:
        await refuse_to_write(robot, monkeypatch)
        await robot.call("drive.parallel", **STRAIGHT)
        status = robot.app.service.status()["runs"]
    assert (status["last"], status["message"], status["remedy"]) == ("0001", "", "")


def test_a_disk_without_its_reserve_takes_no_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(store_module, "RESERVE_BYTES", 10**18)
    (tmp_path / "0001").mkdir()
    with pytest.raises(OSError, match="No space"):
        RunStore(tmp_path).begin()
    assert RunStore(tmp_path).folders() == []


def test_a_small_disk_that_is_read_only_is_not_called_full(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    closed = os.statvfs_result((4096, 4096, 100, 0, 0, 0, 0, 0, os.ST_RDONLY, 255))
    monkeypatch.setattr(os, "statvfs", lambda path: closed)
    with pytest.raises(OSError, match="Read-only file system"):
        RunStore(tmp_path).begin()


async def test_a_move_that_a_brick_carries_out_itself_leaves_its_progress(tmp_path: Path) -> None:
    async with running_robot(load("nxt").profile, runs=RunStore(tmp_path)) as robot:
        await robot.call("nxt.line", distance_m=0.2)
    steps = [json.loads(line) for line in (tmp_path / "0001" / TERMS).read_text().splitlines()]
    assert max(step["terms"]["x_m"] for step in steps) == pytest.approx(0.2, abs=0.05)


async def test_a_robot_without_can_leaves_no_log_of_frames(tmp_path: Path) -> None:
    async with running_robot(load("nxt").profile, runs=RunStore(tmp_path)) as robot:
        await robot.call("nxt.line", distance_m=0.1)
    assert (tmp_path / "0001" / CYCLES).exists()
    assert not (tmp_path / "0001" / FRAMES).exists()


def test_a_service_keeps_its_runs_with_its_state() -> None:
    assert own_folder("lab1", {"STATE_DIRECTORY": "/var/lib/canhelm/lab1"}) == Path("/var/lib/canhelm/lab1/runs")


def test_a_person_keeps_runs_in_the_own_state_folder() -> None:
    assert own_folder("lab1", {"XDG_STATE_HOME": "/home/a/state"}) == Path("/home/a/state/canhelm/lab1/runs")


def test_a_number_that_two_robots_have_is_asked_back(tmp_path: Path) -> None:
    runs = [Run(1, tmp_path, {"robot": "lab1"}), Run(1, tmp_path, {"robot": "lab2"})]
    with pytest.raises(UsageError, match="several robots have a run 1: lab1, lab2"):
        choose(runs, "1")


@pytest.mark.real_time
async def test_in_real_time_a_thread_writes(tmp_path: Path) -> None:
    run = await drive(tmp_path, angle_deg=0.0, speed_m_s=0.1, duration_s=0.3)
    assert run.facts["ended"] == "done"
    assert run.facts["begun"].startswith("20")
    assert len(table(run)) == run.facts["rows"]
