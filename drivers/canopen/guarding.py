"""Node guarding (CiA 301 7.2.8.3.2.1), paced by the control cycle: a cycle that hangs guards nobody.

A node is asked once a guard time, and all nodes in the same cycle: when their master dies, the drives of a vehicle then
find it out together. Else the first would brake, at the limit of their current, against those that still drive.

An answer that is missing is asked for again after :data:`REPEAT_AFTER` of the guard time; two unanswered requests
within :data:`LOST_AFTER` of it mean that the node is lost. So a node that dies right after an answer is known to be
lost before two guard times are over.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from drivers.bus.contract import RTR_FLAG
from drivers.canopen.nmt import ERROR_CONTROL_COB_ID
from drivers.canopen.pacing import Pacing

REPEAT_AFTER = 0.4
LOST_AFTER = 0.8
EARLY = 0.01
"""Share of the guard time that a request may be early, so that rounding does not cost a whole control cycle."""
PAUSE = 0.25
"""Share of the guard time without a call after which the time in between counts as a pause of this program."""


class Guard:
    """Guards one node.

    Args:
        node: node id.
        guard_time_s: time between two requests.
        request: sends a remote frame with the COB-ID it is given.
        on_lost: called once with how long its answer was awaited, pauses of this program left out; 0 where the node was
            not asked, and is known to be silent otherwise.
        pacing: told from when on and how long an answer is awaited.
        patience_s: the node is not given up sooner than this after a request.
    """

    def __init__(
        self,
        node: int,
        guard_time_s: float,
        request: Callable[[int], None],
        on_lost: Callable[[float], None],
        pacing: Pacing,
        patience_s: float = 0.0,
    ) -> None:
        self.node = node
        self.guard_time_s = guard_time_s
        self._request = request
        self._on_lost = on_lost
        self._pacing = pacing
        self._lost_s = max(LOST_AFTER * guard_time_s, patience_s)
        self._called_s = 0.0
        self._next_s = math.inf
        self._asked_s: float | None = None
        self._repeated = False
        self._toggle: int | None = None

    def arm(self, now_s: float) -> None:
        """Guard from now on; the first request goes out with the next call of :meth:`due`."""
        self._next_s = now_s
        self._await_no_more()
        self._toggle = None

    @property
    def armed(self) -> bool:
        """Whether the node is guarded."""
        return self._next_s < math.inf

    def disarm(self) -> None:
        """Ask no more."""
        self._next_s = math.inf
        self._await_no_more()

    def due(self, now_s: float) -> None:
        """Send what is due; called by each good control cycle."""
        if self._asked_s is None:
            if now_s >= self._next_s:
                self._ask(now_s)
            return
        asked_s = self._asked_s = self._asked_s + self._pause_s(now_s)
        if now_s >= asked_s + self._lost_s:
            self.lose(now_s)
        elif not self._repeated and now_s >= asked_s + REPEAT_AFTER * self.guard_time_s:
            self._repeated = True
            self._request(RTR_FLAG | ERROR_CONTROL_COB_ID + self.node)

    def _pause_s(self, now_s: float) -> float:
        """How long this program itself stood still since the last call: an answer may wait unread meanwhile."""
        pause_s, self._called_s = now_s - self._called_s, now_s
        return pause_s if pause_s > PAUSE * self.guard_time_s else 0.0

    def _ask(self, now_s: float) -> None:
        self._asked_s = self._called_s = now_s
        self._pacing.guard_asked(self.node)
        self._next_s = (math.floor(now_s / self.guard_time_s + EARLY) + 1 - EARLY) * self.guard_time_s
        self._repeated = False
        self._request(RTR_FLAG | ERROR_CONTROL_COB_ID + self.node)

    def lose(self, now_s: float) -> None:
        """The node is known to be silent; its guard reports it lost."""
        if self.armed:
            asked_s = self._asked_s
            awaited_s = 0.0 if asked_s is None else now_s - asked_s - self._pause_s(now_s)
            self.disarm()
            self._on_lost(awaited_s)

    def answer(self, toggle: int) -> bool:
        """Take an answer; False where its toggle bit did not alternate. The first answer may have either."""
        alternates = toggle != self._toggle
        self._toggle = toggle
        self._await_no_more()
        return alternates

    def _await_no_more(self) -> None:
        self._asked_s = None
        self._pacing.guard_over(self.node)
