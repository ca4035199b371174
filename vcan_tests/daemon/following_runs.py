"""Runs of a following law on a semi-trailer, and what comes out of them."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Final, Protocol

from daemon.loops.odometry import Pose
from daemon.loops.path import Piece
from daemon.loops.path_following import FollowingStep
from vcan_tests.daemon.semitrailer_plant import SemitrailerPlant

SPEED_M_S: Final = 0.2
NEAR_M: Final = 0.01
NEAR_RAD: Final = math.radians(1)


class Follower(Protocol):
    """A law."""

    def step(self, pose: Pose, bending_rad: float) -> FollowingStep:
        """One command."""
        ...


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

    @property
    def iae_m2(self) -> float:
        """Integral of the position's error over the way of a run at ``SPEED_M_S`` in steps of 50 ms."""
        return sum(map(abs, self.position_m)) * SPEED_M_S * 0.05


def _largest(values: list[float]) -> float:
    return max(map(abs, values))


def drive(
    law: Follower,
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
        step = law.step(plant.trailer if piece.backward else plant.truck, plant.bending_rad)
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
