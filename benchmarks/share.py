"""The daemon's own share of the processor where it runs in one process with its simulated network."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from time import perf_counter
from typing import Any
from unittest.mock import patch

from daemon.app import App
from daemon.runtime.cycle import Pace
from daemon.wires import Wire, make_wire


class DaemonShare:
    """Counts the time that the daemon takes for its ticks and for the frames that it is given.

    The queue of the simulated bus, into which it sends, counts with it; the twins and their physics do not.

    Attributes:
        spent_s: time so far.
    """

    def __init__(self) -> None:
        self.spent_s = 0.0

    @contextmanager
    def of_ticks(self) -> Iterator[None]:
        """Count the ticks of a daemon that is made within this context."""
        with patch("daemon.app.make_wire", self._make_wire):
            yield

    def of_frames(self, app: App) -> None:
        """Count, from now on, the frames that a daemon is given."""
        assert app.bus.receiver is not None
        app.bus.receiver = self._timed(app.bus.receiver)

    def _make_wire(self, *args: Any) -> Wire:
        wire = make_wire(*args)

        def pace(period_s: float, tick: Callable[[], None]) -> Pace:
            return wire.pace(period_s, self._timed(tick))

        return replace(wire, pace=pace)

    def _timed(self, call: Callable[..., None]) -> Callable[..., None]:
        def timed(*args: Any) -> None:
            begin_s = perf_counter()
            call(*args)
            self.spent_s += perf_counter() - begin_s

        return timed
