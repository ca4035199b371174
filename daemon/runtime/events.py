"""What happened: a short memory of events, told to whoever listens."""

from __future__ import annotations

import asyncio
import logging
from collections import deque
from collections.abc import Callable
from typing import Any

from daemon.runtime.time_of_day import unix_s

LOGGER = logging.getLogger("canhelm")
KEPT = 200
_LEVELS = {"info": logging.INFO, "warning": logging.WARNING, "error": logging.ERROR}


class EventLog:
    """The last events, newest last, and the callbacks that hear of each."""

    def __init__(self) -> None:
        self.events: deque[dict[str, Any]] = deque(maxlen=KEPT)
        self.listeners: list[Callable[[dict[str, Any]], None]] = []

    def add(self, severity: str, source: str, message: str, remedy: str = "") -> None:
        """Record one event.

        Args:
            severity: ``info``, ``warning`` or ``error``.
            source: device or part of the daemon it is about.
            message: what happened, one sentence.
            remedy: what to do next; empty where there is nothing to do.
        """
        times = {"time_s": round(asyncio.get_running_loop().time(), 6), "unix_s": round(unix_s(), 3)}
        event = {**times, "severity": severity, "source": source, "message": message, "remedy": remedy}
        self.events.append(event)
        LOGGER.log(_LEVELS[severity], "%s: %s%s", source, message, f" ({remedy})" if remedy else "")
        for listener in self.listeners:
            listener(event)

    def told(self, message: str) -> bool:
        """Whether an event of the last second has said this already."""
        since_s = asyncio.get_running_loop().time() - 1.0
        return any(event["message"] == message and event["time_s"] >= since_s for event in self.events)

    def last(self, count: int) -> list[dict[str, Any]]:
        """The newest ``count`` events, oldest first."""
        return list(self.events)[-count:]
