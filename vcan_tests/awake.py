"""Keeps the processors of a virtual machine awake while something runs in real time.

A virtual processor that sleeps is woken by its host, which on a busy host takes milliseconds; a conversation over a
serial line waits dozens of times a second. Processes of the idle class run only when nobody else wants to, so they take
nothing from a test.
"""

from __future__ import annotations

import contextlib
import os
import subprocess
from collections.abc import Iterator

_SPIN = "while kill -0 $PPID; do :; done"


def _become_idle() -> None:
    os.sched_setscheduler(0, os.SCHED_IDLE, os.sched_param(0))


@contextlib.contextmanager
def awake_processors() -> Iterator[None]:
    """One idle process a processor, which ends with this one at the latest."""
    spinning = [
        subprocess.Popen(["/bin/sh", "-c", _SPIN], preexec_fn=_become_idle, stderr=subprocess.DEVNULL)
        for _ in range(os.cpu_count() or 1)
    ]
    try:
        yield
    finally:
        for process in spinning:
            process.kill()
            process.wait()
