"""From the loop's clock, which nothing sets, to the time of day, which somebody may."""

from __future__ import annotations

import asyncio
import time

from daemon.runtime.clock import VirtualTimeLoop
from drivers.simulated.computer_trouble import ComputerTrouble

LATEST_S = 8_277_292_036.0
"""In 2232: Linux lets nobody set a later time (TIME_SETTOD_SEC_MAX of linux/time64.h)."""


def epoch_s(trouble: ComputerTrouble) -> float:
    """Seconds from 1970 until the running loop's clock showed zero, as the machine's clock is set now.

    Args:
        trouble: what faults make of a simulated robot's clock. No earlier time can be set than the loop's clock shows
            (clock_settime(2)), and none after ``LATEST_S``.

    Returns:
        On virtual time 0 unless a fault has set it, so that two runs with one seed write the same bytes.
    """
    loop = asyncio.get_running_loop()
    machine_s = 0.0 if isinstance(loop, VirtualTimeLoop) else time.time() - loop.time()
    return min(max(0.0, machine_s + trouble.clock_jump_s), LATEST_S)


def unix_s() -> float:
    """Seconds since 1970 by the clock that dates the lines of the log; on virtual time by the loop's."""
    loop = asyncio.get_running_loop()
    return loop.time() if isinstance(loop, VirtualTimeLoop) else time.time()
