"""Counts work instead of time: bytecodes of one thread, which no load of the machine changes."""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from statistics import median
from types import FrameType
from typing import Any

ROUNDS = 31
"""Odd, and enough that what comes each tenth cycle is not in the middle."""


def bytecodes_of(run: Callable[[], None]) -> Counter[str]:
    """Bytecodes that this thread carries out while something runs, by file and function."""
    with counting() as counted:
        run()
    return counted


@contextmanager
def counting() -> Iterator[Counter[str]]:
    """Count the bytecodes of functions that are called within this context, by file and function."""
    counted: Counter[str] = Counter()

    def trace(frame: FrameType, event: str, _: Any) -> Any:
        if event == "call":
            frame.f_trace_opcodes, frame.f_trace_lines = True, False
        elif event == "opcode":
            counted[f"{frame.f_code.co_filename.rpartition('/')[2]}:{frame.f_code.co_name}"] += 1
        return trace

    before = sys.gettrace()
    sys.settrace(trace)
    try:
        yield counted
    finally:
        sys.settrace(before)


def usual_bytecodes(run: Callable[[int], None]) -> float:
    """Bytecodes of one round, the median of some: what comes now and then, or after a pause of the machine, is no part.

    Args:
        run: does so many rounds.
    """
    run(ROUNDS)
    return median(_of(run, 2) - _of(run, 1) for _ in range(ROUNDS))


def _of(run: Callable[[int], None], count: int) -> int:
    return bytecodes_of(lambda: run(count)).total()
