"""The MAX2D's demo on a path: chosen pieces, stated deviations, and what was driven."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from matplotlib import pyplot
from matplotlib.figure import Figure
from matplotlib.text import Text

from canhelm.errors import UsageError
from daemon.cli.main import main
from daemon.demo_max2d_path import PathResult, drive
from daemon.demo_max2d_path_pictures import draw
from daemon.runtime.clock import run_virtual
from profiles.loader import load


@pytest.fixture(scope="module")
def result() -> PathResult:
    return run_virtual(drive(load("max2d").profile, 1, None, lambda _: None))


def test_lines_and_bends_are_driven_as_they_are_and_the_narrow_bend_in_lines(result: PathResult) -> None:
    kinds = [(piece["path_pieces"][0], piece["kind"]) for piece in result.numbers["pieces"]]
    assert kinds[:3] == [(0, "line"), (1, "arc"), (2, "line")]
    assert set(kinds[3:-2]) == {(3, "line")}
    assert kinds[-2:] == [(4, "line"), (5, "arc")]


def test_stated_and_driven_deviations_are_told_for_each_piece(result: PathResult) -> None:
    for piece in result.numbers["pieces"]:
        assert piece["deviation_m"] <= 0.01
        assert piece["driven_deviation_m"] < 0.03
        assert piece["true_deviation_m"] < 0.12
    assert result.numbers["true_end_error_m"] < 0.12


def test_the_askew_robot_rolls_along_its_headings_not_along_its_body(result: PathResult) -> None:
    line = result.numbers["pieces"][-2]
    assert line["rear_deg"] == line["front_deg"] == pytest.approx(-45.0)


def test_the_command_prints_the_pieces_and_draws(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["demo", "--figure", "path-in-pieces", "--virtual-time", "--out", str(tmp_path), "--json"]) == 0
    row = json.loads(capsys.readouterr().out)
    assert row["stops"] == len(row["pieces"]) - 1
    assert (tmp_path / "figure-path-in-pieces.png").stat().st_size > 10_000


def test_the_title_of_the_picture_is_not_cut(
    result: PathResult, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    drawn: list[Figure] = []
    monkeypatch.setattr(pyplot, "close", drawn.append)
    draw(result, tmp_path)
    monkeypatch.undo()
    (title,) = [text for text in drawn[0].findobj(Text) if text.get_text().startswith("The MAX2D follows")]
    assert title.get_window_extent().width < drawn[0].bbox.width
    pyplot.close(drawn[0])


def test_another_vehicle_is_refused() -> None:
    with pytest.raises(UsageError, match="no paired steering"):
        run_virtual(drive(load("turtle").profile, 1, None, lambda _: None))
