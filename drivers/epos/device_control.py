"""A drive through its states, out of a fault, into a mode (maxon EPOS Firmware Specification 8.1 and 14.1.49)."""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from typing import TYPE_CHECKING

from canhelm.errors import Aborted, DeviceFault, NodeAbsent, Timeout
from drivers.canopen.codes import NmtCommand
from drivers.contract import DriveState
from drivers.epos.configure import ZERO_TARGETS
from drivers.epos.objects import OBJECTS
from drivers.epos.state_machine import Command, Mode, State, controlword_to, state_of

if TYPE_CHECKING:
    from drivers.epos.drive import EposDrive

Commander = Callable[[int], None]

_FAULTS = (State.FAULT, State.FAULT_REACTION_DISABLED, State.FAULT_REACTION_ENABLED)
_DRIVE_STATES: dict[State | None, DriveState] = {
    **dict.fromkeys(_FAULTS, DriveState.FAULT),
    State.START: DriveState.DISABLED,
    State.NOT_READY_TO_SWITCH_ON: DriveState.DISABLED,
    State.SWITCH_ON_DISABLED: DriveState.DISABLED,
    State.READY_TO_SWITCH_ON: DriveState.ENABLING,
    State.SWITCHED_ON: DriveState.ENABLING,
    State.REFRESH: DriveState.ENABLING,
    State.MEASURE_INIT: DriveState.ENABLING,
    State.OPERATION_ENABLED: DriveState.ENABLED,
    State.QUICK_STOP_ACTIVE: DriveState.QUICK_STOP,
    None: DriveState.UNKNOWN,
}


def drive_state(statusword: int) -> DriveState:
    """What a statusword means to whoever uses the drive."""
    return _DRIVE_STATES[state_of(statusword)]


def is_powered(statusword: int) -> bool:
    """Whether a statusword may be that of a drive with power."""
    return drive_state(statusword) not in (DriveState.DISABLED, DriveState.FAULT)


async def walk_to(drive: EposDrive, target: State, command: Commander) -> None:
    """Command one transition after the other until a state is reached.

    Args:
        command: sends a controlword.

    Raises:
        DeviceFault: the drive is in fault, or falls into it.
        Timeout: a transition did not come.
        Refused: a stop came in between.
    """
    while (state := state_of(drive.statusword)) is not target:
        if drive.state is DriveState.FAULT:
            raise drive.device_fault()
        drive.turns.require_unstopped()
        controlword = None if state is None else controlword_to(target, state)
        if controlword is not None:
            command(controlword)
        await _leave(drive, state, target)


async def _leave(drive: EposDrive, state: State | None, target: State) -> None:
    await drive.waiters.reach(lambda statusword: state_of(statusword) is not state, target.words, target)


async def insist_on_stop(drive: EposDrive, within_s: float) -> None:
    """See that a drive takes its quick stop; one that does not is told once more, by SDO.

    Args:
        within_s: time in which its statusword has to show that PDOs have reached it.

    Raises:
        DeviceFault: it had to be told by SDO.
        NodeAbsent, Timeout, Aborted: it cannot be told by SDO either.
    """
    if drive.state is not DriveState.ENABLED:
        return
    try:
        await drive.waiters.reach(lambda word: drive_state(word) is not DriveState.ENABLED, "a stop", within_s=within_s)
    except Timeout:
        await drive.write((OBJECTS["controlword"], Command.QUICK_STOP))
        raise _deaf(drive, "was stopped by SDO") from None


async def switch_off_otherwise(drive: EposDrive) -> None:
    """Switch off a drive that does not do so by PDO: by SDO; where that fails, too, its node is restarted.

    Raises:
        DeviceFault: always, as something is wrong with a drive that needs this.
    """
    try:
        await drive.write((OBJECTS["controlword"], Command.DISABLE_VOLTAGE))
        state = state_of(await drive.sdo.read_int(OBJECTS["statusword"]))
    except (Aborted, NodeAbsent, Timeout):
        state = None
    if state is None or state.power_stage_on:
        drive.master.send_nmt(NmtCommand.RESET_NODE, drive.node)
        raise _deaf(drive, "was switched off by restarting its node")
    with contextlib.suppress(Timeout):  # until its readings tell so, too, which may be late
        late_s = drive.master.network.sdo_timeout_s
        await drive.waiters.reach(lambda word: not is_powered(word), "power stage off", within_s=late_s)
    raise _deaf(drive, "was switched off by SDO")


def _deaf(drive: EposDrive, what: str) -> DeviceFault:
    remedy = f"look at its PDOs: `canhelm config diff {drive.name}`, `canhelm nmt reset {drive.name}`"
    return DeviceFault(f"{drive.who} does not follow its PDOs and {what}", node=drive.node, remedy=remedy)


async def reset_fault(drive: EposDrive, command: Commander) -> None:
    """Clear a fault by a rising edge of the fault reset bit. Raises DeviceFault where the drive stays in fault."""
    command(Command.DISABLE_VOLTAGE)
    readings = iter((False, True))
    await drive.waiters.reach(lambda _: next(readings), "a cycle with the fault reset bit clear")
    command(Command.FAULT_RESET)
    try:
        await drive.waiters.reach(lambda statusword: state_of(statusword) not in _FAULTS, "the end of its fault")
    except Timeout:
        raise drive.device_fault() from None
    finally:
        command(Command.DISABLE_VOLTAGE)


async def enter_mode(drive: EposDrive, mode: Mode, command: Commander) -> None:
    """Write zero targets, then the mode, and prove it.

    Args:
        command: sends a controlword.

    Raises:
        DeviceFault: the drive does not take it.
        Refused: a stop came in between.
    """
    await drive.write(*ZERO_TARGETS)
    drive.turns.require_unstopped()
    if drive.state is DriveState.ENABLED:
        command(Command.ENABLE_OPERATION)
    await drive.write((OBJECTS["mode_of_operation"], mode))
    found = await drive.sdo.read_int(OBJECTS["mode_of_operation_display"])
    if found != mode:
        raise DeviceFault(
            f"{drive.who} stays in mode {found} instead of {int(mode)} ({mode.words})",
            node=drive.node,
            object="0x6061",
            value=found,
            limit=int(mode),
            remedy="try again at rest; switch the drive off and on if that does not help",
        )
