"""Device control of the simulated EPOS 24/5: states, controlword, faults (maxon EPOS Firmware Specification 8.1)."""

from __future__ import annotations

import asyncio
from typing import Protocol

from drivers.epos.state_machine import State

_REFRESH_S = 0.005
"""Time that the power stage's refresh takes (assumed)."""
_RESET = 0x80

_Arrow = tuple[int, int, State]
_SHUTDOWN = (0x87, 0x06)
_SWITCH_ON = (0x87, 0x07)
_ENABLE = (0x8F, 0x0F)
_DISABLE = (0x8F, 0x07)
_QUICK_STOP = (0x86, 0x02)
_NO_VOLTAGE = (0x82, 0x00)

_ARROWS: dict[State, tuple[_Arrow, ...]] = {
    State.SWITCH_ON_DISABLED: ((*_SHUTDOWN, State.READY_TO_SWITCH_ON),),
    State.READY_TO_SWITCH_ON: (
        (*_SWITCH_ON, State.SWITCHED_ON),
        (*_NO_VOLTAGE, State.SWITCH_ON_DISABLED),
        (*_QUICK_STOP, State.SWITCH_ON_DISABLED),
    ),
    State.SWITCHED_ON: (
        (*_ENABLE, State.REFRESH),
        (*_SHUTDOWN, State.READY_TO_SWITCH_ON),
        (*_NO_VOLTAGE, State.SWITCH_ON_DISABLED),
        (*_QUICK_STOP, State.SWITCH_ON_DISABLED),
    ),
    State.OPERATION_ENABLED: (
        (*_DISABLE, State.SWITCHED_ON),
        (*_SHUTDOWN, State.READY_TO_SWITCH_ON),
        (*_NO_VOLTAGE, State.SWITCH_ON_DISABLED),
        (*_QUICK_STOP, State.QUICK_STOP_ACTIVE),
    ),
    State.QUICK_STOP_ACTIVE: (
        (*_NO_VOLTAGE, State.SWITCH_ON_DISABLED),
        (*_ENABLE, State.OPERATION_ENABLED),
    ),
}
"""Per state: mask, value of the controlword under it, next state."""


class PowerStage(Protocol):
    """What device control switches."""

    def start(self, now_s: float) -> None:
        """Power stage on."""
        ...

    def stop(self, now_s: float) -> None:
        """Power stage off, the axis coasts."""
        ...

    def quick_stop(self) -> None:
        """Brake by the quick-stop ramp."""
        ...

    def resume(self) -> None:
        """Leave the quick stop."""
        ...


class DeviceControl:
    """The state machine of one drive.

    The word written last keeps acting: what it asks for is done as soon as the state allows it, also after Refresh.

    Args:
        stage: the power stage with its motion control.

    Attributes:
        state: present state.
        causes: EMCY codes whose cause persists; a fault is not reset before they are gone.
    """

    def __init__(self, stage: PowerStage) -> None:
        self.state = State.START
        self.causes: set[int] = set()
        self._stage = stage
        self._word = 0
        self._refresh: asyncio.TimerHandle | None = None

    def restart(self) -> None:
        """Power lost or NMT reset: power stage off, state Start."""
        self._word = 0
        self._go(State.START)
        self.causes.clear()

    def initialised(self) -> None:
        """The drive has booted."""
        self._go(State.SWITCH_ON_DISABLED)

    def command(self, word: int) -> None:
        """Take a controlword."""
        rising = word & ~self._word
        self._word = word
        if self.state is State.FAULT and rising & _RESET and not self.causes:
            self._go(State.SWITCH_ON_DISABLED)
        self._obey()

    def _obey(self) -> None:
        following: State | None = self.state
        while following is not None:
            if following is not self.state:
                self._go(following)
            following = next(
                (target for mask, value, target in _ARROWS.get(self.state, ()) if self._word & mask == value), None
            )

    def _go(self, state: State) -> None:
        left, self.state = self.state, state
        loop = asyncio.get_running_loop()
        if self._refresh is not None:
            self._refresh.cancel()
            self._refresh = None
        if state is State.REFRESH:
            self._refresh = loop.call_later(_REFRESH_S, self._refreshed)
        elif state is State.OPERATION_ENABLED:
            if left is State.QUICK_STOP_ACTIVE:
                self._stage.resume()
            else:
                self._stage.start(loop.time())
        elif state in (State.QUICK_STOP_ACTIVE, State.FAULT_REACTION_ENABLED):
            self._stage.quick_stop()
        else:
            self._stage.stop(loop.time())

    def _refreshed(self) -> None:
        self._refresh = None
        self._go(State.OPERATION_ENABLED)
        self._obey()

    def fault(self, reaction: str) -> None:
        """A fault of class ``D`` (power stage off at once) or ``Q`` (quick-stop ramp first)."""
        if self.state is State.START:
            return
        if reaction == "Q" and self.state.power_stage_on:
            if self.state is not State.FAULT_REACTION_ENABLED:
                self._go(State.FAULT_REACTION_ENABLED)
        else:
            self._go(State.FAULT)

    def ramp_ended(self) -> None:
        """The quick-stop ramp has ended: a fault reaction is done, a commanded quick stop stays where it is."""
        if self.state is State.FAULT_REACTION_ENABLED:
            self._go(State.FAULT)
