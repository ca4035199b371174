"""Device control of the EPOS 24/5 as data: states, commands, transitions, bits of statusword and controlword, modes.

Source of every table: maxon EPOS Firmware Specification 8.1 (states), 9 (modes), 14.1.48 to 14.1.50 (objects).
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

from drivers.canopen.objects import BitDef, CodeDef

STATE_MASK = 0x417F
"""Bits of the statusword that name the state: 0 to 6, 8 and 14."""


class State(IntEnum):
    """State of the drive; the value is its statusword under :data:`STATE_MASK`."""

    START = 0x0000
    NOT_READY_TO_SWITCH_ON = 0x0100
    SWITCH_ON_DISABLED = 0x0140
    READY_TO_SWITCH_ON = 0x0121
    SWITCHED_ON = 0x0123
    REFRESH = 0x4123
    """The power stage prepares itself; Operation Enabled follows by itself."""
    MEASURE_INIT = 0x4133
    """Known from later firmware only."""
    OPERATION_ENABLED = 0x0137
    QUICK_STOP_ACTIVE = 0x0117
    FAULT_REACTION_DISABLED = 0x010F
    """A fault came up while the power stage was off."""
    FAULT_REACTION_ENABLED = 0x011F
    """A fault came up while the power stage was on; the drive brakes by the fault's class."""
    FAULT = 0x0108

    @property
    def power_stage_on(self) -> bool:
        """Whether the motor is supplied in this state."""
        return self in _POWERED

    @property
    def words(self) -> str:
        """The state's name for people: ``operation enabled``."""
        return self.name.lower().replace("_", " ")


_POWERED = frozenset(
    {State.MEASURE_INIT, State.OPERATION_ENABLED, State.QUICK_STOP_ACTIVE, State.FAULT_REACTION_ENABLED}
)
_STATES = {int(state): state for state in State}


def state_of(statusword: int) -> State | None:
    """The state that a statusword names, or None where its bits fit no state."""
    return _STATES.get(statusword & STATE_MASK)


_WAIT = "Wait; the drive goes on by itself."
_RESET = "Read the error history (0x1003/1), cure the cause, then reset the fault."

STATES: dict[State, CodeDef] = {
    State(entry.code): entry
    for entry in (
        CodeDef(State.START, "start", "The drive boots.", "Power-up or NMT reset node.", _WAIT),
        CodeDef(State.NOT_READY_TO_SWITCH_ON, "not ready to switch on", "The drive initialises itself.", "", _WAIT),
        CodeDef(
            State.SWITCH_ON_DISABLED,
            "switch on disabled",
            "Initialised, power stage off, no command given yet.",
            "Just booted, disabled, or a fault was reset.",
            "Enable the drive when it shall move.",
        ),
        CodeDef(State.READY_TO_SWITCH_ON, "ready to switch on", "Power stage off, first step of enabling done."),
        CodeDef(State.SWITCHED_ON, "switched on", "Power stage off, second step of enabling done."),
        CodeDef(
            State.REFRESH,
            "refresh",
            "The power stage refreshes itself; operation enabled follows.",
            "Enable operation was commanded.",
            _WAIT,
        ),
        CodeDef(
            State.MEASURE_INIT, "measure init", "The drive measures before it enables (later firmware).", "", _WAIT
        ),
        CodeDef(State.OPERATION_ENABLED, "operation enabled", "Power stage on; the drive follows its set value."),
        CodeDef(
            State.QUICK_STOP_ACTIVE,
            "quick stop active",
            "Ramping down or standing still after a quick stop, power stage on.",
            "Quick stop was commanded.",
            "Disable the drive, or enable operation to go on.",
        ),
        CodeDef(
            State.FAULT_REACTION_DISABLED,
            "fault reaction, was disabled",
            "A fault came up while the power stage was off.",
            "The emergency message tells.",
            _RESET,
        ),
        CodeDef(
            State.FAULT_REACTION_ENABLED,
            "fault reaction, was enabled",
            "A fault came up while the drive was enabled; it stops by the class of the fault.",
            "The emergency message tells.",
            _RESET,
        ),
        CodeDef(State.FAULT, "fault", "Power stage off because of a fault.", "The emergency message tells.", _RESET),
    )
}
"""Each state in words, with cause and cure."""


class Command(IntEnum):
    """Commands of the controlword, each as the word to write: always a constant, never read, changed and written."""

    DISABLE_VOLTAGE = 0x0000
    QUICK_STOP = 0x0002
    SHUTDOWN = 0x0006
    SWITCH_ON = 0x0007
    """Also "disable operation" when written in Operation Enabled."""
    ENABLE_OPERATION = 0x000F
    FAULT_RESET = 0x0080
    """Counts as the rising edge of bit 7 only: a word without it has to come before."""

    @property
    def words(self) -> str:
        """The command's name for people: ``enable operation``."""
        return self.name.lower().replace("_", " ")


COMMAND_PATTERNS: tuple[tuple[int, int, Command], ...] = (
    (0x80, 0x80, Command.FAULT_RESET),
    (0x82, 0x00, Command.DISABLE_VOLTAGE),
    (0x86, 0x02, Command.QUICK_STOP),
    (0x87, 0x06, Command.SHUTDOWN),
    (0x8F, 0x07, Command.SWITCH_ON),
    (0x8F, 0x0F, Command.ENABLE_OPERATION),
)
"""Mask, value under the mask, command: every controlword fits exactly one."""

# Words that start a motion of the modes with a profile: Enable Operation with the bits of the mode.
PPM_ABSOLUTE_AT_ONCE = 0x003F
PPM_RELATIVE_AT_ONCE = 0x007F
HMM_START = 0x001F


def command_of(controlword: int) -> Command:
    """The command in a controlword, whatever its mode bits say."""
    return next(command for mask, value, command in COMMAND_PATTERNS if controlword & mask == value)


@dataclass(frozen=True, slots=True)
class Transition:
    """One arrow of the state diagram.

    Attributes:
        number: its number in the manual.
        source, target: states at its ends.
        command: what triggers it; None where the drive goes by itself.
        event: what happens, for people.
    """

    number: int
    source: State
    target: State
    command: Command | None
    event: str


def _by_command(number: int, source: State, target: State, *commands: Command) -> tuple[Transition, ...]:
    return tuple(Transition(number, source, target, command, command.words) for command in commands)


TRANSITIONS: tuple[Transition, ...] = (
    Transition(0, State.START, State.NOT_READY_TO_SWITCH_ON, None, "power-up or NMT reset node"),
    Transition(1, State.NOT_READY_TO_SWITCH_ON, State.SWITCH_ON_DISABLED, None, "initialised"),
    *_by_command(2, State.SWITCH_ON_DISABLED, State.READY_TO_SWITCH_ON, Command.SHUTDOWN),
    *_by_command(3, State.READY_TO_SWITCH_ON, State.SWITCHED_ON, Command.SWITCH_ON),
    *_by_command(4, State.SWITCHED_ON, State.REFRESH, Command.ENABLE_OPERATION),
    Transition(20, State.REFRESH, State.OPERATION_ENABLED, None, "power stage refreshed"),
    *_by_command(5, State.OPERATION_ENABLED, State.SWITCHED_ON, Command.SWITCH_ON),
    *_by_command(6, State.SWITCHED_ON, State.READY_TO_SWITCH_ON, Command.SHUTDOWN),
    *_by_command(7, State.READY_TO_SWITCH_ON, State.SWITCH_ON_DISABLED, Command.DISABLE_VOLTAGE, Command.QUICK_STOP),
    *_by_command(8, State.OPERATION_ENABLED, State.READY_TO_SWITCH_ON, Command.SHUTDOWN),
    *_by_command(9, State.OPERATION_ENABLED, State.SWITCH_ON_DISABLED, Command.DISABLE_VOLTAGE),
    *_by_command(10, State.SWITCHED_ON, State.SWITCH_ON_DISABLED, Command.DISABLE_VOLTAGE, Command.QUICK_STOP),
    *_by_command(11, State.OPERATION_ENABLED, State.QUICK_STOP_ACTIVE, Command.QUICK_STOP),
    *_by_command(12, State.QUICK_STOP_ACTIVE, State.SWITCH_ON_DISABLED, Command.DISABLE_VOLTAGE),
    Transition(14, State.FAULT_REACTION_DISABLED, State.FAULT, None, "fault reaction done"),
    *_by_command(15, State.FAULT, State.SWITCH_ON_DISABLED, Command.FAULT_RESET),
    *_by_command(16, State.QUICK_STOP_ACTIVE, State.OPERATION_ENABLED, Command.ENABLE_OPERATION),
    Transition(18, State.FAULT_REACTION_ENABLED, State.FAULT, None, "fault reaction done"),
)
"""Arrows that a command or the drive's own progress takes.

From everywhere, too: a fault with the power stage off leads to FAULT_REACTION_DISABLED (13), with the power stage on to
FAULT_REACTION_ENABLED (17), an NMT reset to START (19).
"""


def _first_steps(target: State) -> dict[State, Transition]:
    """The first arrow of a shortest way to the target, from each state that has one (breadth first, backwards)."""
    steps: dict[State, Transition] = {}
    frontier = [target]
    while frontier:
        arriving = [arrow for arrow in TRANSITIONS if arrow.target in frontier and arrow.source != target]
        frontier = []
        for arrow in arriving:
            if arrow.source not in steps:
                steps[arrow.source] = arrow
                frontier.append(arrow.source)
    return steps


_FIRST_STEPS = {target: _first_steps(target) for target in State}


def controlword_to(target: State, state: State) -> int | None:
    """The next controlword on the shortest way from a state to another.

    Args:
        target: the state wanted, for instance ``State.OPERATION_ENABLED``.
        state: the state the drive is in.

    Returns:
        The word to write now; None where there is nothing to write: the drive is there, gets on by itself (Refresh,
        fault reaction), or no command leads there. For a fault reset, bit 7 must have been 0 in the word before.
    """
    step = _FIRST_STEPS[target].get(state)
    return None if step is None or step.command is None else int(step.command)


STATUSWORD_BITS: tuple[BitDef, ...] = (
    BitDef(0, "ready_to_switch_on", "ready to switch on", "not ready to switch on"),
    BitDef(1, "switched_on", "switched on", "not switched on"),
    BitDef(2, "operation_enabled", "operation enabled", "operation not enabled"),
    BitDef(3, "fault", "fault", "no fault"),
    BitDef(4, "voltage_enabled", "power stage on", "power stage off"),
    BitDef(5, "no_quick_stop", "not in quick stop", "quick stop, or not ready"),
    BitDef(6, "switch_on_disabled", "switch on disabled", "switch on allowed"),
    BitDef(7, "warning", "warning", "no warning"),
    BitDef(8, "current_offset_measured", "current offset measured", "current offset not measured yet"),
    BitDef(9, "remote", "NMT operational (later firmware)", "no meaning in firmware 2011h"),
    BitDef(10, "target_reached", "target reached, or standstill after halt", "target not reached"),
    BitDef(11, "internal_limit", "internal limit active (later firmware)", "no meaning in firmware 2011h"),
    BitDef(12, "set_point_acknowledged", "set-point acknowledged", "ready for a set-point", "1"),
    BitDef(12, "homing_attained", "homing attained", "homing not attained", "6"),
    BitDef(12, "speed_zero", "speed is zero", "speed is not zero", "3"),
    BitDef(13, "following_error", "following error", "no following error", "1"),
    BitDef(13, "homing_error", "homing error", "no homing error", "6"),
    BitDef(14, "refresh", "power stage refresh", "no power stage refresh"),
    BitDef(15, "referenced", "position referenced to home", "position not referenced"),
)

CONTROLWORD_BITS: tuple[BitDef, ...] = (
    BitDef(0, "switch_on", "switch on", "do not switch on"),
    BitDef(1, "enable_voltage", "enable voltage", "disable voltage: power stage off, the axis coasts"),
    BitDef(2, "no_quick_stop", "no quick stop", "quick stop"),
    BitDef(3, "enable_operation", "enable operation", "do not enable operation"),
    BitDef(4, "new_set_point", "new set-point (rising edge)", "no new set-point", "1"),
    BitDef(4, "start_homing", "start homing (rising edge)", "no homing start", "6"),
    BitDef(5, "change_immediately", "take the set-point at once", "finish the present set-point first", "1"),
    BitDef(6, "relative", "target is relative", "target is absolute", "1"),
    BitDef(7, "fault_reset", "fault reset (rising edge)", "no fault reset"),
    BitDef(8, "halt", "halt: stop by the deceleration ramp, stay enabled", "no halt"),
)


class Mode(IntEnum):
    """Modes of operation (objects 0x6060 and 0x6061)."""

    HOMING = 6
    PROFILE_VELOCITY = 3
    PROFILE_POSITION = 1
    POSITION = -1
    VELOCITY = -2
    CURRENT = -3
    DIAGNOSTIC = -4
    MASTER_ENCODER = -5
    STEP_DIRECTION = -6

    @property
    def words(self) -> str:
        """The mode's name for people: ``profile velocity``."""
        return self.name.lower().replace("_", " ")
