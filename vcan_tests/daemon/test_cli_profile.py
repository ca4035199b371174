"""``canhelm profile`` as people and programs see it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from daemon.cli.main import main
from profiles.loader import load

Captured = pytest.CaptureFixture[str]


def rows(capsys: Captured, *arguments: str) -> list[dict[str, Any]]:
    """What a command prints when piped: one object a line."""
    main(["profile", *arguments])
    return [json.loads(line) for line in capsys.readouterr().out.splitlines()]


@pytest.fixture
def broken(tmp_path: Path) -> Path:
    """A robot with two mistakes."""
    path = tmp_path / "lab.yaml"
    path.write_text("extends: max2d\ndrives:\n  rear_left: {node: 0}\n  rear_right: {gear_ratio: 0}\n")
    return path


def test_list_shows_the_shipped_robots(capsys: Captured) -> None:
    assert [row["name"] for row in rows(capsys, "list")] == [
        "ackermann",
        "max2d",
        "nxt",
        "semitrailer",
        "semitrailer_lab",
        "turtle",
    ]


def test_show_gives_what_the_robots_own_file_says(capsys: Captured) -> None:
    fields = [row["field"] for row in rows(capsys, "show", "max2d")]
    assert "limits.speed_m_s" in fields
    assert "vehicle.mass_kg" not in fields


def test_effective_gives_every_value_with_its_origin(capsys: Captured) -> None:
    origins = {row["field"]: row["origin"].rpartition("/")[2] for row in rows(capsys, "show", "max2d", "--effective")}
    assert (origins["vehicle.mass_kg"], origins["network.sdo_timeout_s"]) == ("max2d.yaml:3", "default")


def test_effective_marks_assumed_values(capsys: Captured) -> None:
    assumed = {row["field"] for row in rows(capsys, "show", "max2d", "--effective") if row["assumed"]}
    assert assumed == set(load("max2d").assumed)


def test_check_of_a_good_profile_says_so(capsys: Captured) -> None:
    assert rows(capsys, "check", "max2d")[0]["valid"] is True


def test_check_gives_file_and_line_of_every_mistake_to_programs(capsys: Captured, broken: Path) -> None:
    assert [row["place"] for row in rows(capsys, "check", str(broken))] == [f"{broken}:3", f"{broken}:4"]


def test_check_gives_file_and_line_of_every_mistake_to_people(capsys: Captured, broken: Path) -> None:
    main(["profile", "check", str(broken)])
    assert f"{broken}:4: drives.rear_right.gear_ratio: is 0;" in capsys.readouterr().err


def test_mistakes_are_exit_code_7(broken: Path) -> None:
    assert main(["profile", "check", str(broken)]) == 7


def test_warnings_go_to_people_alone(capsys: Captured, tmp_path: Path) -> None:
    (tmp_path / "lab.yaml").write_text("extends: max2d\nsimulation: ~\n")
    main(["profile", "check", str(tmp_path / "lab.yaml")])
    assert "warning: " in capsys.readouterr().err


def test_schema_is_json(capsys: Captured) -> None:
    main(["profile", "schema"])
    assert json.loads(capsys.readouterr().out)["title"] == "canhelm robot profile"


def test_a_new_profile_is_valid(tmp_path: Path) -> None:
    path = tmp_path / "lab1.yaml"
    main(["profile", "new", "lab1", "--out", str(path)])
    assert load(path).profile.name == "lab1"


def test_a_new_profile_overwrites_nothing(broken: Path) -> None:
    assert main(["profile", "new", "lab", "--out", str(broken)]) == 1


def test_a_new_profile_needs_a_proper_name() -> None:
    assert main(["profile", "new", "1/2"]) == 2


def test_a_new_profile_extends_only_what_there_is() -> None:
    assert main(["profile", "new", "lab1", "--extends", "max3d"]) == 7


@pytest.mark.parametrize("base", ["max2d", "turtle", "semitrailer", "ackermann", "nxt"])
def test_the_sample_lines_of_a_new_profile_name_what_its_base_has(base: str, tmp_path: Path) -> None:
    path = tmp_path / "lab1.yaml"
    main(["profile", "new", "lab1", "--extends", base, "--out", str(path)])
    _, *lines = path.read_text().splitlines()
    path.write_text("\n".join(line.removeprefix("# ") for line in lines))
    assert "# limits:" in lines
    assert load(path).profile.limits == load(base).profile.limits
