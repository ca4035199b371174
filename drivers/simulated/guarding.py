"""Node guarding and life guarding as the guarded side (CiA 301 7.2.8.2.2)."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

_TOGGLE = 0x80


class GuardedSide:
    """Answers guard requests; once there was one, watches that the next comes within the life time.

    Args:
        life_time_s: the life time (guard time by life time factor) as it is set now; 0 switches life guarding off.
        master_lost: called when the life time has passed without a request.
    """

    def __init__(self, life_time_s: Callable[[], float], master_lost: Callable[[], None]) -> None:
        self._life_time_s = life_time_s
        self._master_lost = master_lost
        self._toggle = 0
        self._end_s = 0.0
        self._timer: asyncio.TimerHandle | None = None

    def restart(self) -> None:
        """Begin anew: toggle bit 0, no life guarding before the next request."""
        self._toggle = 0
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def life_time_changed(self) -> None:
        """A life time of 0 ends life guarding until the next request; the toggle bit goes on."""
        if self._timer is not None and not self._life_time_s():
            self._timer.cancel()
            self._timer = None

    def answer(self, state: int, now_s: float) -> bytes:
        """The data that answers a request: toggle bit and NMT state."""
        data = bytes((self._toggle | state,))
        self._toggle ^= _TOGGLE
        life_s = self._life_time_s()
        self._end_s = now_s + life_s
        if life_s and self._timer is None:
            self._timer = asyncio.get_running_loop().call_at(self._end_s, self._look)
        return data

    def _look(self) -> None:
        """The life time may have been prolonged meanwhile: one timer outlives many requests."""
        self._timer = None
        loop = asyncio.get_running_loop()
        if loop.time() < self._end_s:
            self._timer = loop.call_at(self._end_s, self._look)
        else:
            self._master_lost()
