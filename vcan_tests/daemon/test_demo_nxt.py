"""The demo of the NXT robot: moves open loop and by feedback, the report's call, pictures."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from canhelm.errors import UsageError
from daemon import demo_nxt
from daemon.cli.main import main
from daemon.demo_nxt import FIGURES, NxtResult, report_calls
from daemon.runtime.clock import run_virtual
from profiles.loader import load


@pytest.fixture(scope="module")
def driven() -> list[NxtResult]:
    robot = load("nxt").profile
    return [run_virtual(demo_nxt.drive(robot, figure, 0, lambda _: None)) for figure in FIGURES]


def test_feedback_ends_within_half_a_centimetre_and_three_degrees(driven: list[NxtResult]) -> None:
    misses = [result.feedback.miss for result in driven]
    assert all(miss["error_cm"] < 0.5 and abs(miss["heading_error_deg"]) < 3.0 for miss in misses), misses


def test_open_loop_the_outer_wheel_overshoots_as_the_report_observed(driven: list[NxtResult]) -> None:
    assert all(20 < max(result.open_loop.miss["tacho_error_deg"]) < 60 for result in driven)


def test_feedback_ends_nearer_than_tacho_limits(driven: list[NxtResult]) -> None:
    assert all(result.feedback.miss["error_cm"] < result.open_loop.miss["error_cm"] for result in driven)


def test_the_reports_call_arrives_with_the_short_step_and_never_with_the_long_one() -> None:
    short, long = report_calls()
    assert (short.run.reached, short.numbers["duration_s"]) == (True, 1.45)
    assert not long.run.reached


def test_another_robot_is_refused() -> None:
    with pytest.raises(UsageError, match="no two wheels"):
        run_virtual(demo_nxt.drive(load("max2d").profile, FIGURES[0], 0, lambda _: None))


def test_the_command_tells_every_figure_and_draws(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["demo", "--figure", "nxt", "--virtual-time", "--json", "--out", str(tmp_path / "out")]) == 0
    rows = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert len(rows) == len(FIGURES) + 2
    pictures = {"figure-nxt-moves.png", "figure-nxt-call-0.01s.png", "figure-nxt-call-1s.png"}
    assert {path.name for path in (tmp_path / "out").iterdir()} == pictures
