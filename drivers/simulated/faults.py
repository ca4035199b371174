"""Faults in a simulated network: when each begins and ends, and what has become of it."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterable
from random import Random
from typing import Any

import msgspec

from canhelm.errors import UsageError
from drivers.simulated.computer_faults import COMPUTER_MAKERS
from drivers.simulated.device_faults import MAKERS, Effect, Site
from drivers.simulated.frame_faults import Choice, FaultySdo, FrameFault, FrameFaults, SdoFault
from profiles.faults import Fault, PlacedFault

_MAKERS = MAKERS | COMPUTER_MAKERS
_SDO = ("sdo_abort", "sdo_timeout")


class SetFault:
    """A fault that somebody has set.

    Args:
        number: by which it is called.
        fault: what it is.
        effect: what it does.
        choice: which frames or requests it strikes; None for a fault that strikes once, as it begins.
    """

    def __init__(self, number: int, fault: Fault, effect: Effect, choice: Choice | None) -> None:
        self.number = number
        self.fault = fault
        self.state = "waiting"
        self._effect = effect
        self._choice = choice
        self._begun = False

    @property
    def struck(self) -> int:
        """How often it has struck."""
        return int(self._begun) if self._choice is None else self._choice.struck

    @property
    def lasts_s(self) -> float | None:
        """How long it acts; None: until it is cleared."""
        return self._effect.lasts_s if self._effect.lasts_s is not None else self.fault.for_s

    def begin(self) -> None:
        """Let it act. No effect on one that acts already, or is over."""
        if self.state == "waiting":
            self.state, self._begun = "acting", True
            self._effect.begin()

    def end(self) -> None:
        """Take it away."""
        if self.state == "acting":
            self._effect.end()
        self.state = "over"

    def told(self) -> dict[str, Any]:
        """Number, state and what was asked for, for people and programs."""
        exhausted = self._choice is not None and self._choice.exhausted
        state = "over" if exhausted else self.state
        return {"fault": self.number, "state": state, "struck": self.struck, **msgspec.to_builtins(self.fault)}


class Faults:
    """All faults of one simulated network.

    Args:
        site: the network, its bus, and the way to the daemon.
        seed: of everything random in them.
    """

    def __init__(self, site: Site, seed: int) -> None:
        self._site = site
        self._seed = seed
        self._set: dict[int, SetFault] = {}
        self._newest = 0
        self._timers: set[asyncio.TimerHandle] = set()
        self._at_frame: dict[int, list[SetFault]] = {}
        self._frames = FrameFaults(site.medium, self._later, self._on_frame)
        self._sdo: dict[str, FaultySdo] = {}

    def load(self, placed: Iterable[PlacedFault]) -> None:
        """Set the faults of a file, as of now. Raises UsageError with file:line for one that cannot happen here."""
        for one in placed:
            try:
                self.add(one.fault)
            except UsageError as error:
                where = f"{one.place}: {error.message}"
                raise UsageError(where, object=error.object, value=error.value, remedy=error.remedy) from None

    def add(self, fault: Fault) -> dict[str, Any]:
        """Set a fault, as of now; what it is told as. Raises UsageError where it cannot happen in this network."""
        number = self._newest + 1
        effect, choice = self._make(fault, Random(f"{self._seed} fault {number}"))
        new = self._set[number] = SetFault(number, fault, effect, choice)
        self._newest = number
        if fault.at_frame is not None:
            self._at_frame.setdefault(self._frames.frames + fault.at_frame, []).append(new)
            self._count()
        elif fault.at_s > 0.0:
            self._later(fault.at_s, lambda: self._begin(new))
        else:
            self._begin(new)
        return new.told()

    def told(self) -> list[dict[str, Any]]:
        """All faults that were set, in order."""
        return [fault.told() for fault in self._set.values()]

    def clear(self, number: int | None = None) -> int:
        """Take away one fault, or all; how many. Raises UsageError: there is none of this number."""
        if number is not None and number not in self._set:
            known = ", ".join(map(str, self._set)) or "none"
            raise UsageError(f"there is no fault {number}", value=number, remedy=f"faults that were set: {known}")
        cleared = [number] if number is not None else list(self._set)
        for one in cleared:
            self._end(self._set.pop(one))
        return len(cleared)

    def close(self) -> None:
        """Let nothing begin or end any more."""
        for timer in self._timers:
            timer.cancel()
        self._at_frame.clear()
        self.clear()
        self._count()

    # When

    def _later(self, delay_s: float, act: Callable[[], None]) -> None:
        def run() -> None:
            self._timers.discard(timer)
            act()

        timer = asyncio.get_running_loop().call_later(delay_s, run)
        self._timers.add(timer)

    def _begin(self, fault: SetFault) -> None:
        self._site.network.catch_up()
        fault.begin()
        if fault.lasts_s is not None:
            self._later(fault.lasts_s, lambda: self._end(fault))

    def _end(self, fault: SetFault) -> None:
        self._site.network.catch_up()
        fault.end()

    def _on_frame(self, number: int) -> None:
        for fault in self._at_frame.pop(number, ()):
            self._begin(fault)
        self._count()

    def _count(self) -> None:
        """Count frames while a fault waits for one."""
        self._frames.counting = bool(self._at_frame)
        self._frames.look()

    # What

    def _make(self, fault: Fault, random: Random) -> tuple[Effect, Choice | None]:
        make = _MAKERS.get(fault.kind)
        if make is not None:
            return make(self._site, fault, random), None
        return self._sdo_fault(fault, random) if fault.kind in _SDO else self._frame_fault(fault, random)

    def _frame_fault(self, fault: Fault, random: Random) -> tuple[Effect, Choice]:
        node = self._site.network.node(fault.part) if fault.part is not None else None
        sender = node.port if node is not None and fault.kind == "silence" else None
        acting = FrameFault(fault, node.node_id if node is not None else None, sender, random)
        return Effect(lambda: self._frames.add(acting), lambda: self._frames.remove(acting)), acting.choice

    def _sdo_fault(self, fault: Fault, random: Random) -> tuple[Effect, Choice]:
        node, name = self._site.network.node(fault.part or ""), fault.part or ""
        acting = SdoFault(fault, random)

        def begin() -> None:
            if name not in self._sdo:
                self._sdo[name] = FaultySdo(node.answer_sdo)
                node.answer_sdo = self._sdo[name].answer
            self._sdo[name].acting.append(acting)

        return Effect(begin, lambda: self._sdo[name].acting.remove(acting)), acting.choice
