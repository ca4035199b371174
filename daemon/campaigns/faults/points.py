"""Who decides at each point of a course: one that only notes them, one that strikes once, one that forks.

A course reaches each point once. :class:`Forks` splits the process there, once for each injection: the child is struck
and drives to its end, the parent waits for what it tells, and goes on as if nothing had been. Such a process has no
threads and no sockets, only virtual time.
"""

from __future__ import annotations

import asyncio
import gc
import os
import signal
import traceback
from collections import defaultdict
from collections.abc import Callable, Collection
from dataclasses import dataclass
from typing import Final

import msgspec

from daemon.campaigns.faults.course import Course, Points
from daemon.campaigns.faults.outcome import Outcome
from daemon.campaigns.faults.strikes import STRIKES, Injection, Where
from daemon.runtime.clock import run_virtual

COMPUTING_S: Final = 60
"""Processor time after which a child has gone astray; one takes 0.1 s."""


@dataclass(frozen=True, slots=True)
class Point:
    """Where something may strike: a frame, or with ``can_id`` None the end of a control cycle."""

    index: int
    manoeuvre: str
    can_id: int | None = None
    length: int = 0


class Notes:
    """Lets everything be, and notes where something could strike.

    Attributes:
        points: of the course.
    """

    def __init__(self) -> None:
        self.points: list[Point] = []

    def frame(self, index: int, manoeuvre: str, can_id: int, length: int) -> Injection | None:
        """A frame."""
        self.points.append(Point(index, manoeuvre, can_id, length))
        return None

    def cycle(self, index: int, manoeuvre: str) -> Injection | None:
        """A control cycle."""
        self.points.append(Point(index, manoeuvre))
        return None

    def done(self, outcome: Outcome) -> None:
        """Nothing was struck."""


class One:
    """Strikes once."""

    def __init__(self, injection: Injection) -> None:
        self._injection = injection

    def frame(self, index: int, manoeuvre: str, can_id: int, length: int) -> Injection | None:
        """A frame."""
        strike = STRIKES[self._injection.strike]
        return self._at("frame", index) if strike.fits(can_id, length) else None

    def cycle(self, index: int, manoeuvre: str) -> Injection | None:
        """A control cycle."""
        return self._at("cycle", index)

    def done(self, outcome: Outcome) -> None:
        """The course goes on to its end."""

    def _at(self, where: Where, index: int) -> Injection | None:
        here = STRIKES[self._injection.strike].where == where and self._injection.index == index
        return self._injection if here else None


class Forks:
    """Forks at each point for each injection there.

    Args:
        injections: to be tried.
        keep: called with the outcome of each.

    Attributes:
        outlet: where a child writes its outcome; None in the parent.
    """

    def __init__(self, injections: Collection[Injection], keep: Callable[[Outcome], None]) -> None:
        self.outlet: int | None = None
        self._keep = keep
        self._at: dict[tuple[Where, int], list[Injection]] = defaultdict(list)
        for injection in injections:
            self._at[STRIKES[injection.strike].where, injection.index].append(injection)

    def frame(self, index: int, manoeuvre: str, can_id: int, length: int) -> Injection | None:
        """A frame."""
        return self._fork("frame", index, manoeuvre)

    def cycle(self, index: int, manoeuvre: str) -> Injection | None:
        """A control cycle."""
        return self._fork("cycle", index, manoeuvre)

    def done(self, outcome: Outcome) -> None:
        """The child tells its outcome and ends."""
        if self.outlet is not None:
            with open(self.outlet, "wb") as pipe:
                pipe.write(msgspec.json.encode(outcome))
            os._exit(0)

    def _fork(self, where: Where, index: int, manoeuvre: str) -> Injection | None:
        """The injection in the child that it is for, None in the parent."""
        for injection in self._at.pop((where, index), ()):
            inlet, outlet = os.pipe()
            loop = asyncio.get_running_loop()
            child = os.fork()
            if not child:
                asyncio._set_running_loop(loop)  # a loop runs in the process that it was started in
                signal.setitimer(signal.ITIMER_VIRTUAL, COMPUTING_S)
                gc.disable()
                self.outlet = outlet
                return injection
            os.close(outlet)
            self._keep(_told_by(child, inlet, Outcome(injection.strike, injection.index, manoeuvre)))
        return None


def _told_by(child: int, inlet: int, outcome: Outcome) -> Outcome:
    """Wait for a child, and take what it tells; one that tells nothing has crashed."""
    with open(inlet, "rb") as pipe:
        told = pipe.read()
    _, status = os.waitpid(child, 0)
    if status == 0 and told:
        return msgspec.json.decode(told, type=Outcome)
    outcome.violations = {"end": f"it came to no end: {signal_words(os.waitstatus_to_exitcode(status))}"}
    return outcome


def signal_words(code: int) -> str:
    """An exit code in words."""
    return f"exit code {code}" if code >= 0 else signal.Signals(-code).name


def try_all(injections: Collection[Injection], seed: int, keep: Callable[[Outcome], None]) -> None:
    """Drive one course, and fork at each point for each injection there.

    Args:
        injections: to be tried.
        seed: of the campaign.
        keep: called with each outcome.
    """
    forks = Forks(injections, keep)
    gc.freeze()  # what is there already is shared with the children
    try:
        run_virtual(_drive(seed, forks))
    finally:
        if forks.outlet is not None:  # a child that has come here has no outcome
            traceback.print_exc()
            os._exit(1)


async def _drive(seed: int, points: Points) -> Course:
    course = Course(seed, points)
    await course.run()
    return course


def try_one(injection: Injection, seed: int) -> Course:
    """Drive one course in this process, struck once; the course. One that was not struck has no outcome."""
    return run_virtual(_drive(seed, One(injection)))


def note_points(seed: int) -> tuple[list[Point], Course]:
    """Drive one course that nothing strikes; its points, and the course."""
    notes = Notes()
    course = run_virtual(_drive(seed, notes))
    return notes.points, course
