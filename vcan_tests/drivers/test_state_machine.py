from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.canopen.objects import BitDef
from drivers.epos.state_machine import (
    COMMAND_PATTERNS,
    CONTROLWORD_BITS,
    STATE_MASK,
    STATES,
    STATUSWORD_BITS,
    TRANSITIONS,
    Command,
    State,
    command_of,
    controlword_to,
    state_of,
)

WORDS = st.integers(0, 0xFFFF)
OTHER_BITS = 0xFFFF & ~STATE_MASK
AUTOMATIC = {arrow.source: arrow.target for arrow in TRANSITIONS if arrow.command is None}
COMMANDED = {(arrow.source, arrow.command): arrow.target for arrow in TRANSITIONS if arrow.command is not None}


def drive_to(target: State, state: State) -> list[int]:
    """Controlwords that lead there, with a drive that follows the transition table; fails after too many."""
    words: list[int] = []
    for _ in range(20):
        if state is target:
            return words
        word = controlword_to(target, state)
        if word is None:
            state = AUTOMATIC[state]
        else:
            words.append(word)
            state = COMMANDED[state, command_of(word)]
    raise AssertionError(f"no way from {state} to {target}")


@given(st.sampled_from(State), WORDS)
def test_a_state_is_recognised_whatever_the_other_bits_say(state: State, other: int) -> None:
    assert state_of(state | (other & OTHER_BITS)) is state


@given(WORDS)
def test_a_word_that_is_no_state_is_none(word: int) -> None:
    state = state_of(word)
    assert state is None or word & STATE_MASK == state


def test_the_statusword_of_an_enabled_drive_that_reached_its_speed() -> None:
    assert state_of(0x0737) is State.OPERATION_ENABLED


@pytest.mark.parametrize(
    ("state", "powered"),
    [(State.OPERATION_ENABLED, True), (State.QUICK_STOP_ACTIVE, True), (State.REFRESH, False), (State.FAULT, False)],
)
def test_the_power_stage_is_on_where_the_manual_says_so(state: State, powered: bool) -> None:
    assert state.power_stage_on is powered


def test_the_voltage_bit_agrees_with_the_power_stage() -> None:
    assert {state for state in State if state & 0x10} == {state for state in State if state.power_stage_on}


@given(WORDS)
def test_every_controlword_fits_exactly_one_command(word: int) -> None:
    assert sum(word & mask == value for mask, value, _ in COMMAND_PATTERNS) == 1


@pytest.mark.parametrize("command", Command)
def test_the_word_of_each_command_reads_as_that_command(command: Command) -> None:
    assert command_of(command) is command


def test_the_way_to_operation_enabled_is_shutdown_switch_on_enable() -> None:
    assert drive_to(State.OPERATION_ENABLED, State.SWITCH_ON_DISABLED) == [0x0006, 0x0007, 0x000F]


def test_the_way_out_of_a_fault_begins_with_a_fault_reset() -> None:
    assert drive_to(State.OPERATION_ENABLED, State.FAULT) == [0x0080, 0x0006, 0x0007, 0x000F]


def test_a_quick_stop_is_resumed_by_enable_operation() -> None:
    assert drive_to(State.OPERATION_ENABLED, State.QUICK_STOP_ACTIVE) == [0x000F]


def test_an_enabled_drive_is_disabled_in_one_step() -> None:
    assert drive_to(State.SWITCH_ON_DISABLED, State.OPERATION_ENABLED) == [0x0000]


@pytest.mark.parametrize("state", [state for state in State if state is not State.MEASURE_INIT])
def test_every_state_leads_to_operation_enabled(state: State) -> None:
    drive_to(State.OPERATION_ENABLED, state)


def test_nothing_is_written_to_a_drive_that_is_there_or_on_its_way() -> None:
    assert controlword_to(State.OPERATION_ENABLED, State.OPERATION_ENABLED) is None
    assert controlword_to(State.OPERATION_ENABLED, State.REFRESH) is None


def test_no_command_leads_into_a_fault() -> None:
    assert all(controlword_to(State.FAULT, state) is None for state in State)


def test_the_numbers_of_the_transitions_are_those_of_the_manual() -> None:
    assert {arrow.number for arrow in TRANSITIONS} | {13, 17, 19} == set(range(21))


def test_one_command_has_one_effect_in_a_state() -> None:
    commanded = [(arrow.source, arrow.command) for arrow in TRANSITIONS if arrow.command is not None]
    assert len(commanded) == len(set(commanded))


@pytest.mark.parametrize("state", State)
def test_every_state_has_words(state: State) -> None:
    assert STATES[state].meaning


@pytest.mark.parametrize("bits", [STATUSWORD_BITS, CONTROLWORD_BITS])
def test_a_bit_means_one_thing_in_a_mode(bits: tuple[BitDef, ...]) -> None:
    keys = [(bit.bit, bit.modes) for bit in bits]
    assert len(keys) == len(set(keys))


def test_every_bit_of_the_statusword_is_described() -> None:
    assert {bit.bit for bit in STATUSWORD_BITS} == set(range(16))
