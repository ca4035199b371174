"""A profile that names Python classes: what is wrong with them is told with file and line of the profile."""

from __future__ import annotations

import textwrap
from pathlib import Path

import pytest

from profiles.loader import ProfileError, load
from profiles.own_vehicle import OwnGeometry

EXAMPLE = Path(__file__).parents[2] / "examples" / "own_vehicle"
ROBOT = """
schema_version: 1
extends: mecanum
vehicle:
  {vehicle}
"""
LAW = """
from daemon.loops.own_vehicle import OwnVehicle

class Half(OwnVehicle):
    wheels = 4
    def step(self, measurement, target, dt_s): ...

class Free:
    wheels = 4

class Picky(OwnVehicle):
    wheels = 4
    parameters = ("half_length_m", "half_width_m", "mass_kg", "yaw_inertia_kg_m2")
    def __init__(self, given, limits):
        raise ValueError("a mass of %g kg is too much" % given["mass_kg"])
    def step(self, measurement, target, dt_s): ...
    def body_motion(self, rolled, heading_rad): ...

class Longing(Picky):
    parameters = (*Picky.parameters, "reach_m")

class Broken(Picky):
    def __init__(self):
        pass
"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """With the example's profile and classes of another person beside it."""
    (tmp_path / "mecanum.yaml").write_text((EXAMPLE / "mecanum.yaml").read_text())
    (tmp_path / "others.py").write_text(textwrap.dedent(LAW))
    (tmp_path / "sick.py").write_text("1 / 0\n")
    for path in (tmp_path, EXAMPLE):
        monkeypatch.syspath_prepend(path)
    return tmp_path


def mistakes(folder: Path, *vehicle: str) -> list[str]:
    """What is told of a robot that differs from the example in some lines of its vehicle, from line 5 on."""
    robot = folder / "robot.yaml"
    robot.write_text(ROBOT.format(vehicle="\n  ".join(vehicle)).lstrip())
    with pytest.raises(ProfileError) as refused:
        load(robot)
    prefix = f"{folder}/"
    return [str(mistake).removeprefix(prefix) for mistake in refused.value.mistakes]


def test_the_example_is_without_mistakes(folder: Path) -> None:
    vehicle = load(folder / "mecanum.yaml").profile.vehicle
    assert isinstance(vehicle, OwnGeometry)
    assert vehicle.kind == "mecanum:Mecanum"


@pytest.mark.parametrize(
    ("line", "told"),
    [
        ("kind: nowhere.robot:Rover", "kind: nowhere.robot:Rover cannot be imported: No module named 'nowhere'"),
        ("kind: others:Rover", "kind: names others:Rover: module others has no class Rover; it has others:Picky, "),
        ("kind: sick:Rover", "kind: sick:Rover failed while it was imported: ZeroDivisionError"),
        ("kind: others:Half", "kind: others:Half lacks body_motion"),
        ("kind: others:Free", "kind: others:Free lacks encoders, brakes, parameters, step, body_motion, objection"),
        ("twin: others:Half", "twin: others:Half lacks advance, moving, pose"),
        ("kind: mecanum", "kind: is 'mecanum'; write module:Class, as"),
        ("kind: others:Picky", "parameters: are refused by others:Picky: a mass of 25 kg is too much; correct them"),
        ("kind: others:Longing", "parameters.reach_m: is missing, others:Longing needs it; write reach_m: with a num"),
        ("kind: others:Broken", "kind: others:Broken cannot be made: TypeError: "),
        ("wheels: [front_left, front_right]", "wheels: names 2, mecanum:Mecanum has 4; name 4"),
        ("wheels: [a, front_right, rear_left, rear_right]", "wheels[0]: drives has no 'a'"),
    ],
)
def test_what_is_wrong_with_a_class_is_told_with_file_and_line(folder: Path, line: str, told: str) -> None:
    (mistake,) = mistakes(folder, line)
    place, _, rest = mistake.partition(" ")
    assert rest.startswith(f"vehicle.{told}"), rest
    assert place == ("mecanum.yaml:10:" if told.startswith("parameters") else "robot.yaml:4:")


def test_an_import_error_says_which_python_looked(folder: Path) -> None:
    (mistake,) = mistakes(folder, "kind: nowhere:Rover")
    assert "python" in mistake
    assert "PYTHONPATH" in mistake


def test_an_unknown_number_is_told_with_the_one_that_was_meant(folder: Path) -> None:
    (mistake,) = mistakes(folder, "parameters: {half_lenght_m: 3}")
    told = "robot.yaml:4: vehicle.parameters.half_lenght_m: is a number that mecanum:Mecanum does not know"
    assert mistake == f"{told}; did you mean half_length_m?"


def test_the_example_refuses_a_length_that_makes_no_sense(folder: Path) -> None:
    (mistake,) = mistakes(folder, "parameters: {half_width_m: -0.15}")
    assert mistake.endswith(
        "are refused by mecanum:Mecanum: half_width_m is -0.15, and has to be above 0; correct them"
    )
