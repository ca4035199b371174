"""From the loop's clock, which nothing sets, to the time of day, which somebody may."""

from __future__ import annotations

import asyncio
import time

from daemon.runtime.clock import VirtualTimeLoop


def epoch_s() -> float:
    """Seconds from 1970 until the running loop's clock showed zero, as the machine's clock is set now.

    Returns:
        On virtual time 0, so that two runs with one seed write the same bytes.
    """
    loop = asyncio.get_running_loop()
    return 0.0 if isinstance(loop, VirtualTimeLoop) else time.time() - loop.time()
