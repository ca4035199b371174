"""Waiting for statuswords: futures that cyclic readings resolve, and what to say when the wanted one does not come."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager

from canhelm.errors import CanhelmError, Refused, Timeout
from drivers.epos.state_machine import STATE_MASK, STATUSWORD_BITS, State, state_of

TRANSITION_S = 1.0
"""Time that one step to another state may take."""


class Turns:
    """Transitions of one drive, one at a time; a stop ends the one under way and those that wait for their turn.

    Args:
        who: the drive for people.
        node: its node id.
    """

    def __init__(self, who: str, node: int) -> None:
        self._who = who
        self._node = node
        self._lock = asyncio.Lock()
        self._stops = 0
        self._asked_at = 0

    @asynccontextmanager
    async def take(self) -> AsyncIterator[None]:
        """Have the turn. Raises Refused where a stop came while waiting for it."""
        asked_at = self._stops
        async with self._lock:
            self._asked_at = asked_at
            self.require_unstopped()
            yield

    def stop(self) -> None:
        """Whatever was asked for until now goes no further."""
        self._stops += 1

    @property
    def stopped(self) -> bool:
        """Whether a stop came since the present transition was asked for."""
        return self._stops != self._asked_at

    def require_unstopped(self) -> None:
        """Raise Refused where a stop came since the present transition was asked for."""
        if self.stopped:
            raise Refused(f"{self._who} was stopped in the meantime", node=self._node, remedy="enable it again")


class StatuswordWaiters:
    """Everybody who waits for a statusword of one drive.

    Args:
        who: the drive for people.
        node: its node id.
    """

    def __init__(self, who: str, node: int) -> None:
        self._who = who
        self._node = node
        self._waiters: list[tuple[Callable[[int], bool], asyncio.Future[None]]] = []
        self._last = 0
        self._last_s = 0.0

    def __bool__(self) -> bool:
        return bool(self._waiters)

    def take(self, statusword: int) -> None:
        """Show a statusword to everybody who waits."""
        self._last = statusword
        self._last_s = asyncio.get_running_loop().time()
        for done, waiter in self._waiters:
            if not waiter.done() and done(statusword):
                waiter.set_result(None)

    def interrupt(self, error: CanhelmError) -> None:
        """End every wait with an error."""
        for _, waiter in self._waiters:
            if not waiter.done():
                waiter.set_exception(error)

    async def reach(
        self, done: Callable[[int], bool], wanted: str, target: State | None = None, within_s: float = TRANSITION_S
    ) -> None:
        """Wait for a statusword.

        Args:
            done: judges each statusword that comes.
            wanted: what is waited for, for the message.
            target: the state on the way to which the drive is, to name the bits that differ.
            within_s: time in which it has to come.

        Raises:
            Timeout: it did not come in that time.
            CanhelmError: what :meth:`interrupt` was called with.
        """
        loop = asyncio.get_running_loop()
        entry = (done, loop.create_future())
        begun_s = loop.time()
        self._waiters.append(entry)
        try:
            async with asyncio.timeout(within_s):
                await entry[1]
        except TimeoutError:
            raise self._not_reached(wanted, target, within_s, silent=self._last_s <= begun_s) from None
        finally:
            self._waiters.remove(entry)

    def _not_reached(self, wanted: str, target: State | None, within_s: float, *, silent: bool) -> Timeout:
        message = f"{self._who} did not reach {wanted} within {within_s:g} s: "
        remedy = "reset and try again; `canhelm explain` tells the bits of a statusword"
        if silent:
            message += "no reading came from it"
            remedy = "see in `canhelm status` whether the control cycle runs"
        else:
            state = state_of(self._last)
            message += (
                f"it is in {state.words if state is not None else 'no known state'} (statusword 0x{self._last:04X})"
            )
            message += f", {differing_bits(self._last, target)}" if target is not None else ""
        return Timeout(message, node=self._node, object="0x6041", value=self._last, remedy=remedy)


def differing_bits(statusword: int, target: State) -> str:
    """The bits in which a statusword differs from a state, in words."""
    differ = (statusword ^ target) & STATE_MASK
    names = [f"bit {bit.bit} ({bit.name})" for bit in STATUSWORD_BITS if not bit.modes and differ >> bit.bit & 1]
    return "which differs in " + " and ".join(names) if names else "in which no bit is missing"
