"""Virtual time with real sockets, for daemons and clients that are in one process."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine
from selectors import BaseSelector, SelectorKey
from typing import Any, TypeVar

from daemon.runtime.clock import VirtualTimeLoop

T = TypeVar("T")
LOOK_S = 0.001
"""Virtual time after which the sockets are looked at again."""


class VirtualSocketLoop(VirtualTimeLoop, asyncio.SelectorEventLoop):
    """A virtual-time loop that serves sockets, too.

    Whatever was written to one is there at once, for both ends are in this process; so the same program runs the same
    way each time.
    """

    _selector: BaseSelector
    _process_events: Callable[[list[tuple[SelectorKey, int]]], None]

    def __init__(self) -> None:
        self._looked_s = -LOOK_S
        super().__init__()

    def _advance(self) -> None:
        if self._now_s - self._looked_s >= LOOK_S:
            self._looked_s = self._now_s
            self._process_events(self._selector.select(0))
        if not self._ready:
            super()._advance()


def run_with_sockets(coro: Coroutine[Any, Any, T]) -> T:
    """Run a coroutine to its end on a :class:`VirtualSocketLoop`."""
    with asyncio.Runner(loop_factory=VirtualSocketLoop) as runner:
        return runner.run(coro)
