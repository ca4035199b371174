"""The semi-trailer's demo: what it must show, in short."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from canhelm.errors import UsageError
from daemon.cli.demo import SEMITRAILER
from daemon.cli.main import main
from daemon.demo_semitrailer import GROUP, Manoeuvre, circle_backwards, drive, figures, line_backwards
from profiles.loader import load

PROFILE = load("semitrailer").profile


@pytest.mark.parametrize("manoeuvre", [line_backwards(4.0), circle_backwards(0.6)], ids=lambda figure: figure.identity)
async def test_backwards_it_settles_within_two_centimetres_with_the_sensors_noise(manoeuvre: Manoeuvre) -> None:
    told: list[str] = []
    result = await drive(PROFILE, manoeuvre, 3, None, told.append)
    achieved = result.numbers["achieved"]
    assert achieved["settled_error_m"] <= 0.02
    assert achieved["largest_bending_deg"] < 60.0
    assert result.numbers["late_cycles"] == 0
    assert told


def test_the_command_drives_parking_and_draws_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    main(["demo", "--figure", "park-parallel", "--virtual-time", "--out", str(tmp_path)])
    (row,) = map(json.loads, capsys.readouterr().out.splitlines())
    assert row["achieved"]["end_error_m"] <= 0.03
    assert abs(row["achieved"]["end_heading_error_deg"]) <= 2.0
    assert (tmp_path / "park-parallel.png").stat().st_size > 10_000
    assert list(tmp_path.glob("*.log"))


def test_the_figures_are_those_that_the_command_knows() -> None:
    assert (GROUP, *(figure.identity for figure in figures())) == SEMITRAILER


async def test_another_robot_is_refused() -> None:
    with pytest.raises(UsageError, match="no semi-trailer"):
        await drive(load("turtle").profile, line_backwards(3.0), 0, None, print)
