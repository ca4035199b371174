"""The profile that a daemon leaves for whoever cleans up behind it."""

from __future__ import annotations

from pathlib import Path

import pytest

from profiles.kept import FILE, keep, kept, runtime_folder
from profiles.loader import available, load


@pytest.mark.parametrize("name", [path.stem for path in available()])
def test_what_is_kept_of_a_shipped_profile_is_all_of_it(tmp_path: Path, name: str) -> None:
    profile = load(name).profile
    keep(profile, tmp_path)
    assert kept(tmp_path) == profile


@pytest.mark.parametrize("text", ["[" * 10_000, "", "{", '{"name": "max2d"}', "\xff"])
def test_what_can_not_be_read_counts_as_not_kept(tmp_path: Path, text: str) -> None:
    (tmp_path / FILE).write_text(text, encoding="latin-1")
    assert kept(tmp_path) is None


def test_nothing_is_kept_where_nobody_was() -> None:
    assert kept(Path("/nowhere")) is None


def test_the_folder_is_the_first_that_the_service_manager_gives() -> None:
    assert runtime_folder({"RUNTIME_DIRECTORY": "/run/canhelm/lab1:/run/other"}) == Path("/run/canhelm/lab1")


def test_without_a_service_manager_there_is_no_folder() -> None:
    assert runtime_folder({}) is None
