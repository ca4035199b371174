"""What becomes of one injection, and the manoeuvres in which it may be."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final

MANOEUVRES: Final = ("boot", "steer", "drive", "stop")


@dataclass(slots=True)
class Outcome:
    """What became of one injection.

    Attributes:
        strike, index: of the injection.
        manoeuvre: that was under way.
        part: the device that it concerned; None for all.
        at_s: virtual time.
        stopped: whether it ended the manoeuvre by an error, or latched a stop.
        told: what the client was told, or the status said.
        rest_s: from the injection until the last wheel stood and had settled, where it stopped a robot that moved.
        recovered: by which action: ``nothing``, ``reset``; "" where it did not recover.
        violations: what was wrong, by invariant.
    """

    strike: str
    index: int
    manoeuvre: str
    part: str | None = None
    at_s: float = 0.0
    stopped: bool = False
    told: str = ""
    rest_s: float | None = None
    recovered: str = ""
    violations: dict[str, str] = field(default_factory=dict)
