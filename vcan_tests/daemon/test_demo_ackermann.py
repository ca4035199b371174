"""The Ackermann car's demo: steps by the report's equations and driven over the simulated bus."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from canhelm.errors import UsageError
from daemon import demo_ackermann
from daemon.cli.main import main
from daemon.demo_ackermann import FIGURES, CarResult
from daemon.runtime.clock import run_virtual
from profiles.loader import load


@pytest.fixture(scope="module")
def driven() -> dict[str, CarResult]:
    car = load("ackermann").profile
    return {step.identity: run_virtual(demo_ackermann.run(car, step, 1, None, lambda _: None)) for step in FIGURES}


def test_the_computed_step_from_rest_settles_as_the_reference_vector_says(driven: dict[str, CarResult]) -> None:
    computed = driven["step-from-rest"].numbers["computed"]
    assert computed["settling_s"] == pytest.approx(1.2, abs=0.051)
    assert computed["largest_steering_deg"] == 45.0


@pytest.mark.parametrize("identity", [step.identity for step in FIGURES])
def test_the_driven_car_settles_about_as_soon_as_the_equations_do(driven: dict[str, CarResult], identity: str) -> None:
    numbers = driven[identity].numbers
    assert numbers["achieved"]["settling_s"] < numbers["computed"]["settling_s"] + 0.6
    assert numbers["achieved"]["final_heading_error_deg"] == pytest.approx(0.0, abs=0.6)
    assert numbers["achieved"]["final_speed_error_m_s"] == pytest.approx(0.0, abs=0.01)
    assert numbers["late_cycles"] == 0


def test_the_truth_is_told_not_the_set_point(driven: dict[str, CarResult]) -> None:
    """The driven steering cannot be there at once: its rate is limited."""
    track = driven["step-from-rest"].driven
    first = next(time for time, angle in zip(track.time_s, track.steering_rad, strict=True) if angle > 0.7)
    assert first > 0.3


def test_the_command_prints_computed_and_driven_numbers_and_draws(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["demo", "--figure", "step-slower", "--virtual-time", "--out", str(tmp_path), "--json"]) == 0
    row: dict[str, Any] = json.loads(capsys.readouterr().out)
    assert row["figure"] == "step-slower"
    assert row["computed"].keys() == row["achieved"].keys()
    assert (tmp_path / "figure-step-slower.png").stat().st_size > 10_000


def test_another_vehicle_is_refused() -> None:
    with pytest.raises(UsageError, match="no car"):
        run_virtual(demo_ackermann.run(load("turtle").profile, FIGURES[0], 1, None, lambda _: None))
