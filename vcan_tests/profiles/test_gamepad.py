"""The part of a profile about gamepads."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from canhelm.errors import ConfigError
from profiles.gamepad import StickConfig
from profiles.json_schema import json_schema
from profiles.loader import load

PAGE = Path(__file__).resolve().parents[2] / "docs" / "gamepad.md"


def test_what_the_documentation_shows_is_a_profile(tmp_path: Path) -> None:
    (shown,) = re.findall(r"```yaml\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    path = tmp_path / "mine.yaml"
    path.write_text(f"schema_version: 1\nextends: robots/max2d\n{shown}")
    gamepad = load(path).profile.gamepad
    assert gamepad.speed == StickConfig(axis="ABS_Y", share=0.5)
    assert gamepad.direction is None


@pytest.mark.parametrize("name", ["GamepadConfig", "StickConfig"])
def test_the_schema_says_what_each_key_means(name: str) -> None:
    keys = json_schema()["$defs"][name]["properties"]
    assert [key for key, value in keys.items() if "description" not in value] == []


def loaded(folder: Path, text: str) -> Path:
    path = folder / "mine.yaml"
    path.write_text(f"schema_version: 1\nextends: robots/turtle\ngamepad: {text}\n")
    return path


def test_what_a_profile_leaves_out_is_that_of_a_usual_pad(tmp_path: Path) -> None:
    gamepad = load(loaded(tmp_path, "{dead_man: BTN_TR, speed: {axis: ABS_RY}}")).profile.gamepad
    assert (gamepad.dead_man, gamepad.speed) == ("BTN_TR", StickConfig(axis="ABS_RY"))
    assert gamepad.yaw_rate == StickConfig(axis="ABS_RX")


def test_a_command_or_a_button_can_be_left_without_any(tmp_path: Path) -> None:
    gamepad = load(loaded(tmp_path, "{sideways: null, emergency_stop: null, silence_s: null}")).profile.gamepad
    assert (gamepad.sideways, gamepad.emergency_stop, gamepad.silence_s) == (None, None, None)


@pytest.mark.parametrize(
    "text",
    ["{dead_man: BTN_LEFT_PADDLE}", "{speed: {axis: ABS_Q}}", "{speed: {axis: ABS_X, dead_zone: 1.0}}", "{speed: {}}",
     "{dead_man: null}", "{speed: {axis: ABS_X, sign: 0}}", "{silence_s: 0}"],
)  # fmt: skip
def test_what_makes_no_sense_is_refused_with_its_line(tmp_path: Path, text: str) -> None:
    with pytest.raises(ConfigError, match=r"mine\.yaml:3"):
        load(loaded(tmp_path, text))
