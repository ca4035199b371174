"""Leases: a motion belongs to somebody alive, who renews; one of them has the robot at a time."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from canhelm.errors import Refused
from daemon.runtime.clock import outside_s


@dataclass(slots=True)
class Lease:
    """One client's hold on its motions.

    Attributes:
        client: who holds it, for people.
        expires_s: time at which it runs out unless renewed, see :func:`daemon.runtime.clock.outside_s`.
        details: of the client, for programs.
    """

    client: str
    expires_s: float
    details: Mapping[str, Any]


class Leases:
    """All leases; the control cycle asks which have run out.

    Args:
        timeout_s: how long a lease lives without a renewal.
    """

    def __init__(self, timeout_s: float) -> None:
        self.timeout_s = timeout_s
        self._leases: dict[str, Lease] = {}
        self._numbers = itertools.count(1)
        self._taken: str | None = None

    def open(self, client: str, details: Mapping[str, Any]) -> str:
        """A new lease for a client; returns its id."""
        lease = f"lease-{next(self._numbers)}"
        self._leases[lease] = Lease(client, outside_s() + self.timeout_s, details)
        return lease

    def take(self, lease: str) -> None:
        """Let a lease have the robot until it is over, or another one takes it."""
        self._taken = lease

    def holder(self, motions: Iterable[str | None]) -> str | None:
        """The lease that has the robot: the one that took it, else the one of a motion; None where it is free.

        Args:
            motions: the leases of the motions that run.
        """
        return next((lease for lease in (self._taken, *motions) if lease is not None and self.alive(lease)), None)

    def alive(self, lease: str) -> bool:
        """Whether a lease is not over."""
        return lease in self._leases

    def told(self, lease: str) -> dict[str, Any]:
        """Who holds a lease, for programs. Raises Refused where it has run out or never was."""
        known = self._known(lease)
        return {"client": known.client, "lease": lease, **known.details}

    def renew(self, lease: str) -> None:
        """Keep a lease alive. Raises Refused where it has run out or never was."""
        self._known(lease).expires_s = outside_s() + self.timeout_s

    def client(self, lease: str) -> str:
        """Who holds a lease. Raises Refused where it has run out or never was."""
        return self._known(lease).client

    def close(self, lease: str) -> None:
        """End a lease; its motions are the caller's to stop."""
        self._leases.pop(lease, None)

    def expired(self) -> list[tuple[str, str]]:
        """Take out the leases that have run out: their ids and clients."""
        now_s = outside_s()
        gone = [(lease, entry.client) for lease, entry in self._leases.items() if entry.expires_s < now_s]
        for lease, _ in gone:
            del self._leases[lease]
        return gone

    def _known(self, lease: str) -> Lease:
        try:
            return self._leases[lease]
        except KeyError:
            raise Refused(
                f"{lease} has run out or was never opened",
                remedy="renew a lease at least every 0.5 s while a motion runs, and command the motion again",
            ) from None
