"""Motions of a robot on two wheels: to poses under feedback, and moves that its brick carries out itself."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from canhelm.errors import Refused, Timeout
from daemon.loops.differential import DifferentialDrive, Move, TachoCompensation, wrap_angle
from daemon.loops.differential_odometry import DifferentialOdometry
from daemon.loops.measurement import Command, Measurement
from daemon.loops.odometry import Pose
from daemon.loops.pose_feedback import GoalSeeker, Phase, SeekSettings
from daemon.runtime.motions import Motion
from daemon.runtime.rest import AT_REST_M_S
from drivers.nxt.brick import Brick
from drivers.nxt.codes import Output

STANDING = Command((0.0, 0.0))


def pose_numbers(pose: Pose, goal: Pose) -> dict[str, Any]:
    """A pose, and how far it is from the one that was wanted."""
    return {
        "x_m": round(pose.x_m, 4) + 0.0,
        "y_m": round(pose.y_m, 4) + 0.0,
        "heading_deg": round(math.degrees(wrap_angle(pose.yaw_rad)), 2) + 0.0,
        "error_m": round(math.hypot(goal.x_m - pose.x_m, goal.y_m - pose.y_m), 4),
        "heading_error_deg": round(math.degrees(wrap_angle(goal.yaw_rad - pose.yaw_rad)), 2) + 0.0,
    }


class PoseMotion(Motion):
    """To one pose after the other under feedback; the law is asked once for each pair of readings.

    Args:
        drive: the robot.
        odometry: where it is.
        goals: in the odometry's frame, at least one.
        settings: how each is sought.
    """

    def __init__(
        self,
        kind: str,
        names: tuple[str, ...],
        lease: str | None,
        drive: DifferentialDrive,
        odometry: DifferentialOdometry,
        goals: Sequence[Pose],
        settings: SeekSettings,
    ) -> None:
        super().__init__(kind, names, lease)
        self._drive = drive
        self._odometry = odometry
        self._seekers = [GoalSeeker(drive, goal, settings) for goal in goals]
        self._goals = goals
        self._settings = settings
        self._reached = 0
        self._command = STANDING
        self._seen = odometry.rounds
        self._seen_s = 0.0

    def begin(self, now_s: float) -> None:
        """From now on time counts."""
        super().begin(now_s)
        self._seen_s = now_s

    def step(self, measurement: Measurement, dt_s: float) -> Command:
        """What the law said to the last pair of readings; at rest once stopped."""
        if self.stop_reason:
            self._command = STANDING
            if all(abs(speed) < AT_REST_M_S for speed in measurement.wheel_speed_m_s):
                self.finish({})
        elif self._odometry.rounds != self._seen:
            self._seen = self._odometry.rounds
            self._seek(measurement.time_s)
        return self._command

    def _seek(self, now_s: float) -> None:
        seeker = self._seekers[self._reached]
        right, left = seeker.step(self._odometry.pose, now_s - self._seen_s)
        self._seen_s = now_s
        radius = self._drive.wheel_radius_m
        self._command = Command((radius * right, radius * left))
        if seeker.phase is Phase.TIMED_OUT:
            self.fail(self._too_late())
        elif seeker.phase is Phase.REACHED and self._reached + 1 < len(self._seekers):
            self._reached += 1
        elif seeker.phase is Phase.REACHED:
            duration_s = round(now_s - self.begun_s, 3)
            self.finish({"result": "arrived", **self._numbers(), "duration_s": duration_s})

    def _numbers(self) -> dict[str, Any]:
        return pose_numbers(self._odometry.pose, self._goals[self._reached])

    def _too_late(self) -> Timeout:
        left = self._numbers()
        return Timeout(
            f"the goal was not reached in {self._settings.timeout_s:g} s: {left['error_m']:g} m and "
            f"{left['heading_error_deg']:g} deg are missing",
            value=left,
            remedy="is something in the way? give more time, or a wider tolerance",
        )

    def progress(self) -> dict[str, Any]:
        """Phase, which goal, and how far it is."""
        seeker = self._seekers[self._reached]
        return {"phase": seeker.phase.value, "goal": self._reached + 1, "of": len(self._goals), **self._numbers()}


@dataclass(frozen=True, slots=True)
class BrickWheels:
    """Both wheels of a robot at one brick: outputs and directions, right first."""

    brick: Brick
    outputs: tuple[Output, Output]
    directions: tuple[int, int]

    def legs(self, move: Move) -> dict[Output, tuple[float, float]]:
        """A move for the brick."""
        wheels = zip(self.outputs, self.directions, move, strict=True)
        return {output: (leg.power, sign * leg.angle_deg) for output, sign, leg in wheels}

    def turned_deg(self, before: Mapping[Output, int], now: Mapping[Output, int]) -> tuple[float, float]:
        """How far the wheels have turned, forward positive."""
        right, left = (
            sign * float(now[output] - before[output])
            for output, sign in zip(self.outputs, self.directions, strict=True)
        )
        return right, left


class BrickMoves(Motion):
    """Moves that the brick ends by its own tacho limits, one after the other, each from rest to rest.

    Args:
        drive: the robot.
        odometry: where it is.
        wheels: at the brick.
        moves: what to drive.
        compensate: take what a wheel turned too far off its next move, as the NXT report does.
    """

    def __init__(
        self,
        kind: str,
        names: tuple[str, ...],
        lease: str | None,
        drive: DifferentialDrive,
        odometry: DifferentialOdometry,
        wheels: BrickWheels,
        moves: Sequence[Move],
        compensate: bool,
    ) -> None:
        super().__init__(kind, names, lease)
        self._drive = drive
        self._odometry = odometry
        self._wheels = wheels
        self._moves = moves
        self._compensation = TachoCompensation() if compensate else None
        self._errors_deg: list[tuple[float, float]] = []

    async def start(self) -> None:
        """Drive them all; the drives are told nothing meanwhile."""
        loop = asyncio.get_running_loop()
        self.begun_s, goal = loop.time(), self._odometry.pose
        try:
            counts: Mapping[Output, int] = await self._wheels.brick.until_rest(self._wheels.outputs)
            for move in self._moves:
                if not self.stop_reason:
                    counts = await self._drive_one(move, counts)
                    goal = self._drive.moved(goal, *(math.radians(leg.angle_deg) for leg in move))
        except Refused:
            if not self.stop_reason:
                raise
        numbers = {**pose_numbers(self._odometry.pose, goal), "duration_s": round(loop.time() - self.begun_s, 3)}
        self.finish({**numbers, "tacho_errors_deg": self._errors_deg})

    async def _drive_one(self, move: Move, before: Mapping[Output, int]) -> Mapping[Output, int]:
        compensation, wheels = self._compensation, self._wheels
        await wheels.brick.move(wheels.legs(compensation.corrected(move) if compensation else move))
        counts = await wheels.brick.settle(wheels.outputs)
        turned = wheels.turned_deg(before, counts)
        if compensation:
            compensation.moved(move, turned)
        right, left = (round(way - leg.angle_deg, 1) for way, leg in zip(turned, move, strict=True))
        self._errors_deg.append((right, left))
        return counts

    def stop(self, reason: str) -> None:
        """Brake; the move under way fails."""
        super().stop(reason)
        self._wheels.brick.stop()

    def step(self, measurement: Measurement, dt_s: float) -> Command:
        """Never moves a wheel itself."""
        return STANDING

    def progress(self) -> dict[str, Any]:
        """Which move it is at."""
        pose = self._odometry.pose
        return {
            "move": min(len(self._errors_deg) + 1, len(self._moves)),
            "of": len(self._moves),
            "x_m": round(pose.x_m, 3) + 0.0,
            "y_m": round(pose.y_m, 3) + 0.0,
            "heading_deg": round(math.degrees(wrap_angle(pose.yaw_rad)), 1) + 0.0,
        }
