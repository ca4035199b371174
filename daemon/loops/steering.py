"""Turns one wheel pair by opposite speeds of its two wheels, closed on the steering encoder.

With the body at rest a pair that turns at rate rho rolls its right wheel at +a rho and its left wheel at -a rho, where
a is the way from the steering axis to the contact point along the axle. The law works with that rim speed a rho.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum
from typing import Final

from daemon.loops.motion_profile import approach_speed, ramp
from profiles.schema import Limits

REST_SPEED_M_S: Final = 0.005
"""A wheel that is slower counts as at rest (a few counts of its encoder per cycle)."""
GAIN_1_S: Final = 6.0
"""Of the final approach; with three cycles of delay at 100 Hz well inside 1/e, so that nothing overshoots."""
GAIN_CYCLES: Final = 0.06
"""Largest gain times cycle: the same distance from overshoot at slower cycles."""
SETTLE_TIME_S: Final = 0.05
CREEP_TIME_S: Final = 0.1
CREEP_CYCLES: Final = 8
"""The slowest turning covers one tolerance in this time; slower, dry friction would hold the pair."""
PROGRESS_TIME_S: Final = 4.0
"""Time in which a pair has to come nearer to its target; soft speed regulators need long against dry friction."""
WRONG_WAY_RAD: Final = math.radians(5)


class SteeringPhase(StrEnum):
    """What the law is doing."""

    TURNING = "turning"
    SETTLING = "settling"
    """Near enough, waiting for the wheels to rest."""
    DONE = "done"
    FAILED = "failed"


@dataclass(frozen=True, slots=True)
class SteeringRecord:
    """The terms of one step.

    Attributes:
        phase: what the law is doing.
        error_rad: target minus heading.
        rim_speed_m_s: commanded; positive turns counter-clockwise.
        failure: why the pair does not reach its target, or "".
    """

    phase: SteeringPhase
    error_rad: float
    rim_speed_m_s: float
    failure: str = ""


class PairSteering:
    """The law for one turn of one pair.

    Args:
        contact_offset_m: a, from the steering axis to the contact point along the axle.
        limits: rim speed, acceleration and tolerance.
    """

    def __init__(self, contact_offset_m: float, limits: Limits) -> None:
        self._offset_m = contact_offset_m
        self._tolerance_rad = math.radians(limits.heading_tolerance_deg)
        self._max_speed_m_s = limits.steering_rim_speed_m_s
        self._acceleration_m_s2 = limits.acceleration_m_s2
        self._creep_m_s = min(contact_offset_m * self._tolerance_rad / CREEP_TIME_S, self._max_speed_m_s)
        self._phase = SteeringPhase.TURNING
        self._speed_m_s = 0.0
        self._failure = ""
        self._target_rad = math.nan
        self._best_rad = math.inf
        self._without_progress_s = 0.0
        self._at_rest_s = 0.0

    def step(
        self, heading_rad: float, target_rad: float | None, wheel_speed_m_s: tuple[float, float], dt: float
    ) -> SteeringRecord:
        """One cycle.

        Args:
            heading_rad: of the pair, from its encoder.
            target_rad: where it shall point; may change while it turns. None: come to rest wherever it is.
            wheel_speed_m_s: measured rim speeds of the pair's two wheels.
            dt: time since the last step [s].

        Returns:
            the rim speed to command and what there is to say about it. After a failure the speed only ramps to zero.
        """
        error = 0.0 if target_rad is None else target_rad - heading_rad
        if target_rad is not None and not abs(target_rad - self._target_rad) <= self._tolerance_rad:
            self._retarget(target_rad)
        if self._phase is not SteeringPhase.FAILED:
            self._watch(error, dt)
        self._advance(error, wheel_speed_m_s, dt)
        self._speed_m_s = ramp(self._speed_m_s, self._wanted(error, dt), self._acceleration_m_s2, dt)
        return SteeringRecord(self._phase, error, self._speed_m_s, self._failure)

    def _retarget(self, target_rad: float) -> None:
        self._target_rad = target_rad
        self._best_rad = math.inf
        self._without_progress_s = 0.0
        if self._phase is SteeringPhase.DONE:
            self._phase = SteeringPhase.TURNING

    def _watch(self, error: float, dt: float) -> None:
        distance = abs(error)
        self._without_progress_s += dt
        if not math.isfinite(error):
            self._fail("the steering encoder gives no heading; check its cable and its node")
        elif distance < self._best_rad - self._tolerance_rad / 2 or self._speed_m_s * error < 0:
            self._best_rad = distance
            self._without_progress_s = 0.0
        elif distance > self._best_rad + WRONG_WAY_RAD:
            self._fail("the pair turns away from its target; check the directions of its encoder and its drives")
        elif self._phase is SteeringPhase.TURNING and self._without_progress_s > PROGRESS_TIME_S:
            self._fail(
                f"the pair does not turn: {math.degrees(error):.2f} deg left and no progress in {PROGRESS_TIME_S:g} s; "
                "check its brake, its drives and what stands against its wheels"
            )

    def _fail(self, reason: str) -> None:
        self._phase = SteeringPhase.FAILED
        self._failure = reason

    def _advance(self, error: float, wheel_speed_m_s: tuple[float, float], dt: float) -> None:
        resting = all(abs(speed) <= REST_SPEED_M_S for speed in wheel_speed_m_s)
        self._at_rest_s = self._at_rest_s + dt if resting and self._speed_m_s == 0 else 0.0
        if self._phase is SteeringPhase.TURNING and abs(error) <= self._tolerance_rad / 2:
            self._phase = SteeringPhase.SETTLING
        elif self._phase is SteeringPhase.SETTLING and self._at_rest_s >= SETTLE_TIME_S:
            near = abs(error) <= self._tolerance_rad
            self._phase = SteeringPhase.DONE if near else SteeringPhase.TURNING

    def _wanted(self, error: float, dt: float) -> float:
        if self._phase is not SteeringPhase.TURNING:
            return 0.0
        gain = min(GAIN_1_S, GAIN_CYCLES / dt)
        speed = approach_speed(self._offset_m * abs(error), gain, self._acceleration_m_s2 / 2)
        creep = self._creep_m_s * min(1.0, CREEP_TIME_S / (CREEP_CYCLES * dt))
        return math.copysign(min(max(speed, creep), self._max_speed_m_s), error)
