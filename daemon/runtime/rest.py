"""Knows when every wheel has come to rest, and wakes those who wait for it."""

from __future__ import annotations

import asyncio

AT_REST_M_S = 0.01
"""A wheel that is slower counts as at rest."""
AT_REST_CYCLES = 3


class RestWatch:
    """Looks at the wheels once a cycle."""

    def __init__(self) -> None:
        self._cycles = 0
        self._waiters: list[asyncio.Future[None]] = []

    def look(self, wheel_speed_m_s: tuple[float, ...]) -> None:
        """Take one cycle's rim speeds."""
        fastest_m_s = max(map(abs, wheel_speed_m_s), default=0.0)
        self._cycles = self._cycles + 1 if fastest_m_s < AT_REST_M_S else 0
        if self._waiters and self._cycles >= AT_REST_CYCLES:
            for waiter in self._waiters:
                if not waiter.done():
                    waiter.set_result(None)
            self._waiters.clear()

    def begin_anew(self) -> None:
        """Only cycles from now on count: a stop was just commanded."""
        self._cycles = 0

    async def until_rest(self, timeout_s: float) -> bool:
        """Wait until all wheels are at rest; False when they are not within the time."""
        if self._cycles >= AT_REST_CYCLES:
            return True
        waiter: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        self._waiters.append(waiter)
        try:
            async with asyncio.timeout(timeout_s):
                await waiter
        except TimeoutError:
            return False
        return True
