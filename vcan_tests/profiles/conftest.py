"""Robots written into a temporary folder, loaded from there."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from profiles.loader import LoadedProfile, ProfileError, load

HEAD = "schema_version: 1\nname: lab\nextends: max2d\n"
"""Three lines that every test robot begins with; what a test adds begins on line 4."""

Robot = Callable[[str], LoadedProfile]
Mistakes = Callable[[str], list[str]]


@pytest.fixture
def robot(tmp_path: Path) -> Robot:
    """Load a robot that extends the MAX2D by some YAML."""

    def load_it(yaml: str) -> LoadedProfile:
        path = tmp_path / "lab.yaml"
        path.write_text(HEAD + yaml, encoding="utf-8")
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
