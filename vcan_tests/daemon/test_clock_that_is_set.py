"""The machine's clock is set while the daemon runs: by NTP on a board without a battery, or by a person."""

from __future__ import annotations

import time
from itertools import pairwise
from pathlib import Path

import pytest

from daemon.runs.store import FRAMES, RunStore, read_runs
from daemon.runtime.time_of_day import epoch_s
from drivers.bus.candump import LogFrame, parse_line
from vcan_tests.robot import running_robot

BEFORE_S, SET_S = 1_000.0, 1_700_000_000.0
"""What the clock tells as the daemon begins, and what it is set to."""
DRIVE = {"angle_deg": 0.0, "speed_m_s": 0.3, "duration_s": 0.5}


class WallClock:
    """The machine's clock in place of that of the tests, beside the virtual loop's own time.

    Attributes:
        epoch_s: what it shows when the loop's clock shows zero.
    """

    def __init__(self) -> None:
        self.epoch_s = BEFORE_S


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> WallClock:
    clock = WallClock()
    for room in ("recorder", "run_recorder"):
        monkeypatch.setattr(f"daemon.runtime.{room}.epoch_s", lambda: clock.epoch_s)
    return clock


def frames(log: Path) -> list[LogFrame]:
    return [frame for line in log.read_text().splitlines() if (frame := parse_line(line))]


async def test_a_continuous_log_goes_on_evenly_by_the_clock_that_it_began_with(
    tmp_path: Path, clock: WallClock
) -> None:
    async with running_robot(record=tmp_path / "bus.log") as robot:
        clock.epoch_s = SET_S
        await robot.call("drive.parallel", **DRIVE)
    stamps_s = [frame.timestamp_s for frame in frames(tmp_path / "bus.log")]
    assert BEFORE_S < stamps_s[0] < stamps_s[-1] < BEFORE_S + 60.0
    assert max(after - before for before, after in pairwise(stamps_s)) < 0.1


async def test_a_motion_after_it_has_the_right_date(tmp_path: Path, clock: WallClock) -> None:
    async with running_robot(runs=RunStore(tmp_path)) as robot:
        await robot.call("drive.parallel", **DRIVE)
        clock.epoch_s = SET_S
        await robot.call("drive.parallel", **DRIVE)
    first, second = read_runs([tmp_path])
    assert first.facts["begun_unix_s"] < BEFORE_S + 60.0
    assert SET_S < second.facts["begun_unix_s"] < SET_S + 60.0
    assert all(frame.timestamp_s > SET_S for frame in frames(second.folder / FRAMES))


async def test_a_motion_under_way_drives_on_and_its_run_goes_on_evenly(tmp_path: Path, clock: WallClock) -> None:
    async with running_robot(runs=RunStore(tmp_path)) as robot:
        driving = robot.begin("drive.parallel", **DRIVE)
        await robot.until(lambda: robot.speed_m_s > 0.1)
        clock.epoch_s = SET_S
        assert "motion" in await driving
    (run,) = read_runs([tmp_path])
    assert all(frame.timestamp_s < BEFORE_S + 60.0 for frame in frames(run.folder / FRAMES))


@pytest.mark.real_time
async def test_the_epoch_follows_the_machines_clock(monkeypatch: pytest.MonkeyPatch) -> None:
    before_s, now_s = epoch_s(), time.time()
    monkeypatch.setattr(time, "time", lambda: now_s + 3600.0)
    assert epoch_s() == pytest.approx(before_s + 3600.0, abs=5.0)
