"""Runs of a law on the ideal semi-trailer, and what comes out of them."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Final

from daemon.campaigns.cases import DURATION_S, PERIOD_S, SPEED_M_S, Case, Outcome
from daemon.campaigns.ideal_semitrailer import (
    CIRCLE_BACKWARDS,
    LINE_BACKWARDS,
    SEMITRAILER,
    Errors,
    SemitrailerPlant,
    placed,
)
from daemon.loops.cascade_following import CascadeFollower, CascadeTuning
from daemon.loops.geometry import clamp
from daemon.loops.odometry import Pose
from daemon.loops.path import Path, Piece
from daemon.loops.path_following import FollowingStep, FollowingTuning, PathFollower, bending_law

NEAR_M: Final = 0.01
NEAR_RAD: Final = math.radians(1)
PATHS: Final = {"line": LINE_BACKWARDS, "circle": CIRCLE_BACKWARDS}

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
        way_m: driven so far, by the truck.
        position_m: to the left on a line, to the outside on a circle.
        heading_rad, bending_rad: errors.
        steering_rad: commanded.
        settle_m: way after which position and heading stay near the path's; None when they never do.
    """

    way_m: list[float] = field(default_factory=list)
    position_m: list[float] = field(default_factory=list)
    heading_rad: list[float] = field(default_factory=list)
    bending_rad: list[float] = field(default_factory=list)
    steering_rad: list[float] = field(default_factory=list)
    settle_m: float | None = None

    @property
    def worst(self) -> tuple[float, float, float]:
        """Largest errors of position, heading and bending angle."""
        return (_largest(self.position_m), _largest(self.heading_rad), _largest(self.bending_rad))

    def add(self, way_m: float, errors: tuple[float, float, float], steering_rad: float) -> None:
        """One control instant; errors of position, heading and bending angle."""
        self.way_m.append(way_m)
        for values, error in zip((self.position_m, self.heading_rad, self.bending_rad), errors, strict=True):
            values.append(error)
        self.steering_rad.append(steering_rad)

    def settle(self, near: Callable[[int], bool]) -> None:
        """Set ``settle_m`` to the way at the first instant after which all are near."""
        count = len(self.way_m)
        settled = next((instant + 1 for instant in reversed(range(count)) if not near(instant)), 0)
        self.settle_m = self.way_m[settled] if settled < count else None

    def settle_on_path(self) -> None:
        """Near is within ``NEAR_M`` and ``NEAR_RAD`` of the path."""
        self.settle(lambda i: abs(self.position_m[i]) <= NEAR_M and abs(self.heading_rad[i]) <= NEAR_RAD)


def _largest(values: list[float]) -> float:
    return max(map(abs, values))


def _way(step_m: float, steps: int) -> float:
    return round(step_m * steps, 9)


def outside_sign(piece: Piece) -> float:
    """Factor from an error of position to the left to one to the outside of a circle."""
    return -1.0 if piece.heading_curvature > 0 else 1.0


def drive(
    law: Law,
    plant: SemitrailerPlant,
    piece: Piece,
    duration_s: float = DURATION_S,
    period_s: float = PERIOD_S,
    speed_m_s: float = SPEED_M_S,
) -> Run:
    """Let a law drive along an endless piece, its command held for a period."""
    run = Run()
    sign = outside_sign(piece)
    speed = -speed_m_s if piece.backward else speed_m_s
    for instant in range(round(duration_s / period_s) + 1):
        reference = plant.trailer if piece.backward else plant.truck
        step = law(reference, plant.bending_rad, plant.steering_rad, speed)
        errors = step.errors
        shown = (sign * errors.position_m, errors.heading_rad, errors.bending_rad or 0.0)
        run.add(_way(speed_m_s * period_s, instant), shown, step.steering_rad)
        plant.advance(speed, step.steering_rad, period_s)
    run.settle_on_path()
    return run


def bend(case: Case) -> Run:
    """Steer the bending angle from one value to another by the thesis' law (section 6.1), without a path."""
    run = Run()
    start = Errors(0.0, 0.0, math.radians(case.bending_deg))
    plant, target = placed(LINE_BACKWARDS, start, _rate(case)), math.radians(case.target_deg)
    for instant in range(round(DURATION_S / PERIOD_S) + 1):
        wanted = bending_law(SEMITRAILER, case.bending_gain, target, plant.bending_rad)
        steering = clamp(wanted, SEMITRAILER.max_steering_rad)
        run.add(_way(SPEED_M_S * PERIOD_S, instant), (0.0, 0.0, plant.bending_rad - target), steering)
        plant.advance(-SPEED_M_S, steering, PERIOD_S)
    run.settle(lambda i: abs(run.bending_rad[i]) <= NEAR_RAD)
    return run


def _rate(case: Case) -> float | None:
    return None if case.rate_deg_s is None else math.radians(case.rate_deg_s)


def errors_of(case: Case) -> Errors:
    """The errors that a case begins with, in SI."""
    return Errors(case.position_m, math.radians(case.heading_deg), math.radians(case.bending_deg))


def ideal_run(case: Case) -> Run:
    """Drive a case with ideal kinematics."""
    if case.path == "none":
        return bend(case)
    piece, rate = PATHS[case.path], _rate(case)
    if case.law == "thesis":
        law = thesis_law(piece, FollowingTuning(case.look_ahead_m, case.bending_gain))
    else:
        law = cascade_law(piece, rate)
    return drive(law, placed(piece, errors_of(case), rate), piece)


def outcome(run: Run, ended: str = "driven") -> Outcome:
    """The figures of a run."""
    position, heading, bending = run.worst
    return Outcome(
        run.settle_m,
        position,
        math.degrees(heading),
        math.degrees(bending),
        _overshoot(run.position_m),
        math.degrees(_overshoot(run.bending_rad)),
        ended,
    )


def _overshoot(errors: list[float]) -> float:
    """The largest error on the other side than the first one; 0 without a first one."""
    if not errors[0]:
        return 0.0
    return max(0.0, *(-error if errors[0] > 0 else error for error in errors))
