"""What is fuzzed: where its inputs come from, what is done with one, and the bounds that hold for every one.

An input is bytes, so that one that brought something to light is a file, whatever it is an input of.
"""

from __future__ import annotations

import contextlib
import gc
import logging
import signal
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from hypothesis import HealthCheck, Phase, settings
from hypothesis.strategies import SearchStrategy

CPU_S = 10.0
"""What one input may take of a processor; one that takes more hangs, or as good as."""


class TookTooLong(Exception):
    """An input took longer than any may."""


class _Alarm(KeyboardInterrupt):
    """The time is up; neither asyncio nor a task's edge holds it up."""


class DefectLogged(Exception):
    """Asyncio complained, or an exception was logged without an exception to raise again."""


@dataclass(frozen=True, slots=True)
class Target:
    """One thing that is fuzzed.

    Attributes:
        name: how people call it, and what the names of its findings begin with.
        inputs: valid ones, such that were changed a little, and noise.
        attempt: feeds it one input; raises where something is wrong.
    """

    name: str
    inputs: SearchStrategy[bytes]
    attempt: Callable[[bytes], None]

    def check(self, content: bytes) -> None:
        """Feed it one input. Raises whatever shows that something is wrong."""
        with _bounded(), _no_exception_logged():
            self.attempt(content)


def few(count: int) -> settings:
    """Settings of a test that tries a few inputs, the same ones each time: others are what `make fuzz` is for."""
    return settings(
        max_examples=count,
        derandomize=True,
        deadline=None,
        phases=(Phase.explicit, Phase.generate),
        suppress_health_check=list(HealthCheck),
    )


@contextlib.contextmanager
def _bounded() -> Iterator[None]:
    """Raise TookTooLong where what runs within takes more than :data:`CPU_S` of the processor."""

    def ring(*_: object) -> None:
        raise _Alarm

    before = signal.signal(signal.SIGVTALRM, ring)
    signal.setitimer(signal.ITIMER_VIRTUAL, CPU_S)
    try:
        yield
    except _Alarm as alarm:
        raise TookTooLong(f"more than {CPU_S:g} s").with_traceback(alarm.__traceback__) from None
    finally:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0.0)
        signal.signal(signal.SIGVTALRM, before)


class _Defects(logging.Handler):
    """Keeps the first record that tells of an exception, as nothing does but a defect of the program's own."""

    def __init__(self) -> None:
        super().__init__(logging.ERROR)
        self.first: logging.LogRecord | None = None

    def emit(self, record: logging.LogRecord) -> None:
        if record.exc_info or record.name == "asyncio":
            self.first = self.first or record


@contextlib.contextmanager
def _no_exception_logged() -> Iterator[None]:
    """Raise the first exception that was logged meanwhile, or DefectLogged where asyncio just complained."""
    defects, root = _Defects(), logging.getLogger()
    root.addHandler(defects)
    try:
        yield
        gc.collect(0)  # asyncio tells of a task that nobody has awaited when it is taken away
    finally:
        root.removeHandler(defects)
    if defects.first is not None:
        error = defects.first.exc_info[1] if defects.first.exc_info else None
        raise error or DefectLogged(defects.first.getMessage())
