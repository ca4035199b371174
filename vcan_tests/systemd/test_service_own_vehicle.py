"""A vehicle kind of one's own as a service: its class is found where the settings say, and the journal tells of it."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest

from vcan_tests.shown import EXAMPLES
from vcan_tests.systemd.bench import PROFILE, SERVICE, SETTINGS, Journal, Robot, told

pytestmark = [pytest.mark.systemd, pytest.mark.timeout(240)]


@pytest.fixture
def program() -> Iterator[Path]:
    """The example's files where a service may read them."""
    folder = Path("/opt/lab1")
    shutil.copytree(EXAMPLES / "own_vehicle", folder)
    yield folder
    shutil.rmtree(folder)


async def test_the_journal_says_which_class_runs_inside_the_service(dark_robot: Robot, program: Path) -> None:
    PROFILE.write_text(f"schema_version: 1\nextends: {program}/mecanum\n")
    with SETTINGS.open("a") as settings:
        settings.write(f"PYTHONPATH={program}\n")
    journal = Journal()
    told("systemctl", "start", SERVICE)
    await journal.has(f"mecanum:Mecanum of {program}/mecanum.py runs inside this daemon, with all of its rights")
    assert dark_robot.status()["vehicle"]["kind"] == "mecanum:Mecanum"
