"""Where a robot on two wheels is, from readings of its wheels that come one after the other."""

from __future__ import annotations

import math
from typing import Final

from daemon.loops.differential import DifferentialDrive
from daemon.loops.odometry import Pose
from daemon.loops.pose_feedback import AlignedTurns, GearPlay

MAX_TURN_RAD: Final = 30.0
"""A wheel that seems to have turned farther between two readings was counted anew, or its reading is wrong."""

Reading = tuple[float, float]
"""Angle of a wheel [rad] and the time of its reading [s]."""


class DifferentialOdometry:
    """Adds up turns of both wheels, each behind a gear with play.

    Args:
        drive: the robot.
        play_rad: of the right and the left gear.
        left_first: whether the left wheel is read before the right one.

    Attributes:
        pose: where the robot's centre is.
        rounds: pairs of readings so far.
        skipped: pairs that were not used because they cannot be true.
    """

    def __init__(self, drive: DifferentialDrive, play_rad: tuple[float, float], left_first: bool = False) -> None:
        self.pose = Pose()
        self.rounds = 0
        self.skipped = 0
        self._drive = drive
        self._plays = (GearPlay(play_rad[0]), GearPlay(play_rad[1]))
        self._left_first = left_first
        self._aligned = AlignedTurns()
        self._last: tuple[float, float] | None = None
        self._read_s = (-math.inf, -math.inf)

    def update(self, right: Reading, left: Reading) -> None:
        """Take the newest readings; what counts is a pair of which both are new, in the order of reading."""
        first_s, second_s = (left[1], right[1]) if self._left_first else (right[1], left[1])
        if second_s < first_s or first_s <= self._read_s[0] or second_s <= self._read_s[1]:
            return
        self._read_s = (first_s, second_s)
        self.rounds += 1
        turns = self._turns(right, left)
        last, self._last = self._last, turns
        if last is None:
            return
        right_rad, left_rad = turns[0] - last[0], turns[1] - last[1]
        if max(abs(right_rad), abs(left_rad)) > MAX_TURN_RAD:
            self.skipped += 1
        else:
            self.pose = self._drive.moved(self.pose, right_rad, left_rad)

    def _turns(self, right: Reading, left: Reading) -> tuple[float, float]:
        """Angles of the wheels behind their gears at one time."""
        if self._left_first:
            left_rad, right_rad = self._aligned.align(left, right)
        else:
            right_rad, left_rad = self._aligned.align(right, left)
        return self._plays[0].follow(right_rad), self._plays[1].follow(left_rad)
