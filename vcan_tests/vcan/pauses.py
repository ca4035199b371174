"""Tells when a whole machine stood still, as a virtual one does while its host is busy: no program can help that."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

PAUSE_S = 0.01
WATCH = f"""
import os, select, sys, time
os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(90))
last = time.time()
while True:
    select.select([], [], [], 0.002)
    now = time.time()
    if now - last > {PAUSE_S}:
        print(last, now, flush=True)
    last = now
"""
"""A process before all others; what keeps it from waking keeps everybody."""


class PauseWatch:
    """The pauses of this machine since it is watched.

    Args:
        notes: file in which they are noted.
    """

    def __init__(self, notes: Path) -> None:
        self._notes = notes

    def between(self, begin_s: float, end_s: float) -> list[float]:
        """Lengths of the pauses that lay, even in part, between two wall-clock times [s]."""
        pauses = [tuple(map(float, line.split())) for line in self._notes.read_text().splitlines()]
        return [end - begin for begin, end in pauses if begin < end_s and end > begin_s]


@contextmanager
def watched_for_pauses(notes: Path) -> Iterator[PauseWatch]:
    """Watch the machine while the ``with`` block lasts."""
    with notes.open("w") as output:
        process = subprocess.Popen([sys.executable, "-c", WATCH], stdout=output)
    try:
        yield PauseWatch(notes)
    finally:
        process.kill()
        process.wait()
