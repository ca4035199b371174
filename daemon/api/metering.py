"""How much a client may ask for in a second, and how long it is left waiting where that is not enough."""

from __future__ import annotations

from collections import defaultdict, deque
from typing import Final

REQUESTS_PER_S: Final = 250
"""Requests of one connection, in the long run; as many again may come at once."""
BYTES_PER_S: Final = 4_000_000
"""Bytes of one connection, likewise."""
REFUSED_PER_S: Final = 2000
"""Requests beyond those that are read and refused in a second; more are left in the socket meanwhile."""
REFUSED_BYTES_PER_S: Final = 10_000_000
"""Bytes of such requests, likewise."""

LEAST_WAIT_S: Final = 0.001


class Allowance:
    """Something that comes at a rate, and of which a second's worth can be saved up.

    Args:
        per_s: how much comes in a second.
        now_s: loop time.
    """

    def __init__(self, per_s: float, now_s: float) -> None:
        self._per_s = per_s
        self._left = per_s
        self._at_s = now_s

    def lacking_s(self, amount: float, now_s: float) -> float:
        """How long it takes until there is so much; 0 where there is."""
        self._left = min(self._per_s, self._left + (now_s - self._at_s) * self._per_s)
        self._at_s = now_s
        return max(0.0, (amount - self._left) / self._per_s)

    def take(self, amount: float) -> None:
        """Use so much of it."""
        self._left -= amount


class Meter:
    """What one connection has asked for.

    Args:
        now_s: loop time.
    """

    def __init__(self, now_s: float) -> None:
        self._requests = Allowance(REQUESTS_PER_S, now_s)
        self._bytes = Allowance(BYTES_PER_S, now_s)
        self._pause_s = 0.0

    def wait_s(self, size: int, now_s: float) -> float:
        """How long a request has to wait; one that need not wait is counted.

        Args:
            size: of its line, in bytes.
            now_s: loop time.
        """
        wait_s = max(self._requests.lacking_s(1.0, now_s), self._bytes.lacking_s(size, now_s))
        if wait_s:
            return max(wait_s, LEAST_WAIT_S)
        self._requests.take(1.0)
        self._bytes.take(size)
        return 0.0

    def refuse(self, size: int) -> None:
        """A request was refused instead."""
        self._pause_s += max(1.0 / REFUSED_PER_S, size / REFUSED_BYTES_PER_S)

    def pause_s(self) -> float:
        """How long nothing more is read, for what was refused since this was asked."""
        pause_s, self._pause_s = self._pause_s, 0.0
        return pause_s


class Meters:
    """Meters of all connections: who hangs up and comes back finds what was left."""

    def __init__(self) -> None:
        self._unused: defaultdict[int, deque[Meter]] = defaultdict(deque)

    def lend(self, user: int, now_s: float) -> Meter:
        """The one of a user's former connections that has been unused for longest; a new one where there is none."""
        unused = self._unused[user]
        return unused.popleft() if unused else Meter(now_s)

    def give_back(self, user: int, meter: Meter) -> None:
        """Its connection has ended."""
        self._unused[user].append(meter)
