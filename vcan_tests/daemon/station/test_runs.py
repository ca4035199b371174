"""The runs that the page lists, downloads and shows: names that lead nowhere else, pictures by another process."""

from __future__ import annotations

import asyncio
import os
from pathlib import Path
from typing import Any

import pytest

from canhelm.errors import ConfigError, UsageError
from daemon.runs.store import make_yaml
from daemon.station import runs
from daemon.station.robots import Robot

pytestmark = pytest.mark.real_time

HEAD = "time_s,x_m,y_m,yaw_deg,wheel.commanded_m_s,wheel.speed_m_s,wheel.travel_m,wheel.current_a,limits"
ROWS = [f"{step / 50},{step / 100},0,0,0.5,0.5,{step / 100},0.1," for step in range(50)]


def keep(robot: Robot, number: int, *, of: str = "max2d", rows: bool = True, **facts: Any) -> Path:
    folder = robot.folder / "runs" / f"{number:04d}"
    folder.mkdir(parents=True)
    begun = f"2026-11-20T08:00:{number:02d}.000+00:00"
    known = {"robot": of, "begun": begun, "kind": "motion", "motion": "drive.turn", "ended": "done", "duration_s": 1.0}
    (folder / "run.yaml").write_bytes(make_yaml({**known, **facts}))
    (folder / "profile.yaml").write_text("{}\n")
    if rows:
        (folder / "cycles.csv").write_text("\n".join([HEAD, *ROWS, ""]))
    return folder


@pytest.fixture
def robot(tmp_path: Path) -> Robot:
    return Robot("max2d", tmp_path / "max2d.sock", tmp_path / "max2d")


async def listed(robot: Robot) -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = (await runs.list_runs(robot, {}))["runs"]
    return found


async def test_a_run_is_listed_with_what_people_ask_for_first(robot: Robot) -> None:
    keep(robot, 3)
    assert await listed(robot) == [
        {
            "run": 3,
            "begun": "2026-11-20T08:00:03.000+00:00",
            "struck": None,
            "method": "drive.turn",
            "ended": "done",
            "message": "",
            "under_way": False,
            "duration_s": 1.0,
            "files": ["cycles.csv", "profile.yaml", "run.yaml"],
        }
    ]


async def test_what_a_fault_left_says_so_and_when_it_struck(robot: Robot) -> None:
    struck = "2026-11-20T08:01:01.000+00:00"
    keep(robot, 1, kind="fault", motion="drive.path", struck=struck)
    (run,) = await listed(robot)
    assert (run["method"], run["struck"]) == ("fault in drive.path", struck)
    assert run["begun"] == "2026-11-20T08:00:01.000+00:00"


async def test_a_run_that_no_daemon_writes_any_more_is_not_under_way(
    robot: Robot, monkeypatch: pytest.MonkeyPatch
) -> None:
    keep(robot, 1, ended=None)
    keep(robot, 2, ended=None)

    async def told(robot: Robot) -> dict[str, Any]:
        return {"folder": str(robot.folder / "runs"), "under_way": [2]}

    assert [run["under_way"] for run in await listed(robot)] == [False, False]
    monkeypatch.setattr(runs, "_told_of_runs", told)
    assert [run["under_way"] for run in await listed(robot)] == [False, True]


async def test_runs_of_other_robots_are_neither_listed_nor_opened(robot: Robot) -> None:
    keep(robot, 1, of="turtle")
    assert await listed(robot) == []
    with pytest.raises(UsageError, match="has no run"):
        await runs.run_file(robot, "1", "run.yaml")


async def test_a_run_under_way_is_listed_again_once_it_has_ended(robot: Robot) -> None:
    folder = keep(robot, 1, ended=None)
    assert [run["ended"] for run in await listed(robot)] == [None]
    (folder / "run.yaml").write_bytes(make_yaml({"robot": "max2d", "ended": "stopped"}))
    os.utime(folder / "run.yaml", (2e9, 2e9))  # later than before, whatever a clock can tell
    assert [run["ended"] for run in await listed(robot)] == ["stopped"]


async def test_where_nothing_was_driven_the_list_is_empty(robot: Robot) -> None:
    assert await listed(robot) == []


async def test_the_newest_runs_are_listed(robot: Robot, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(runs, "MAX_LISTED", 2)
    for number in (1, 2, 3):
        keep(robot, number)
    assert [run["run"] for run in await listed(robot)] == [2, 3]


async def test_a_file_of_a_run_is_found_by_its_number_and_name(robot: Robot) -> None:
    folder = keep(robot, 7)
    assert await runs.run_file(robot, "7", "cycles.csv") == folder / "cycles.csv"
    assert await runs.run_file(robot, "0007", "run.yaml") == folder / "run.yaml"


@pytest.mark.parametrize("run", ["", "..", "7/..", "-7", "8", "²", "7" * 5000])
async def test_a_run_that_leads_elsewhere_is_refused(robot: Robot, run: str) -> None:
    keep(robot, 7)
    with pytest.raises(UsageError, match="has no run"):
        await runs.run_file(robot, run, "run.yaml")


@pytest.mark.parametrize("name", ["", "..", "../7/run.yaml", "/etc/passwd", "run.yaml\0", "secret", "folder", "none"])
async def test_a_file_that_leads_elsewhere_is_refused(robot: Robot, tmp_path: Path, name: str) -> None:
    folder = keep(robot, 7)
    (tmp_path / "outside").write_text("secret")
    (folder / "secret").symlink_to(tmp_path / "outside")
    (folder / "folder").mkdir()
    with pytest.raises(UsageError, match="has no file"):
        await runs.run_file(robot, "7", name)


async def test_a_folder_that_is_a_link_is_no_run(robot: Robot, tmp_path: Path) -> None:
    keep(robot, 7)
    (robot.folder / "runs" / "0008").symlink_to(robot.folder / "runs" / "0007")
    assert [run["run"] for run in await listed(robot)] == [7]


async def test_the_picture_of_a_run_is_drawn_while_the_loop_goes_on(robot: Robot) -> None:
    pytest.importorskip("matplotlib", reason="the extra plot")
    keep(robot, 7)
    ticks = 0

    async def tick() -> None:
        nonlocal ticks
        while True:
            await asyncio.sleep(0.01)
            ticks += 1

    ticking = asyncio.create_task(tick())
    picture = await runs.draw(robot, "7")
    ticking.cancel()
    assert picture.startswith(b"\x89PNG")
    assert ticks > 10


async def test_a_run_without_rows_says_why_there_is_no_picture(robot: Robot) -> None:
    keep(robot, 7, rows=False)
    with pytest.raises(ConfigError, match=r"cycles\.csv cannot be read"):
        await runs.draw(robot, "7")
