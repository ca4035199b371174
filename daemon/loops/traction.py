"""Traction control: slip from commanded against measured acceleration, and a safety factor that answers it.

The factor multiplies the limit of acceleration, a friction circle, in all directions alike. What the published
controller (:mod:`daemon.loops.published_traction`) leaves open is done here: a positive correction waits, and waits
longer each time one has failed, so that the factor comes to rest on slippery floor; a negative one goes where the
measured acceleration tells that the floor ends, in one step; no correction is made before the last one can be seen;
where the goal would be overshot, and all of the limit is used, positive corrections stay small.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass
from enum import StrEnum
from typing import Final

from daemon.loops.accelerometer import Vector

LEAST_FACTOR: Final = 0.1


@dataclass(frozen=True, slots=True)
class TractionTuning:
    """What suits a robot. The defaults are for control cycles of 10 ms and an accelerometer's noise of 0.1 m/s2.

    Attributes:
        delay_cycles: from a command to the reading of the acceleration that it makes.
        response_s: time constant with which the drives follow a command.
        smoothing_s: time constant of the filter that expected and measured acceleration go through.
        slip_m_s2: difference of both above which slip begins.
        grip_m_s2: difference below which slip ends.
        confirm_s: time for which a difference has to last.
        top_speed_s: time after cruising at top speed for which slip is ignored.
        margin: part of the measured acceleration that is asked for after slip.
        visible_s: time after a correction before its effect is judged.
        hold_s: first time to wait before a positive correction.
        longest_hold_s: the wait is doubled up to this, each time that a positive correction brings slip back.
        raise_by: first positive correction; doubled each time that one succeeds.
    """

    delay_cycles: int = 1
    response_s: float = 0.02
    smoothing_s: float = 0.02
    slip_m_s2: float = 0.35
    grip_m_s2: float = 0.2
    confirm_s: float = 0.02
    top_speed_s: float = 0.05
    margin: float = 0.85
    visible_s: float = 0.1
    hold_s: float = 0.15
    longest_hold_s: float = 2.4
    raise_by: float = 0.1


@dataclass(frozen=True, slots=True)
class SlipSignal:
    """What tells slip in one step.

    Attributes:
        expected: acceleration that the commands should have made by now, smoothed [m/s2].
        measured: smoothed [m/s2].
        difference_m_s2: size of ``expected - measured``.
        axes: whether each axis alone differs enough for slip.
        slip: in any direction.
        ignored: slip is not looked for near top speed.
    """

    expected: Vector
    measured: Vector
    difference_m_s2: float
    axes: tuple[bool, bool]
    slip: bool
    ignored: bool


class SlipDetector:
    """Compares the measured acceleration with what the commands should make, with their delay and the drives' lag."""

    def __init__(self, tuning: TractionTuning) -> None:
        self._tuning = tuning
        self._underway: deque[Vector] = deque([(0.0, 0.0)] * tuning.delay_cycles)
        self._followed: Vector = (0.0, 0.0)
        self._expected: Vector = (0.0, 0.0)
        self._measured: Vector = (0.0, 0.0)
        self._slip = False
        self._lasting_s = 0.0
        self._since_top_speed_s = math.inf

    def step(self, measured: Vector, commanded: Vector, at_top_speed: bool, dt: float) -> SlipSignal:
        """One cycle.

        Args:
            measured: acceleration of the robot's centre [m/s2]; the last one counts where it is none.
            commanded: acceleration of this cycle in the same frame [m/s2]; zero counts where it is none.
            at_top_speed: the planner holds the speed limit.
            dt: time since the last step [s], positive.
        """
        tuning = self._tuning
        self._underway.append(commanded if _finite(commanded) else (0.0, 0.0))
        self._followed = _nearer(self._followed, self._underway.popleft(), tuning.response_s, dt)
        self._expected = _nearer(self._expected, self._followed, tuning.smoothing_s, dt)
        if _finite(measured):
            self._measured = _nearer(self._measured, measured, tuning.smoothing_s, dt)
        x, y = self._expected[0] - self._measured[0], self._expected[1] - self._measured[1]
        self._since_top_speed_s = 0.0 if at_top_speed else self._since_top_speed_s + dt
        ignored = self._since_top_speed_s < tuning.top_speed_s
        difference = math.hypot(x, y)
        self._judge(0.0 if ignored else difference, dt)
        axes = (abs(x) > tuning.slip_m_s2 and not ignored, abs(y) > tuning.slip_m_s2 and not ignored)
        return SlipSignal(self._expected, self._measured, difference, axes, self._slip, ignored)

    def _judge(self, difference: float, dt: float) -> None:
        """Hysteresis: another level to begin than to end, and some time for both."""
        tuning = self._tuning
        changing = difference < tuning.grip_m_s2 if self._slip else difference > tuning.slip_m_s2
        self._lasting_s = self._lasting_s + dt if changing else 0.0
        if changing and self._lasting_s >= tuning.confirm_s * (1 - 1e-9):
            self._slip, self._lasting_s = not self._slip, 0.0


def _finite(vector: Vector) -> bool:
    return math.isfinite(vector[0]) and math.isfinite(vector[1])


def _nearer(now: Vector, wanted: Vector, time_constant_s: float, dt: float) -> Vector:
    part = 1 - math.exp(-dt / time_constant_s) if time_constant_s > 0 else 1.0
    return (now[0] + part * (wanted[0] - now[0]), now[1] + part * (wanted[1] - now[1]))


class Correction(StrEnum):
    """What one step did to the safety factor."""

    NONE = "none"
    WAITING = "waiting"
    """For the effect of the last correction, or before the next positive one."""
    LOWERED = "lowered"
    RETURNED = "returned"
    """A positive correction brought slip back: to the factor that held."""
    RAISED = "raised"


class SafetyFactor:
    """The factor and its memory.

    Attributes:
        factor: multiplies the limit of acceleration.
        hold_s: time without slip that the next positive correction waits for.
    """

    def __init__(self, tuning: TractionTuning) -> None:
        self._tuning = tuning
        self.factor = 1.0
        self.hold_s = tuning.hold_s
        self._held = LEAST_FACTOR
        self._raise_by = tuning.raise_by
        self._probing = False
        self._since_change_s = math.inf
        self._quiet_s = 0.0

    def step(self, slip: bool, gripping: float, surplus: bool, overshoot: bool, dt: float) -> Correction:
        """Answer slip, or its absence.

        Args:
            slip: now.
            gripping: part of the whole limit that the robot accelerates with, as measured; the floor's while it slips.
            surplus: the robot accelerates more than it shall: the body catches up with wheels that slipped, and a
                lower limit would not end that.
            overshoot: the goal would be passed at the limit in force. All of the limit is then used at once, so
                positive corrections stay small.
            dt: time since the last step [s].
        """
        self._since_change_s += dt
        self._quiet_s = 0.0 if slip else self._quiet_s + dt
        if slip:
            return Correction.WAITING if surplus else self._answer(gripping)
        if self.factor >= 1.0:
            return self._settled()
        waited = min(self._quiet_s, self._since_change_s) >= self.hold_s * (1 - 1e-9)
        return self._raise(overshoot) if waited else Correction.WAITING

    def _answer(self, gripping: float) -> Correction:
        if self._since_change_s < self._tuning.visible_s and not self._probing:
            return Correction.WAITING
        self._raise_by = self._tuning.raise_by
        if self._probing:
            self.hold_s = min(2 * self.hold_s, self._tuning.longest_hold_s)
            return self._change(min(self._held, self.factor), Correction.RETURNED)
        lower = min(self._tuning.margin * gripping, 0.9 * self.factor)
        return self._change(lower, Correction.LOWERED)

    def _raise(self, overshoot: bool) -> Correction:
        if self._probing:
            self._raise_by = self._tuning.raise_by if overshoot else 2 * self._raise_by
        self._held = self.factor
        return self._change(self.factor + self._raise_by, Correction.RAISED)

    def _settled(self) -> Correction:
        """Back at 1, and staying: what was learned of the floor is forgotten."""
        if self._quiet_s >= self._tuning.hold_s and self._since_change_s >= self._tuning.hold_s:
            self._probing = False
            self.hold_s, self._raise_by = self._tuning.hold_s, self._tuning.raise_by
        return Correction.NONE

    def _change(self, factor: float, correction: Correction) -> Correction:
        self.factor = min(max(factor, LEAST_FACTOR), 1.0)
        self._probing = correction is Correction.RAISED
        self._since_change_s = self._quiet_s = 0.0
        return correction


@dataclass(frozen=True, slots=True)
class TractionRecord:
    """The terms of one step.

    Attributes:
        signal: of slip.
        correction: what was done to the factor.
        safety_factor: in force.
        acceleration_limit_m_s2: in force.
        hold_s: time without slip that the next positive correction waits for.
        gripping: part of the whole limit that the robot accelerates with, as measured.
    """

    signal: SlipSignal
    correction: Correction
    safety_factor: float
    acceleration_limit_m_s2: float
    hold_s: float
    gripping: float


class Traction:
    """Slip detection and safety factor in one.

    Args:
        acceleration_m_s2: the whole limit.
        tuning: of the robot.
    """

    def __init__(self, acceleration_m_s2: float, tuning: TractionTuning | None = None) -> None:
        self._tuning = TractionTuning() if tuning is None else tuning
        self._whole_m_s2 = acceleration_m_s2
        self._detector = SlipDetector(self._tuning)
        self._factor = SafetyFactor(self._tuning)

    def step(
        self,
        measured: Vector,
        commanded: Vector,
        dt: float,
        at_top_speed: bool = False,
        overshoot: bool = False,
        pushing: bool = False,
        slipping: bool = False,
    ) -> TractionRecord:
        """One cycle.

        Args:
            measured: acceleration of the robot's centre [m/s2].
            commanded: acceleration of this cycle, in the same frame [m/s2].
            dt: time since the last step [s].
            at_top_speed: the planner holds the speed limit.
            overshoot: the goal would be passed at the limit in force.
            pushing: against an obstacle: the body cannot follow, and the factor stays; see
                :class:`daemon.loops.wheel_grip.WheelGrip` for what holds the wheels then.
            slipping: a wheel slips by the :class:`daemon.loops.slip_observer.SlipObserver`, which sees slow slip, too.
        """
        signal = self._detector.step(measured, commanded, at_top_speed, dt)
        gripping, surplus = self._along(signal)
        if pushing:
            correction = Correction.NONE
        else:
            correction = self._factor.step(signal.slip or slipping, gripping, surplus, overshoot, dt)
        factor = self._factor.factor
        limit = factor * self._whole_m_s2
        return TractionRecord(signal, correction, factor, limit, self._factor.hold_s, gripping)

    def _along(self, signal: SlipSignal) -> tuple[float, bool]:
        """Measured acceleration along the expected one as a part of the limit, and whether it is the larger one.

        It is the larger one while the body catches up with wheels that slipped; a lower limit would not end that.
        """
        (x, y), (mx, my) = signal.expected, signal.measured
        size = math.hypot(x, y)
        if size < self._tuning.grip_m_s2:
            return math.hypot(mx, my) / self._whole_m_s2, math.hypot(mx, my) > size
        along = (x * mx + y * my) / size
        return max(0.0, along) / self._whole_m_s2, along > size
