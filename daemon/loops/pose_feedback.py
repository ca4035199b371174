"""Driving a robot on two wheels to a pose by feedback: the polar law of Siegwart and Nourbakhsh, section 3.6.2.

With rho the distance to the goal, alpha its direction as seen from the robot and beta the goal's heading as seen from
that direction, v = k_rho rho and omega = k_alpha alpha + k_beta beta. (The book writes beta with the other sign; so
does the NXT report.)
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum
from typing import Final

from daemon.loops.differential import DifferentialDrive, limit_speeds, wrap_angle
from daemon.loops.odometry import Pose


@dataclass(frozen=True, slots=True)
class PoseGains:
    """Gains of the law [1/s]."""

    rho: float
    alpha: float
    beta: float

    @property
    def stable(self) -> bool:
        """Whether the goal is approached from near (the law linearised about it)."""
        return self.rho > 0 and self.beta < 0 and self.alpha > self.rho


REPORT_GAINS: Final = PoseGains(3.0, 8.0, -1.5)
"""Those of the NXT report's calls, for a cycle of 0.2 s at most."""
SLOW_CYCLE_GAINS: Final = PoseGains(1.0, 2.5, -0.5)
"""For cycles of up to 0.3 s with as much delay again: what Bluetooth allows."""


@dataclass(frozen=True, slots=True)
class Tolerance:
    """What counts as there."""

    x_m: float
    y_m: float
    yaw_rad: float


def polar_law(pose: Pose, goal: Pose, gains: PoseGains) -> tuple[float, float]:
    """Speed forward [m/s] and yaw rate [rad/s] towards the goal; forward only, whatever way the robot looks."""
    dx, dy = goal.x_m - pose.x_m, goal.y_m - pose.y_m
    direction = math.atan2(dy, dx)
    alpha, beta = wrap_angle(direction - pose.yaw_rad), wrap_angle(goal.yaw_rad - direction)
    return gains.rho * math.hypot(dx, dy), gains.alpha * alpha + gains.beta * beta


def reversed_law(pose: Pose, goal: Pose, gains: PoseGains) -> tuple[float, float]:
    """The same backward: the law of a robot whose front is the back of this one."""
    forward, yaw_rate = polar_law(_turned_round(pose), _turned_round(goal), gains)
    return -forward, yaw_rate


def _turned_round(pose: Pose) -> Pose:
    return Pose(pose.x_m, pose.y_m, pose.yaw_rad + math.pi)


def in_position(pose: Pose, goal: Pose, tolerance: Tolerance) -> bool:
    """Whether x and y are within the tolerance."""
    return abs(goal.x_m - pose.x_m) <= tolerance.x_m and abs(goal.y_m - pose.y_m) <= tolerance.y_m


def at_goal(pose: Pose, goal: Pose, tolerance: Tolerance) -> bool:
    """Whether position and heading are within the tolerance; headings a full turn apart are the same."""
    heading_is_right = abs(wrap_angle(goal.yaw_rad - pose.yaw_rad)) <= tolerance.yaw_rad
    return heading_is_right and in_position(pose, goal, tolerance)


class Phase(StrEnum):
    """Where a drive to a pose stands."""

    DRIVING = "driving"
    TURNING = "turning"
    """In position; only the heading is missing."""
    SETTLING = "settling"
    """There, and stopped to see whether it stays so: what is known of a pose is always a little old."""
    REACHED = "reached"
    TIMED_OUT = "timed_out"


@dataclass(frozen=True, slots=True)
class SeekSettings:
    """How a goal is sought.

    Attributes:
        tolerance: what counts as there.
        timeout_s: time after which the goal is given up.
        wheel_limit_rad_s: highest speed of a wheel; both are slowed down together.
        gains: of the law.
        may_reverse: drive backward to a goal that lies behind.
        turn_in_place: turn on the spot once in position; the law alone comes to the heading only in the limit.
    """

    tolerance: Tolerance
    timeout_s: float
    wheel_limit_rad_s: float
    gains: PoseGains = SLOW_CYCLE_GAINS
    may_reverse: bool = True
    turn_in_place: bool = True


class GoalSeeker:
    """Drives to one pose; one call a cycle.

    Args:
        drive: the robot.
        goal: where to.
        settings: how.

    Attributes:
        phase: where it stands; REACHED and TIMED_OUT are final.

    Raises:
        ValueError: gains with which the robot does not come to the goal.
    """

    def __init__(self, drive: DifferentialDrive, goal: Pose, settings: SeekSettings) -> None:
        if not settings.gains.stable:
            raise ValueError(f"{settings.gains} never reach a goal: they need rho > 0, beta < 0 and alpha > rho")
        self.phase = Phase.DRIVING
        self._drive = drive
        self._goal = goal
        self._settings = settings
        self._law = polar_law
        self._elapsed_s = -1.0

    @property
    def done(self) -> bool:
        """Whether it has come to an end."""
        return self.phase in (Phase.REACHED, Phase.TIMED_OUT)

    def step(self, pose: Pose, dt_s: float) -> tuple[float, float]:
        """Speeds of the right and the left wheel [rad/s] for the coming cycle; 0 for ever once it is done.

        Args:
            pose: where the robot is.
            dt_s: time since the last call.
        """
        if self._elapsed_s < 0:
            self._elapsed_s = 0.0
            self._choose_direction(pose)
        else:
            self._elapsed_s += dt_s
        self._update_phase(pose)
        forward, yaw_rate = self._motion(pose)
        wheels = self._drive.wheel_speeds(forward, yaw_rate)
        return limit_speeds(*wheels, self._settings.wheel_limit_rad_s)

    def _motion(self, pose: Pose) -> tuple[float, float]:
        gains, goal = self._settings.gains, self._goal
        if self.phase is Phase.DRIVING:
            return self._law(pose, goal, gains)
        if self.phase is Phase.TURNING:
            return 0.0, gains.alpha * wrap_angle(goal.yaw_rad - pose.yaw_rad)
        return 0.0, 0.0

    def _choose_direction(self, pose: Pose) -> None:
        """Backward where the goal lies behind; once chosen it stays, or the robot would dither at a right angle."""
        dx, dy = self._goal.x_m - pose.x_m, self._goal.y_m - pose.y_m
        ahead = dx * math.cos(pose.yaw_rad) + dy * math.sin(pose.yaw_rad)
        if self._settings.may_reverse and ahead < 0:
            self._law = reversed_law

    def _update_phase(self, pose: Pose) -> None:
        settings = self._settings
        if self.done:
            return
        if at_goal(pose, self._goal, settings.tolerance):
            self.phase = Phase.REACHED if self.phase is Phase.SETTLING else Phase.SETTLING
        elif self._elapsed_s >= settings.timeout_s:
            self.phase = Phase.TIMED_OUT
        elif settings.turn_in_place and in_position(pose, self._goal, settings.tolerance):
            self.phase = Phase.TURNING
        else:
            self.phase = Phase.DRIVING


class GearPlay:
    """Where a wheel stands behind a gear with play: the motor takes it along only once the play is used up.

    Args:
        play_rad: how far the motor turns between both flanks; 0 for none.

    Attributes:
        wheel_rad: where the wheel stands; before the first turn of the motor in the middle of the play.
    """

    def __init__(self, play_rad: float) -> None:
        self.wheel_rad = 0.0
        self._half = play_rad / 2

    def follow(self, motor_rad: float) -> float:
        """Where the wheel stands now that the motor stands at ``motor_rad``."""
        self.wheel_rad = max(motor_rad - self._half, min(motor_rad + self._half, self.wheel_rad))
        return self.wheel_rad


class AlignedTurns:
    """Wheels that are read one after the other, at one time: that of the first reading.

    Where they turn alike, the time between both readings would look like a turn of the robot.
    """

    def __init__(self) -> None:
        self._last: tuple[float, float] | None = None

    def align(self, first: tuple[float, float], second: tuple[float, float]) -> tuple[float, float]:
        """Angles [rad] of both wheels when the first one was read.

        Args:
            first: angle [rad] of the wheel that is read first, and when [s].
            second: the same of the other one, which is interpolated between its last reading and this one.
        """
        last, self._last = self._last, second
        if last is None or second[1] <= last[1]:
            return first[0], second[0]
        share = (first[1] - last[1]) / (second[1] - last[1])
        return first[0], last[0] + (second[0] - last[0]) * max(0.0, min(1.0, share))
