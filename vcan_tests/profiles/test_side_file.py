"""The side file that machines write: it takes a value, or stays as it was."""

from __future__ import annotations

from pathlib import Path

import pytest

from canhelm.errors import ConfigError
from profiles.loader import load
from profiles.plain_yaml import read_plain
from profiles.side_file import write_values

FORWARD: dict[tuple[str, ...], int] = {("drives", "rear_left", "direction"): -1}


@pytest.fixture
def robot(tmp_path: Path) -> Path:
    path = tmp_path / "lab.yaml"
    path.write_text("extends: max2d\n", encoding="utf-8")
    return path


def test_a_value_is_in_the_profile_from_then_on(robot: Path) -> None:
    write_values(robot, FORWARD)
    assert load(robot).profile.drives["rear_left"].direction == -1


@pytest.mark.parametrize("content", [b"[" * 5000, b"- 1\n", b"a: b: c\n", b"\xff", b"0b: 2024-13-45\n"])
def test_one_that_is_damaged_is_told_and_left_alone(robot: Path, content: bytes) -> None:
    side = robot.with_name("lab.calibration.yaml")
    side.write_bytes(content)
    with pytest.raises(ConfigError, match="lab\\.calibration\\.yaml"):
        write_values(robot, FORWARD)
    assert side.read_bytes() == content


def test_values_that_make_the_profile_impossible_are_not_kept_and_the_persons_file_is_named(robot: Path) -> None:
    with pytest.raises(ConfigError, match="stays as it was: with the new values") as refused:
        write_values(robot, {("drives", "rear_left", "wheel_radius_m"): 1.0})
    assert f"give {robot} its own values" in str(refused.value.remedy)
    assert not robot.with_name("lab.calibration.yaml").exists()


@pytest.mark.parametrize("text", ["a: !!int", "a: !!float ' '", "a: !!bool perhaps", "a: !!timestamp soon", "[" * 5000])
def test_what_is_no_yaml_is_refused_as_that(text: str) -> None:
    with pytest.raises(ValueError, match=r"."):
        read_plain(text)
