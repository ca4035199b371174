"""Motions of a robot on omni-wheels, from their begin to rest."""

from __future__ import annotations

import math
from typing import Any

from canhelm.errors import DeviceFault, Timeout
from daemon.loops.measurement import Command, Measurement
from daemon.loops.omni_drive import OmniLaw, OmniRecord
from daemon.loops.omni_guide import Twist, TwistGuide
from daemon.loops.omni_senses import OmniSenses
from daemon.loops.planner import PlanarLimits, PlanarState, Result
from daemon.loops.published_traction import LEAST_FACTOR
from daemon.runtime.motions import Motion
from daemon.runtime.poses import place_and_heading
from daemon.runtime.streams import Streamed

FAILED = (Result.INVALID, Result.GOAL_TOO_FAST)
STANDING: Twist = (0.0, 0.0, 0.0)
PATIENCE = 2.0
"""Times the longest drive that a planner without an end of its own may take."""


def longest_drive_s(distance_m: float, limits: PlanarLimits) -> float:
    """Time that the published planner gets, which may never arrive [s].

    From rest to rest takes s / v + v / a; here a is as low as its traction control makes it, and the time counts twice.

    Args:
        distance_m: s, to the goal.
        limits: of the motion, v and a.
    """
    return PATIENCE * (distance_m / limits.speed + limits.speed / (LEAST_FACTOR * limits.acceleration))


class OmniMotion(Motion):
    """A motion by the law.

    Args:
        senses: what the vehicle knows of its own motion.
        law: of its own.

    Attributes:
        record: of the last step; None before the first.
        least_factor: smallest safety factor so far.
        slip_steps: steps in which slip was detected.
    """

    def __init__(
        self,
        kind: str,
        drives: tuple[str, ...],
        lease: str | None,
        senses: OmniSenses,
        law: OmniLaw,
        stream: Streamed[Twist] | None = None,
    ) -> None:
        super().__init__(kind, drives, lease, stream)
        self.record: OmniRecord | None = None
        self.least_factor = 1.0
        self.slip_steps = 0
        self._senses = senses
        self._law = law

    def step(self, measurement: Measurement, dt_s: float) -> Command:
        """One step of the law; once stopped it brings the robot to rest."""
        if self.stop_reason:
            self._law.stop()
        command, record = self._law.step(self._senses, dt_s)
        self.record = record
        if not record.stopping:
            self.least_factor = min(self.least_factor, record.guidance.safety_factor)
            self.slip_steps += any(record.guidance.slip)
        if record.guidance.result in FAILED:
            remedy = "`canhelm status` shows pose and limits; give another goal"
            self.fail(DeviceFault(f"{self.kind}: {record.guidance.result.value}", remedy=remedy))
        elif record.done:
            self.on_done(measurement, record)
        return command

    def on_done(self, measurement: Measurement, record: OmniRecord) -> None:
        """The law is done."""
        self.finish(self.numbers(measurement))

    def numbers(self, measurement: Measurement) -> dict[str, Any]:
        """Where the robot is, and how it went."""
        return {
            **place_and_heading(self._senses.pose),
            "duration_s": round(measurement.time_s - self.begun_s, 3),
            "least_safety_factor": round(self.least_factor, 3),
            "slip_steps": self.slip_steps,
        }

    def progress(self) -> dict[str, Any]:
        """Case, result so far, limits in force, ETA, traction and error of following."""
        record = self.record
        if record is None:
            return {"phase": "enabling"}
        guidance = record.guidance
        limits, eta = guidance.limits, guidance.eta_s
        return {
            "phase": "stopping" if record.stopping else guidance.result.value,
            "case": guidance.case,
            "eta_s": round(eta, 3) if math.isfinite(eta) else None,
            "speed_m_s": round(math.hypot(guidance.next.vx, guidance.next.vy), 4),
            "speed_limit_m_s": round(limits.speed, 4),
            "acceleration_limit_m_s2": round(limits.acceleration, 4),
            "yaw_rate_limit_deg_s": round(math.degrees(limits.rate), 3),
            "safety_factor": round(guidance.safety_factor, 3),
            "slip": list(guidance.slip),
            "pushing": record.felt.pushing,
            "correction": guidance.correction,
            "error_m": round(math.hypot(record.error[0], record.error[1]), 4),
        }


class GoalMotion(OmniMotion):
    """To a goal; where it is passed with a velocity the robot comes to rest behind it.

    Args:
        goal: in the odometry's frame.
        longest_s: time after which it is given up.
    """

    def __init__(
        self,
        kind: str,
        drives: tuple[str, ...],
        lease: str | None,
        senses: OmniSenses,
        law: OmniLaw,
        goal: PlanarState,
        longest_s: float = math.inf,
    ) -> None:
        super().__init__(kind, drives, lease, senses, law)
        self._goal = goal
        self._longest_s = longest_s
        self._reached: dict[str, Any] | None = None

    def step(self, measurement: Measurement, dt_s: float) -> Command:
        """One step of the law, unless the time is over."""
        if self._reached is None and measurement.time_s - self.begun_s > self._longest_s:
            message = f"{self.kind}: the published planner did not arrive in {self._longest_s:.1f} s"
            remedy = "drive without --published; docs/turtle.md tells what is peculiar about it"
            self.fail(Timeout(message, value=self.numbers(measurement), remedy=remedy))
        return super().step(measurement, dt_s)

    def on_done(self, measurement: Measurement, record: OmniRecord) -> None:
        """At the goal, or at rest behind it."""
        if self._reached is None:
            self._reached = self._at_goal(measurement)
        if record.stopping or math.hypot(self._goal.vx, self._goal.vy) == 0.0:
            self.finish(self._reached)
        else:
            self._law.stop()

    def _at_goal(self, measurement: Measurement) -> dict[str, Any]:
        pose, goal = self._senses.pose, self._goal
        turn = math.remainder(goal.heading - pose.yaw_rad, math.tau)
        return {
            "result": Result.ARRIVED.value,
            **self.numbers(measurement),
            "error_m": round(math.hypot(goal.x - pose.x_m, goal.y - pose.y_m), 4),
            "heading_error_deg": round(math.degrees(turn), 3),
        }


class TwistMotion(OmniMotion):
    """A twist for a time, until stopped, or as a stream has it (``drive.set``).

    Args:
        guide: the law's.
        duration_s: time after which it ends; None: until stopped.
        stream: of twists; the robot rests while the newest is too old.
    """

    def __init__(
        self,
        kind: str,
        drives: tuple[str, ...],
        lease: str | None,
        senses: OmniSenses,
        law: OmniLaw,
        guide: TwistGuide,
        duration_s: float | None = None,
        stream: Streamed[Twist] | None = None,
    ) -> None:
        super().__init__(kind, drives, lease, senses, law, stream)
        self._guide = guide
        self._remaining_s = math.inf if duration_s is None else duration_s

    def step(self, measurement: Measurement, dt_s: float) -> Command:
        """The twist until the time is over or the newest is too old, then rest."""
        self._remaining_s -= dt_s
        twist = self.newest(self._guide.twist)
        self._guide.twist = STANDING if twist is None or self._remaining_s <= 0.0 else twist
        return super().step(measurement, dt_s)

    def on_done(self, measurement: Measurement, record: OmniRecord) -> None:
        """At rest: over, unless it stands because that was asked for."""
        if record.stopping or self._remaining_s <= 0.0:
            super().on_done(measurement, record)
