"""What a setup makes of a person's words, of wheels, brakes and pairs."""

from __future__ import annotations

import pytest

from daemon.commissioning.pairs import LOCKED, WIRINGS, Push, judge_brakes, judge_encoders
from daemon.commissioning.wheels import Findings, Seen, judge_wheel, seen_wheel
from vcan_tests.daemon.workshop import MAX2D


@pytest.mark.parametrize(
    ("answer", "seen"),
    [
        ("forward", ("rear_left", True)),
        ("front_right Backward", ("front_right", False)),
        ("none", ("", False)),
        ("", None),
        ("sideways", None),
        ("nose forward", None),
        ("front_right and rear_left forward", None),
    ],
)
def test_a_persons_words_are_understood_or_asked_for_again(answer: str, seen: tuple[str, bool] | None) -> None:
    assert seen_wheel(answer, "rear_left", MAX2D.drives) == seen


@pytest.mark.parametrize(
    ("seen", "words"),
    [
        (Seen("rear_left", "", forward=False, moved=False), "check motor cable and brake"),
        (Seen("rear_left", "", forward=False, moved=True), "is the shaft loose"),
        (Seen("rear_left", "rear_left", forward=True, moved=False), "its encoder counts nothing"),
        (Seen("rear_left", "rear_left", forward=True, moved=True, turn_qc=-56000), "look again"),
    ],
)
def test_what_a_profile_cannot_put_right_is_left_to_the_person(seen: Seen, words: str) -> None:
    findings = Findings()
    judge_wheel(seen, MAX2D.drives, findings)
    assert words in findings.unsolved[0]
    assert findings.values == {}


def pushes(rear: tuple[bool, bool, bool], front: tuple[bool, bool, bool], turned_deg: float = 20.0) -> list[Push]:
    """Pushes of both pairs with: all locked, their own brake released, the other one released."""
    made = []
    for pair, moved, rounds in (("rear", rear, (LOCKED, "rear", "front")), ("front", front, (LOCKED, "front", "rear"))):
        for released, gave_way in zip(rounds, moved, strict=True):
            made.append(Push(pair, released, gave_way, {pair: turned_deg if gave_way else 0.0}))
    return made


@pytest.mark.parametrize("pattern", [(False, False, False), (True, True, True), (False, True, True)])
def test_a_brake_that_makes_no_sense_is_told(pattern: tuple[bool, bool, bool]) -> None:
    findings = Findings()
    judge_brakes(pushes(pattern, (False, True, False)), MAX2D, findings)
    assert findings.unsolved[0].startswith("the rear brake")
    assert findings.values == {}


def test_each_wiring_of_a_brake_shows_a_pattern_of_its_own() -> None:
    assert len(set(WIRINGS)) == 4


def test_a_pair_without_a_moving_encoder_is_told() -> None:
    findings = Findings()
    judge_encoders(pushes((False, True, False), (False, True, False), 0.5), MAX2D.encoders, findings)
    assert findings.unsolved[0].startswith("no encoder tells of the rear pair")
