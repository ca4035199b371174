"""The list of runs: what their times are, on a clock of 24 hours, and which of them are under way."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from daemon.runs.store import make_yaml
from vcan_tests.station.browser import DESKTOP, Operator
from vcan_tests.station.conftest import Meet
from vcan_tests.station.processes import Fleet, Robot

pytestmark = pytest.mark.station

ROBOTS = ("semitrailer",)
RUNS = "[data-panel=runs]"
BEGUN, STRUCK = "2026-11-20T20:00:00.000+00:00", "2026-11-20T20:01:00.000+00:00"
Keep = Callable[..., None]


@pytest.fixture
def keep(fleet: Fleet, robot: Robot) -> Keep:
    """Leaves a run as a daemon of before has left it."""

    def keep(number: int, **facts: Any) -> None:
        folder = fleet.folder / "state" / "canhelm" / robot.name / "runs" / f"{number:04d}"
        folder.mkdir(parents=True, exist_ok=True)
        known = {"robot": robot.name, "begun": BEGUN, "kind": "motion", "motion": "drive.turn"}
        (folder / "run.yaml").write_bytes(make_yaml({**known, **facts}))

    return keep


def sees_run(operator: Operator, number: int, words: str) -> None:
    """Wait until the row of a run tells this."""
    operator.sees(f"{RUNS} tr:has(button[aria-label='Open run {number}'])", words)


@pytest.fixture
def reader(meet: Meet, robot: Robot) -> Operator:
    """Somebody in London whose browser would tell the time in twelve hours."""
    reader = meet(**DESKTOP, locale="en-US", timezone_id="Europe/London")
    reader.open(robot.name)
    return reader


def test_a_motions_time_is_its_begin_on_a_clock_of_24_hours(reader: Operator, keep: Keep) -> None:
    keep(1, ended="done", duration_s=2.0)
    reader.go_to("runs")
    sees_run(reader, 1, r"begun Nov 20, 2026, 20:00:00\s+drive\.turn\s+done")


def test_a_faults_time_is_when_it_struck_and_says_so(reader: Operator, keep: Keep) -> None:
    keep(2, kind="fault", struck=STRUCK, ended="fault", duration_s=60.0)
    reader.go_to("runs")
    sees_run(reader, 2, r"fault struck Nov 20, 2026, 20:01:00\s+fault in drive\.turn")


def test_a_run_whose_daemon_was_killed_ended_without_a_word(reader: Operator, keep: Keep) -> None:
    keep(3)
    reader.go_to("runs")
    sees_run(reader, 3, "ended without a word: its daemon was killed")


def test_a_run_of_a_motion_that_goes_on_is_under_way(reader: Operator, robot: Robot) -> None:
    robot.call("drive.path", path={"pieces": [{"line_m": 3.0}]}, wait=False)
    robot.comes_to(lambda status: status["runs"]["under_way"])
    (number,) = robot.status()["runs"]["under_way"]
    reader.go_to("runs")
    sees_run(reader, number, "under way")
    robot.call("stop")
    robot.comes_to(lambda status: not status["runs"]["under_way"])
    reader.page.locator(RUNS).get_by_role("button", name="Reload").click()
    sees_run(reader, number, "stopped")


def test_runs_that_cannot_be_written_are_told_with_what_mends_it(reader: Operator, fleet: Fleet) -> None:
    robot = Robot(fleet.folder, "max2d", ("--runs", "/proc/runs"))
    try:
        robot.call("drive.parallel", angle_deg=0.0, speed_m_s=0.1, duration_s=0.2)
        robot.comes_to(lambda status: status["runs"]["message"])
        reader.choose("max2d")
        reader.go_to("runs")
        reader.sees(RUNS, "runs cannot be written to /proc/runs.*canhelm run --runs DIR")
        reader.catches_up()
        assert "No runs yet" not in reader.text(RUNS)
        reader.choose("semitrailer")
        reader.until(lambda: "cannot be written" not in reader.text(RUNS), lambda: "told of the other robot, too")
    finally:
        robot.end()
