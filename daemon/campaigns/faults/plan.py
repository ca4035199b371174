"""Which injections a campaign tries: each kind at every point of one short manoeuvre, and at some of the others."""

from __future__ import annotations

import random
from collections.abc import Sequence
from typing import Final

from canhelm.errors import UsageError
from daemon.campaigns.faults.outcome import MANOEUVRES
from daemon.campaigns.faults.points import Point
from daemon.campaigns.faults.strikes import STRIKES, Injection, Strike

SHORT: Final = "stop"
"""The manoeuvre of which no point is left out: drives are enabled, drive off, are stopped and switched off."""


def planned(points: Sequence[Point], samples: int, seed: int, names: Sequence[str]) -> list[Injection]:
    """The injections of a campaign, in the order of their names.

    Args:
        points: of the course.
        samples: for each kind in each of the other manoeuvres, at most.
        seed: of what is chosen.
        names: of the strikes.
    """
    found: list[Injection] = []
    for name in names:
        for manoeuvre in MANOEUVRES:
            fitting = [p.index for p in points if p.manoeuvre == manoeuvre and _fits(STRIKES[name], p)]
            few = random.Random(f"{seed} {name} {manoeuvre}")
            chosen = fitting if manoeuvre == SHORT else few.sample(fitting, min(samples, len(fitting)))
            found += [Injection(name, index) for index in sorted(chosen)]
    return found


def _fits(strike: Strike, point: Point) -> bool:
    if point.can_id is None:
        return strike.where == "cycle"
    return strike.where == "frame" and strike.fits(point.can_id, point.length)


def named(names: Sequence[str]) -> list[str]:
    """Names of strikes as somebody gave them; all where none is given. Raises UsageError for one that is none."""
    for name in names:
        if name not in STRIKES:
            raise UsageError(
                f"{name!r} is no fault of this campaign", value=name, remedy=f"one of {', '.join(STRIKES)}"
            )
    return list(names or STRIKES)


def injection_of(text: str) -> Injection:
    """The injection that ``KIND:INDEX`` names. Raises UsageError."""
    name, _, index = text.partition(":")
    if not index.isdecimal() or not int(index):
        raise UsageError(f"{text!r} is no KIND:INDEX", value=text, remedy="write it as the results have it: lose:3100")
    named([name])
    return Injection(name, int(index))
