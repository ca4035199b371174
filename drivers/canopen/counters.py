"""What the master counts instead of raising: everything odd that came over the wire."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(slots=True)
class CanopenCounters:
    """Frames that were dropped, and answers that were missed."""

    unknown: int = 0
    """Frames with an identifier that nothing here listens to."""
    malformed: int = 0
    """Frames whose length or content makes no sense: truncated, oversized, garbage."""
    late_answers: int = 0
    """SDO answers that nobody waits for (any more), or for another object than the one asked for."""
    toggle_errors: int = 0
    """Guarding answers whose toggle bit did not alternate."""
    nodes_lost: int = 0
    internal_errors: int = 0
    """Errors of the program itself, caught at the edge of a task; each stands in the log with its traceback."""
