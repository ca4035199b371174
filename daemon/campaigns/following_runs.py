"""Runs of a following law on a semi-trailer, and what comes out of them."""

from __future__ import annotations

import math
import random
from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import product
from typing import Final

from daemon.campaigns.ideal_semitrailer import (
    CIRCLE_BACKWARDS,
    LINE_BACKWARDS,
    SEMITRAILER,
    Errors,
    SemitrailerPlant,
    placed,
)
from daemon.loops.cascade_following import CascadeFollower, CascadeTuning
from daemon.loops.odometry import Pose
from daemon.loops.path import Path, Piece
from daemon.loops.path_following import FollowingStep, FollowingTuning, PathFollower

SPEED_M_S: Final = 0.2
NEAR_M: Final = 0.01
NEAR_RAD: Final = math.radians(1)


Law = Callable[[Pose, float, float, float], FollowingStep]
"""A command from the pose of the reference unit, bending angle, steering angle and speed."""


def thesis_law(piece: Piece, tuning: FollowingTuning | None = None, published: bool = False) -> Law:
    """The thesis' law on one piece."""
    follower = PathFollower(SEMITRAILER, Path([piece]), tuning or FollowingTuning(), published)
    return lambda pose, bending, steering, speed: follower.step(pose, bending)


def cascade_law(piece: Piece, rate_rad_s: float | None = None, tuning: CascadeTuning | None = None) -> Law:
    """The cascade on one piece, with a steering of this rate."""
    rate = math.inf if rate_rad_s is None else rate_rad_s
    return CascadeFollower(SEMITRAILER, Path([piece]), tuning or CascadeTuning(), rate).step


@dataclass
class Run:
    """What a run showed at its control instants.

    Attributes:
        position_m: to the left on a line, to the outside on a circle.
        heading_rad, bending_rad: errors.
        settle_m: way after which position and heading stay near the path's; None when they never do.
    """

    position_m: list[float] = field(default_factory=list)
    heading_rad: list[float] = field(default_factory=list)
    bending_rad: list[float] = field(default_factory=list)
    settle_m: float | None = None

    @property
    def worst(self) -> tuple[float, float, float]:
        """Largest errors of position, heading and bending angle."""
        return (_largest(self.position_m), _largest(self.heading_rad), _largest(self.bending_rad))


def _largest(values: list[float]) -> float:
    return max(map(abs, values))


def drive(
    law: Law,
    plant: SemitrailerPlant,
    piece: Piece,
    duration_s: float,
    period_s: float = 0.05,
    speed_m_s: float = SPEED_M_S,
) -> Run:
    """Let a law drive along an endless piece, its command held for a period."""
    run = Run()
    sign = -1.0 if piece.heading_curvature > 0 else 1.0
    speed = -speed_m_s if piece.backward else speed_m_s
    last_off = -1
    for instant in range(round(duration_s / period_s) + 1):
        reference = plant.trailer if piece.backward else plant.truck
        step = law(reference, plant.bending_rad, plant.steering_rad, speed)
        errors = step.errors
        run.position_m.append(sign * errors.position_m)
        run.heading_rad.append(errors.heading_rad)
        run.bending_rad.append(errors.bending_rad or 0.0)
        if abs(errors.position_m) > NEAR_M or abs(errors.heading_rad) > NEAR_RAD:
            last_off = instant
        plant.advance(speed, step.steering_rad, period_s)
    settled = last_off + 1
    run.settle_m = speed_m_s * period_s * settled if settled < len(run.position_m) else None
    return run


State = tuple[Piece, Errors]


def forty_states() -> list[State]:
    """The initial errors of the thesis' section 6.2 on line and circle: single ones, and those of Table B.1 on both."""
    signs = (1, -1)
    single = [Errors(position_m=sign * size) for size in (0.1, 0.2) for sign in signs]
    single += [Errors(heading_rad=math.radians(sign * size)) for size in (5, 10) for sign in signs]
    single += [Errors(bending_rad=math.radians(sign * size)) for size in (5, 10) for sign in signs]
    turned = [math.radians(sign * 10) for sign in signs]
    combined = [Errors(position_m=sign * y, heading_rad=t) for y, sign, t in product((0.1, 0.2), signs, turned)]
    return list(product((LINE_BACKWARDS, CIRCLE_BACKWARDS), single + combined))


def random_states(count: int, seed: int) -> list[State]:
    """Errors of position within 0.25 m, of heading and bending angle within 15 degrees; line and circle in turn."""
    chance = random.Random(seed)
    angle = math.radians(15)
    paths = (LINE_BACKWARDS, CIRCLE_BACKWARDS)
    return [
        (
            paths[number % 2],
            Errors(chance.uniform(-0.25, 0.25), chance.uniform(-angle, angle), chance.uniform(-angle, angle)),
        )
        for number in range(count)
    ]


def campaign(law: Callable[[Piece, float | None], Law], states: list[State], rate_deg_s: float | None) -> list[Run]:
    """One run of 20 s from each state, at ``SPEED_M_S`` and 50 ms."""
    rate = None if rate_deg_s is None else math.radians(rate_deg_s)
    return [drive(law(piece, rate), placed(piece, errors, rate), piece, 20.0) for piece, errors in states]
