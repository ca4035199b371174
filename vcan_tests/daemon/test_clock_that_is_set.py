"""The machine's clock is set while the daemon runs: by NTP on a board without a battery, by a person, or by a fault."""

from __future__ import annotations

import asyncio
import time
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

from daemon.runs.store import FRAMES, RunStore, read_runs
from daemon.runtime.clock import run_patient, run_virtual
from daemon.runtime.events import EventLog
from daemon.runtime.time_of_day import LATEST_S, epoch_s
from drivers.bus.candump import LogFrame, parse_line
from drivers.simulated.computer_trouble import ComputerTrouble
from vcan_tests.robot import Robot, running_robot

SET_S = 850_000_000.0
"""By how much the clock is set, from 1970 where virtual time begins."""
DRIVE = {"angle_deg": 0.0, "speed_m_s": 0.3, "duration_s": 0.5}


async def set_clock(robot: Robot, jump_s: float, **fields: Any) -> int:
    """A jump of the clock; the number of the fault."""
    return int((await robot.call("simulation.fault", kind="clock_jump", jump_s=jump_s, **fields))["fault"])


def frames(log: Path) -> list[LogFrame]:
    return [frame for line in log.read_text().splitlines() if (frame := parse_line(line))]


def begun_s(runs: Path) -> list[float]:
    """The dates of the runs in a folder."""
    return [run.facts["begun_unix_s"] for run in read_runs([runs])]


async def test_a_continuous_log_goes_on_evenly_by_the_clock_that_it_began_with(tmp_path: Path) -> None:
    async with running_robot(record=tmp_path / "bus.log") as robot:
        await set_clock(robot, SET_S)
        await robot.call("drive.parallel", **DRIVE)
    stamps_s = [frame.timestamp_s for frame in frames(tmp_path / "bus.log")]
    assert 0.0 < stamps_s[0] < stamps_s[-1] < 60.0
    assert max(after - before for before, after in pairwise(stamps_s)) < 0.1


async def test_a_motion_after_it_has_the_right_date(tmp_path: Path) -> None:
    async with running_robot(runs=RunStore(tmp_path)) as robot:
        await robot.call("drive.parallel", **DRIVE)
        await set_clock(robot, SET_S)
        await robot.call("drive.parallel", **DRIVE)
    first, second = read_runs([tmp_path])
    assert first.facts["begun_unix_s"] < 60.0
    assert SET_S < second.facts["begun_unix_s"] < SET_S + 60.0
    assert all(frame.timestamp_s > SET_S for frame in frames(second.folder / FRAMES))


async def test_a_motion_under_way_drives_on_and_its_run_goes_on_evenly(tmp_path: Path) -> None:
    async with running_robot(runs=RunStore(tmp_path)) as robot:
        driving = robot.begin("drive.parallel", **DRIVE)
        await robot.until(lambda: robot.speed_m_s > 0.1)
        await set_clock(robot, SET_S)
        assert "motion" in await driving
    (run,) = read_runs([tmp_path])
    assert all(frame.timestamp_s < 60.0 for frame in frames(run.folder / FRAMES))


def test_nothing_that_moves_feels_it(tmp_path: Path) -> None:
    async def drive(log: Path, jump_s: float) -> None:
        async with running_robot(record=log) as robot:
            driving = robot.begin("drive.parallel", **DRIVE)
            await robot.until(lambda: robot.speed_m_s > 0.1)
            await set_clock(robot, jump_s)
            await driving

    logs = tmp_path / "set.log", tmp_path / "left.log"
    for log, jump_s in zip(logs, (SET_S, 0.0), strict=True):
        run_virtual(drive(log, jump_s))
    assert logs[0].stat().st_size > 10_000
    assert logs[0].read_bytes() == logs[1].read_bytes()


async def test_a_fault_that_is_over_takes_its_jump_back(tmp_path: Path) -> None:
    async with running_robot(runs=RunStore(tmp_path)) as robot:
        await set_clock(robot, SET_S, for_s=0.2)
        await asyncio.sleep(0.3)
        await robot.call("drive.parallel", **DRIVE)
    assert begun_s(tmp_path)[0] < 60.0


async def test_of_two_jumps_one_that_is_cleared_leaves_the_other(tmp_path: Path) -> None:
    async with running_robot(runs=RunStore(tmp_path)) as robot:
        await set_clock(robot, SET_S)
        back = await set_clock(robot, -3600.0)
        await robot.call("drive.parallel", **DRIVE)
        await robot.call("simulation.clear_faults", fault=back)
        await robot.call("drive.parallel", **DRIVE)
    assert [round(begun - SET_S, -2) for begun in begun_s(tmp_path)] == [-3600.0, 0.0]


async def test_frames_that_somebody_asks_for_after_it_have_the_new_time() -> None:
    async with running_robot() as robot:
        await set_clock(robot, SET_S)
        answer = await robot.call("bus.frames")
    stamps_s = [frame.timestamp_s for line in answer["frames"] if (frame := parse_line(line))]
    assert SET_S < stamps_s[0] < SET_S + 60.0


@pytest.mark.parametrize(("jump_s", "shown_s"), [(-3600.0, 0.0), (0.0, 0.0), (5.0, 5.0), (1e11, LATEST_S)])
async def test_the_clock_is_set_no_farther_than_a_kernel_lets_anybody_set_it(jump_s: float, shown_s: float) -> None:
    trouble = ComputerTrouble()
    trouble.clock_jump_s = jump_s
    assert epoch_s(trouble) == shown_s


@pytest.mark.real_time
@pytest.mark.parametrize("jump_s", [3600.0, -3600.0])
async def test_a_jump_is_one_of_the_machines_clock(jump_s: float) -> None:
    trouble = ComputerTrouble()
    before_s = epoch_s(trouble)
    trouble.clock_jump_s = jump_s
    assert epoch_s(trouble) == pytest.approx(before_s + jump_s, abs=5.0)


@pytest.mark.real_time
async def test_the_epoch_follows_the_machines_clock(monkeypatch: pytest.MonkeyPatch) -> None:
    before_s, now_s = epoch_s(ComputerTrouble()), time.time()
    monkeypatch.setattr(time, "time", lambda: now_s + 3600.0)
    assert epoch_s(ComputerTrouble()) == pytest.approx(before_s + 3600.0, abs=5.0)


async def unix_s_of_an_event() -> float:
    """When the log of events says that something happens now."""
    log = EventLog()
    log.add("info", "test", "something happens")
    return float(log.events[0]["unix_s"])


def test_an_event_is_dated_by_the_machines_clock_and_on_virtual_time_by_the_loops() -> None:
    before_s = time.time()
    dated_s = run_patient(unix_s_of_an_event())
    assert before_s - 0.001 <= dated_s <= time.time() + 0.001
    assert run_virtual(unix_s_of_an_event()) == 0.0
