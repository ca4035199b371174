"""The Turtle's demo: what its report says of its simulations, over the simulated bus; ice with and without the loop."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import pytest

from canhelm.errors import UsageError
from daemon import demo_turtle
from daemon.cli.main import main
from daemon.demo_turtle import FIGURES, TurtleResult
from daemon.runtime.clock import run_virtual
from profiles.loader import load


def drive(identity: str, seed: int = 1, record: Path | None = None) -> TurtleResult:
    (figure,) = (entry for entry in FIGURES if entry.identity == identity)
    return run_virtual(demo_turtle.drive(load("turtle").profile, figure, seed, record, lambda _: None))


@pytest.fixture(scope="module")
def driven() -> dict[str, TurtleResult]:
    return {figure.identity: drive(figure.identity) for figure in FIGURES}


def achieved(driven: dict[str, TurtleResult], identity: str) -> dict[str, Any]:
    numbers: dict[str, Any] = driven[identity].numbers["achieved"]
    return numbers


@pytest.mark.parametrize("identity", ["7.3", "7.4", "7.6", "7.7"])
def test_the_robot_ends_where_the_planner_leads_it_and_no_cycle_is_late(
    driven: dict[str, TurtleResult], identity: str
) -> None:
    """The published planner leaves the position alone in the last 5 mm; the robot's wheels creep a little."""
    result = driven[identity]
    end = achieved(driven, identity)
    assert math.dist((end["end_x_m"], end["end_y_m"]), result.figure.goal_m) < 0.015
    assert result.numbers["late_cycles"] == 0


def test_without_error_the_safety_factor_stays_at_1(driven: dict[str, TurtleResult]) -> None:
    assert achieved(driven, "7.3")["least_safety_factor"] == 1.0
    assert achieved(driven, "7.3")["duration_s"] == pytest.approx(3.0, abs=0.3)


def test_the_commanded_acceleration_has_the_reports_peak(driven: dict[str, TurtleResult]) -> None:
    assert achieved(driven, "7.3")["largest_acceleration_m_s2"] == pytest.approx(2.0, abs=0.01)


@pytest.mark.parametrize("identity", ["7.4", "7.6", "7.7"])
def test_an_imposed_error_takes_the_factor_to_its_least_and_back(
    driven: dict[str, TurtleResult], identity: str
) -> None:
    factors = driven[identity].track.safety_factor
    assert min(factors) == pytest.approx(0.1)
    assert factors[-1] == 1.0


def test_in_the_error_the_acceleration_is_a_tenth_as_the_report_shows(driven: dict[str, TurtleResult]) -> None:
    assert achieved(driven, "7.6")["acceleration_in_error_m_s2"] == pytest.approx(0.1, abs=1e-6)


def test_at_top_speed_the_error_is_ignored(driven: dict[str, TurtleResult]) -> None:
    """The report: case 3 from 0.5 to 2 s, the error from just before 1.5 s on."""
    numbers, track = achieved(driven, "7.7"), driven["7.7"].track
    assert (numbers["top_speed_from_s"], numbers["top_speed_to_s"]) == pytest.approx((0.5, 2.0), abs=0.03)
    lowered = [time for time, factor in zip(track.time_s, track.safety_factor, strict=True) if factor < 1.0]
    assert lowered[0] == pytest.approx(2.0, abs=0.05)


def test_on_ice_the_traction_loop_keeps_the_robot_nearer_to_its_way(driven: dict[str, TurtleResult]) -> None:
    without, held = achieved(driven, "ice-off"), achieved(driven, "ice-on")
    assert held["sideways_m"] < 0.4 * without["sideways_m"]
    assert held["sliding_s"] < without["sliding_s"]
    assert abs(held["heading_deg"]) < 0.3 * abs(without["heading_deg"])


def test_the_factor_makes_no_chatter_on_ice(driven: dict[str, TurtleResult]) -> None:
    assert achieved(driven, "ice-on")["changes_of_factor"] < 20


def test_one_seed_writes_the_same_bytes_twice(tmp_path: Path) -> None:
    logs = []
    for name in "ab":
        drive("ice-on", 3, tmp_path / f"{name}.log")
        logs.append((tmp_path / f"{name}.log").read_bytes())
    assert logs[0] == logs[1]


def test_another_robot_is_refused() -> None:
    with pytest.raises(UsageError, match="no omni-wheels"):
        run_virtual(demo_turtle.drive(load("max2d").profile, FIGURES[0], 0, None, lambda _: None))


def test_the_command_draws_a_picture_of_a_figure(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["demo", "--figure", "7.7", "--virtual-time", "--json", "--out", str(tmp_path / "out")]) == 0
    assert json.loads(capsys.readouterr().out)["figure"] == "7.7"
    assert {path.name for path in (tmp_path / "out").iterdir()} == {"figure-7.7.png", "candump-turtle-1.log"}


def test_an_unknown_figure_is_refused_with_those_there_are(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["demo", "--figure", "9.9"]) == 2
    assert "7.3" in capsys.readouterr().err


def test_the_turtles_figures_need_can(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["demo", "--figure", "turtle", "--bus", "rs232"]) == 2
    assert "accelerometer" in capsys.readouterr().err
