"""How late what a page sends has arrived: a network that hung hands out old commands when it is back."""

from __future__ import annotations

import math
from typing import Any, Final

from canhelm.errors import Refused
from daemon.api.methods import METHODS

LATE_S: Final = 1.0
"""On the way longer than the quickest message by this much, a command is too old to move anything."""
_REMEMBERED_S: Final = 30.0
"""How long the quickest message counts, at least; clocks that drift by 0.01 % differ by 3 ms then."""
_LAST_MS: Final = 8.64e15
"""Of the times that JavaScript knows (ECMA-262, time values)."""
_LETTING_MOVE: Final = frozenset({"motor.enable", "brake.release", "reset", "lease.take"})


class Lateness:
    """Judges each message of one page against the quickest one before it; the clocks need not agree.

    Attributes:
        late_s: of the newest message.
    """

    def __init__(self) -> None:
        self.late_s = 0.0
        self._quickest_s = self._quickest_before_s = math.inf
        self._since_s = -math.inf

    def look(self, sent_ms: Any, now_s: float) -> None:
        """A message has come.

        Args:
            sent_ms: when it was sent by the page's clock; anything but a time tells nothing.
            now_s: when it came by the station's clock.
        """
        if isinstance(sent_ms, bool) or not isinstance(sent_ms, int | float) or not abs(sent_ms) < _LAST_MS:
            self.late_s = 0.0
            return
        if now_s - self._since_s > _REMEMBERED_S:
            self._since_s, self._quickest_before_s, self._quickest_s = now_s, self._quickest_s, math.inf
        took_s = now_s - sent_ms / 1e3
        self._quickest_s = min(self._quickest_s, took_s)
        self.late_s = took_s - min(self._quickest_s, self._quickest_before_s)

    def refusal(self, name: str) -> Refused | None:
        """Why the newest message may not call a method that moves something, or lets it move; None where it may."""
        method = METHODS.get(name)
        if self.late_s <= LATE_S or method is None or not (method.needs_lease or name in _LETTING_MOVE):
            return None
        told = f"{name} was on its way for {self.late_s:.1f} s: nothing moves by a command that old"
        return Refused(told, remedy="look at the robot, then ask again")
