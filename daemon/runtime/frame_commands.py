"""The method ``bus.frames``: what goes over the bus, for a client that writes it down."""

from __future__ import annotations

import asyncio
from collections import deque
from itertools import islice
from typing import Any

from daemon.runtime.handlers import Handler, Params
from daemon.runtime.time_of_day import epoch_s
from drivers.bus.candump import make_line
from drivers.bus.contract import Bus
from drivers.simulated.computer_trouble import ComputerTrouble

KEPT = 20_000
"""Frames that are kept for clients that ask late; on a full bus of 1 Mbit/s a second or two."""
UNASKED_S = 10.0
"""After which nobody listens any more, and no frames are kept."""
WAIT_S = 0.2
"""How long an answer waits for frames to come."""


class FrameCommands:
    """Keeps the newest frames while some client asks for them.

    Args:
        bus: to listen to.
        trouble: what faults make of a simulated robot's computer.
    """

    def __init__(self, bus: Bus, trouble: ComputerTrouble | None = None) -> None:
        self._bus = bus
        self._trouble = trouble or ComputerTrouble()
        self._lines: deque[str] = deque(maxlen=KEPT)
        self._count = 0
        self._end: asyncio.TimerHandle | None = None
        self.handlers: dict[str, Handler] = {"bus.frames": self._frames}

    async def _frames(self, params: Params, lease: str | None) -> dict[str, Any]:
        """The frames from one number on; from now on where none is given."""
        self._listen()
        after = self._count if params.get("after") is None else int(params["after"])
        await asyncio.sleep(WAIT_S)
        oldest = self._count - len(self._lines)
        begin = min(max(after, oldest), self._count)
        lines = list(islice(self._lines, begin - oldest, None))
        return {"frames": lines, "next": self._count, "lost": max(0, oldest - after)}

    def _listen(self) -> None:
        """Keep frames from now on, until nobody has asked for a while."""
        loop = asyncio.get_running_loop()
        if self._end is None:
            self._epoch_s = epoch_s(self._trouble)
            self._bus.taps.append(self._take)
        else:
            self._end.cancel()
        self._end = loop.call_later(UNASKED_S, self._stop)

    def _stop(self) -> None:
        self._bus.taps.remove(self._take)
        self._end = None
        self._lines.clear()

    def _take(self, can_id: int, data: bytes, timestamp_s: float) -> None:
        self._count += 1
        self._lines.append(make_line(self._epoch_s + timestamp_s, self._bus.name, can_id, data))
