"""The first week with a robot, as its page tells it: every command typed, and what is said compared with the page."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

from profiles.loader import load
from profiles.schema import Profile
from vcan_tests.docs.player import Player, fits, told_anew

PAGE = Path(__file__).resolve().parents[2] / "docs" / "first-week.md"
DURATION = re.compile(r"(?<=duration_s: )[\d.]+$", re.MULTILINE)
DURATION_S = 0.1
"""How alike: beside a client that listens, virtual time goes on while another one thinks."""
pytestmark = pytest.mark.timeout(600)


@dataclass(frozen=True)
class Week:
    """What came of the week.

    Attributes:
        told: the page as it was played.
        pose: where the robot really stands at the end: x_m, y_m, yaw_rad.
        found: the person's profile.
        built: how the robot is built.
    """

    told: str
    pose: tuple[float, float, float]
    found: Profile
    built: Profile


@pytest.fixture(scope="module")
def week(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Week]:
    """Monday to Friday, on virtual time."""
    folder = tmp_path_factory.mktemp("week")
    with pytest.MonkeyPatch.context() as patch:
        player = Player(folder, patch)
        try:
            told = told_anew(PAGE.read_text(encoding="utf-8"), player)
            assert player.daemon is not None
            network = player.daemon.app.network
            assert network is not None
            pose = network.world.pose
        finally:
            player.close()
        yield Week(told, pose, load(folder / "lab1.yaml").profile, load(folder / "built.yaml").profile)


def test_the_page_shows_what_its_commands_say(week: Week) -> None:
    anew = "`python -m vcan_tests.docs.player docs/first-week.md` writes down what they say now"
    page = PAGE.read_text(encoding="utf-8")
    assert DURATION.sub("", week.told).splitlines() == DURATION.sub("", page).splitlines(), anew
    assert [float(s) for s in DURATION.findall(week.told)] == pytest.approx(
        [float(s) for s in DURATION.findall(page)], abs=DURATION_S
    ), anew


@pytest.mark.parametrize(
    "words",
    [
        "rear_right   EPOS             2011      operational  two nodes have this id",
        "canhelm: two drives have node id 1: both would get the new one",
        "reversed: rear_left rolls backward when it shall roll forward",
        "reversed: the front brake releases when it shall lock",
        "swapped: encoder front (node 6) tells of the rear pair",
        "rear_left pushes: +",
    ],
)
def test_each_fault_is_found_by_name(week: Week, words: str) -> None:
    assert words in week.told


def test_the_profile_that_was_found_is_how_the_robot_is_built(week: Week) -> None:
    zeros = {name: encoder.zero_before_counts for name, encoder in week.found.encoders.items()}
    assert zeros == {"rear": None, "front": 2048}
    found = [(encoder.node, encoder.direction, encoder.zero_counts) for encoder in week.found.encoders.values()]
    built = [(encoder.node, encoder.direction, encoder.zero_counts) for encoder in week.built.encoders.values()]
    assert (week.found.drives, week.found.brakes, found) == (week.built.drives, week.built.brakes, built)


def test_the_robot_has_driven_figure_4_7_within_two_percent(week: Week) -> None:
    x_m, y_m, _ = week.pose
    assert math.hypot(x_m - 1.0, y_m - 1.732) <= 0.02 * 0.5 * 4.0


@pytest.mark.parametrize(
    ("shown", "told", "agrees"),
    [
        (["a", "b"], ["a", "b"], True),
        (["a"], ["a", "b"], False),
        (["a", "...", "d"], ["a", "b", "c", "d"], True),
        (["...", "c", "..."], ["a", "b", "c", "d"], True),
        (["a", "..."], ["b", "a"], False),
        (["...", "c"], ["a", "b", "c", "d"], False),
        (["...", "e", "..."], ["a", "b", "c", "d"], False),
    ],
)
def test_dots_on_a_page_stand_for_lines(shown: list[str], told: list[str], agrees: bool) -> None:
    assert fits(tuple(shown), told) is agrees
