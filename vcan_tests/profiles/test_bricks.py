"""Profiles with NXT bricks, and the checks that are for them."""

from __future__ import annotations

from pathlib import Path

import pytest

from profiles.bricks import DifferentialGeometry
from profiles.json_schema import json_schema
from profiles.loader import ProfileError, load
from vcan_tests.profiles.conftest import Mistakes

ARM = "{output: A, wheel_radius_m: 0.01, max_speed_m_s: 0.1, quick_stop_m_s2: 1}"


@pytest.fixture
def head() -> str:
    """Of a robot that extends the NXT; what a test adds begins on line 3."""
    return "schema_version: 1\nextends: nxt\n"


def test_the_nxt_has_the_reports_wheels_and_track() -> None:
    profile = load("nxt").profile
    assert isinstance(profile.vehicle, DifferentialGeometry)
    assert (profile.vehicle.half_track_m, profile.motors["right"].wheel_radius_m) == (0.0585, 0.028)
    assert (profile.motors["right"].output, profile.motors["left"].output) == ("B", "C")


@pytest.mark.parametrize(
    ("yaml", "mistake"),
    [
        ("vehicle: {wheels: [right, middle]}", "vehicle.wheels[1]: drives has no 'middle'; use one of: right, left"),
        ("vehicle: {wheels: [right, right]}", "vehicle.wheels[1]: 'right' stands here twice"),
        ("bricks: {nxt: {motors: {left: {output: B}}}}", "bricks.nxt.motors.left.output: output B is taken by bricks"),
        ("bricks: {nxt: {motors: {left: {output: D}}}}", "bricks.nxt.motors.left.output: is 'D'; write one of A, B, C"),
        ("bricks: {nxt: {port: rfcomm0}}", "bricks.nxt.port: is 'rfcomm0'; write a text that matches"),
        ("bricks: {nxt: {motors: {left: {max_speed_m_s: 1}}}}", "bricks.nxt.motors.left.max_speed_m_s: is 1 m/s, the"),
        ("limits: {wheel_speed_m_s: 0.45}", "limits.wheel_speed_m_s: is 0.45 m/s, motor right allows 0.4 m/s"),
        (f"bricks: {{other: {{motors: {{left: {ARM}}}}}}}", "motors.left: has the name of bricks.nxt.motors.left"),
    ],
)
def test_what_does_not_fit_is_a_mistake_at_its_place(mistakes: Mistakes, yaml: str, mistake: str) -> None:
    found = mistakes(yaml)
    assert [told for told in found if mistake in told], found


def test_a_robot_needs_something_that_moves(tmp_path: Path) -> None:
    path = tmp_path / "lab.yaml"
    path.write_text("schema_version: 1\nlimits: {speed_m_s: 1, acceleration_m_s2: 1, wheel_speed_m_s: 1}\n")
    with pytest.raises(ProfileError, match="drives: is missing, and so is bricks"):
        load(path)


def test_editors_are_told_what_a_port_is() -> None:
    port = json_schema()["$defs"]["BrickConfig"]["properties"]["port"]
    assert "for Bluetooth" in port["description"]
