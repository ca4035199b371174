"""Tells of wheels that turn although no drive has power: nothing brakes a vehicle that slides, rolls or is pushed."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from daemon.runtime.events import EventLog
from drivers.contract import Drive, NodeState

ROLLING_M_S: Final = 0.05
"""Rim speed above which a wheel rolls."""
ROLLING_S: Final = 0.2
"""For so long it has to; and so long at rest ends it."""
REMEDY: Final = "is the vehicle on ice or on a slope, or pushed by hand? nothing brakes wheels whose drives are off"


class RollingWatch:
    """Looks at the wheels once a cycle.

    Args:
        drives: of the wheels.
        log: hears of it once, when it begins.

    Attributes:
        sentence: which wheel rolls, and how fast it was when that was noticed; empty while none does.
    """

    def __init__(self, drives: Sequence[Drive], log: EventLog) -> None:
        self.sentence = ""
        self._drives = drives
        self._log = log
        self._since_s: float | None = None

    def look(self, now_s: float, *, powered: bool) -> None:
        """Take one cycle's readings.

        Args:
            now_s: time of the cycle.
            powered: whether a motion is under way, or any drive has power.
        """
        rolling = None if powered else self._fastest()
        if powered:
            self.sentence = ""
        if (rolling is None) != bool(self.sentence):
            self._since_s = None
        elif self._since_s is None:
            self._since_s = now_s
        elif now_s - self._since_s >= ROLLING_S:
            self._change(rolling)

    def _fastest(self) -> Drive | None:
        """The wheel that rolls fastest, of those that can be read."""
        ready = [drive for drive in self._drives if drive.node_state is NodeState.READY]
        fastest = max(ready, key=lambda drive: abs(drive.speed_m_s), default=None)
        return fastest if fastest is not None and abs(fastest.speed_m_s) > ROLLING_M_S else None

    def _change(self, rolling: Drive | None) -> None:
        self._since_s, self.sentence = None, ""
        if rolling is not None:
            self.sentence = f"wheel {rolling.name} turns at {rolling.speed_m_s:.2f} m/s without power"
            self._log.add("warning", rolling.name, self.sentence, REMEDY)
