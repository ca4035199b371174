"""What a campaign drives: one case a run, and the lists of cases of the thesis' chapter 6.

Distances are in metres, angles in degrees as in the results file. Errors of position are positive to the left of the
heading on a line and to the outside on a circle; angles counter-clockwise.
"""

from __future__ import annotations

import random
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import Final, Literal, NamedTuple

Law = Literal["thesis", "cascade"]
Through = Literal["ideal", "can"]
Way = Literal["line", "circle", "none"]

LAWS: Final[tuple[Law, ...]] = ("thesis", "cascade")
LINES_AND_CIRCLES: Final[tuple[Way, ...]] = ("line", "circle")
STEERING_RATE_DEG_S: Final = 60.0
RATES_DEG_M: Final = (200, 230, 260, 300, 350, 400, 500, 600, 800, 1000)
"""Steering rates a metre of way; an ideal steering is in the other parts."""
BENDING_GAINS: Final = (2.0, 2.5, 3.0, 3.5, 4.0, 4.5, 5.0, 6.0)
LOOK_AHEADS_M: Final = (0.3, 0.35, 0.4, 0.425, 0.45, 0.5, 0.55, 0.6)
SPEED_M_S: Final = 0.2
PERIOD_S: Final = 0.05
DURATION_S: Final = 20.0


class State(NamedTuple):
    """A path and the errors that a run begins with."""

    path: Way
    position_m: float = 0.0
    heading_deg: float = 0.0
    bending_deg: float = 0.0


@dataclass(frozen=True, slots=True)
class Case:
    """One run, backwards at ``SPEED_M_S``.

    Attributes:
        part: of the campaign.
        through: ideal kinematics, or the simulated CAN network.
        law: that steers.
        path: endless line, circle of 1 m, or none: then only the bending angle is steered.
        rate_deg_s: of the steering; None: at once.
        position_m, heading_deg, bending_deg: errors at the beginning; without a path the bending angle itself.
        target_deg: bending angle to reach without a path.
        look_ahead_m, bending_gain: c_v and c_p of the thesis' law.
    """

    part: str
    through: Through
    law: Law
    path: Way
    rate_deg_s: float | None
    position_m: float = 0.0
    heading_deg: float = 0.0
    bending_deg: float = 0.0
    target_deg: float = 0.0
    look_ahead_m: float = 0.425
    bending_gain: float = 4.0

    @property
    def state(self) -> State:
        """Path and errors at the beginning."""
        return State(self.path, self.position_m, self.heading_deg, self.bending_deg)


@dataclass(frozen=True, slots=True)
class Outcome:
    """What came out of a run.

    Attributes:
        settle_m: way after which position and heading stay within 1 cm and 1 degree (without a path, the bending angle
            within 1 degree); None: never.
        worst_position_m, worst_heading_deg, worst_bending_deg: largest errors.
        overshoot_m: largest error of position on the other side than at the beginning.
        overshoot_deg: the bending angle's way beyond its target, without a path.
        ended: ``driven``, or why the run ended early.
    """

    settle_m: float | None
    worst_position_m: float
    worst_heading_deg: float
    worst_bending_deg: float
    overshoot_m: float
    overshoot_deg: float
    ended: str = "driven"


def thesis_states() -> list[State]:
    """The 40 initial errors of section 6.2: single ones on line and circle, and those of Table B.1 on both."""
    signs = (1, -1)
    single = [(sign * size, 0.0, 0.0) for size in (0.1, 0.2) for sign in signs]
    single += [(0.0, sign * size, 0.0) for size in (5.0, 10.0) for sign in signs]
    single += [(0.0, 0.0, sign * size) for size in (5.0, 10.0) for sign in signs]
    combined = [(side * y, turn * 10.0, 0.0) for y, side, turn in product((0.1, 0.2), signs, signs)]
    return [State(path, *errors) for path, errors in product(LINES_AND_CIRCLES, single + combined)]


def random_states(count: int, seed: int) -> list[State]:
    """Errors of position within 0.25 m, of heading and bending angle within 15 degrees; line and circle in turn."""
    chance = random.Random(seed)
    return [
        State(
            LINES_AND_CIRCLES[number % 2],
            chance.uniform(-0.25, 0.25),
            chance.uniform(-15.0, 15.0),
            chance.uniform(-15.0, 15.0),
        )
        for number in range(count)
    ]


def following(
    part: str, states: Sequence[State], law: Law, rate_deg_s: float | None, through: Through = "ideal"
) -> list[Case]:
    """One case a state."""
    return [Case(part, through, law, state.path, rate_deg_s, *state[1:]) for state in states]


def bounds_cases(count: int, seed: int, through: Through) -> list[Case]:
    """The campaign ``bounds``: the 40 states and random ones with both laws, and the 40 at each steering rate.

    Args:
        count: of random states.
        seed: of them.
        through: ideal kinematics, with a steering that is ideal and one of 60 degrees/s; or the simulated CAN network,
            whose steering has a rate of its own, and then without the other rates.
    """
    rates = (None, STEERING_RATE_DEG_S) if through == "ideal" else (STEERING_RATE_DEG_S,)
    parts = {"thesis": thesis_states(), random_part(seed): random_states(count, seed)}
    cases = [
        case
        for (part, states), rate, law in product(parts.items(), rates, LAWS)
        for case in following(part, states, law, rate, through)
    ]
    if through == "ideal":
        for rate_deg_m, law in product(RATES_DEG_M, LAWS):
            cases += following("rates", thesis_states(), law, rate_deg_m * SPEED_M_S)
    return cases


def random_part(seed: int) -> str:
    """Name of the part with the random states of a seed."""
    return f"random {seed}"


def tuning_cases() -> list[Case]:
    """The campaign ``tuning``: the tests of section 6.1, and the 40 states with each pair of c_p and c_v."""
    rates = (None, STEERING_RATE_DEG_S)
    cases: list[Case] = []
    for rate, gain, (start, target) in product(rates, BENDING_GAINS, ((0.0, 50.0), (30.0, 0.0))):
        cases.append(Case("c_p", "ideal", "thesis", "none", rate, 0.0, 0.0, start, target, bending_gain=gain))
    for rate, ahead in product(rates, LOOK_AHEADS_M):
        cases.append(Case("c_v", "ideal", "thesis", "line", rate, 0.5, look_ahead_m=ahead))
    for rate, gain, ahead, state in product(rates, BENDING_GAINS, LOOK_AHEADS_M, thesis_states()):
        cases.append(Case("grid", "ideal", "thesis", state.path, rate, *state[1:], 0.0, ahead, gain))
    return cases
