"""The dead-man button, by a model of its own: what has to have happened before a pad drives."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from daemon.gamepad.dead_man import DeadMan

MOMENTS = st.lists(st.tuples(st.booleans(), st.booleans(), st.booleans()), max_size=30)


def drives(history: list[tuple[bool, bool, bool]]) -> bool:
    """Looked up backwards: held since a moment with neutral sticks, before that let go of, and no lock since."""
    since_neutral = False
    for locked, held, neutral in reversed(history):
        if not held:
            return since_neutral
        since_neutral = since_neutral or neutral
        if locked:
            return False
    return False


@given(MOMENTS)
def test_it_drives_only_after_let_go_then_held_with_neutral_sticks(moments: list[tuple[bool, bool, bool]]) -> None:
    button = DeadMan()
    history: list[tuple[bool, bool, bool]] = []
    for locked, held, neutral in moments:
        if locked:
            button.lock()
        button.step(held=held, neutral=neutral)
        history.append((locked, held, neutral))
        assert button.driving == drives(history)


def test_a_button_that_is_held_from_the_start_does_not_drive() -> None:
    button = DeadMan()
    button.step(held=True, neutral=True)
    assert not button.driving


def test_it_drives_on_with_the_sticks_out_of_their_middle() -> None:
    button = DeadMan()
    for held, neutral in ((False, True), (True, True), (True, False)):
        button.step(held=held, neutral=neutral)
    assert button.driving


def test_a_stick_that_is_pushed_too_early_has_to_come_back_first() -> None:
    button = DeadMan()
    button.step(held=False, neutral=False)
    button.step(held=True, neutral=False)
    assert (button.driving, button.centring) == (False, True)
    button.step(held=True, neutral=True)
    assert (button.driving, button.centring) == (True, False)
