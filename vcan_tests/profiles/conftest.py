"""Robots written into a temporary folder, loaded from there."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from profiles.loader import LoadedProfile, ProfileError, load

HEAD = "schema_version: 1\nname: lab\nextends: max2d\n"
"""Three lines that most test robots begin with; what a test adds begins on line 4."""

Robot = Callable[[str], LoadedProfile]
Mistakes = Callable[[str], list[str]]


@pytest.fixture
def head() -> str:
    """What a test robot begins with; a room with another robot overrides it."""
    return HEAD


@pytest.fixture
def robot(head: str, tmp_path: Path) -> Robot:
    """Load a robot that extends the head's by some YAML."""

    def load_it(yaml: str) -> LoadedProfile:
        path = tmp_path / "lab.yaml"
        path.write_text(head + yaml, encoding="utf-8")
        return load(path)

    return load_it


@pytest.fixture
def mistakes(robot: Robot, tmp_path: Path) -> Mistakes:
    """The mistakes of such a robot, without the folder's name."""

    def collect(yaml: str) -> list[str]:
        with pytest.raises(ProfileError) as caught:
            robot(yaml)
        return [str(mistake).removeprefix(f"{tmp_path}/") for mistake in caught.value.mistakes]

    return collect
