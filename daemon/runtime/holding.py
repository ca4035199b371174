"""Who has the robot: the leases of clients, and what becomes of their motions when a lease ends or is taken over."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Final

from canhelm.errors import Refused
from daemon.runtime.events import EventLog
from daemon.runtime.leases import Leases
from daemon.runtime.motions import Motion

NO_DETAILS: Final[Mapping[str, Any]] = {}


class Holding:
    """The robot in the hands of one client at a time.

    Args:
        motions: those under way, by their number.
        log: hears of what ends, and who takes over.
        timeout_s: how long a lease lives without a renewal.

    Attributes:
        leases: of all clients.
        on_end: called with each lease that is over, by hanging up or running out.
    """

    def __init__(self, motions: Mapping[str, Motion], log: EventLog, timeout_s: float) -> None:
        self.leases = Leases(timeout_s)
        self.on_end: list[Callable[[str], None]] = []
        self._motions = motions
        self._log = log

    def open(self, client: str, details: Mapping[str, Any] = NO_DETAILS) -> str:
        """A lease for a client that is about to move something; returns its id."""
        return self.leases.open(client, details)

    def close(self, lease: str, reason: str = "its client hung up") -> None:
        """The client is gone: its motions stop."""
        self._release(lease, reason)
        self.leases.close(lease)

    async def end(self, lease: str, reason: str) -> None:
        """The client lets go: its motions stop; returns when they have ended, streamed ones among them."""
        held = [motion for motion in self._motions.values() if motion.lease == lease]
        self.close(lease, reason)
        for motion in held:
            await motion.closed.wait()

    def watch(self) -> None:
        """Stop the motions of leases that have run out."""
        for lease, client in self.leases.expired():
            self._release(lease, f"the lease of {client} ran out")

    @property
    def holder(self) -> str | None:
        """The lease that has the robot; None where nobody has."""
        return self.leases.holder(motion.lease for motion in self._motions.values())

    def told(self) -> dict[str, Any] | None:
        """Who has the robot, for programs; None where nobody has."""
        if self.holder is not None:
            return self.leases.told(self.holder)
        handed = self._handed()
        return {"client": handed} if handed else None

    def require_robot(self, lease: str | None) -> None:
        """Raise Refused where another lease than this one has the robot."""
        holder = self.holder
        if holder is not None and holder != lease:
            raise Refused(
                f"{self.leases.client(holder)} has the robot",
                remedy="wait, or take it over with --takeover (lease.take); `canhelm stop` works at any time",
            )

    async def take(self, lease: str) -> str | None:
        """Take the robot over: what others move comes to rest, and they move nothing while this lease lives.

        Returns:
            Who had it, for people: a client, or the daemon with what was handed to it; None where nobody else had.

        Raises:
            Refused: the lease has run out.
        """
        taker, holder = self.leases.client(lease), self.holder
        before = self.leases.client(holder) if holder not in (None, lease) else self._handed()
        self.leases.take(lease)
        if before is not None:
            self._log.add("warning", "supervisor", f"{taker} has taken the robot over from {before}")
        others = [motion for motion in self._motions.values() if motion.lease != lease]
        for motion in others:
            motion.stop(f"{taker} has taken the robot over")
        for motion in others:
            await motion.closed.wait()
        return before

    def hand(self, motion: Motion) -> str:
        """In whose hands a motion is, for people."""
        if motion.lease is None:
            return "handed to the daemon"
        return f"held by {self.leases.client(motion.lease)}" if self.leases.alive(motion.lease) else "coming to rest"

    def _handed(self) -> str | None:
        """The daemon with the motions that were handed to it, for people; None where there are none."""
        handed = [f"motion {motion.identity}" for motion in self._motions.values() if motion.lease is None]
        return f"the daemon ({', '.join(handed)})" if handed else None

    def _release(self, lease: str, reason: str) -> None:
        for motion in list(self._motions.values()):
            if motion.lease == lease and not motion.stop_reason:
                self._log.add("warning", "supervisor", f"motion {motion.identity} ({motion.kind}) stops: {reason}")
                motion.stop(reason)
        for told in self.on_end:
            told(lease)
