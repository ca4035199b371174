"""One axis from a position and speed to others, in the shortest time or in a given one: a double integrator, exact."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

ROUNDING: Final = 1e-14
AT_ONCE_S: Final = 1e-12


@dataclass(slots=True)
class AxisPlan:
    """A way in pieces of constant acceleration.

    Attributes:
        start: speed at the start [unit/s].
        pieces: duration [s] and acceleration [unit/s2] of each piece, in order.
    """

    start: float
    pieces: tuple[tuple[float, float], ...]

    @property
    def duration(self) -> float:
        return math.fsum(duration for duration, _ in self.pieces)

    def at(self, time: float) -> tuple[float, float]:
        """Travel [unit] and speed [unit/s] at a time since the start [s]; after the plan its last speed is held."""
        travel, speed = 0.0, self.start
        for duration, acceleration in self.pieces:
            within = min(time, duration)
            travel += (speed + acceleration * within / 2) * within
            speed += acceleration * within
            time -= within
            if time <= 0.0:
                return travel, speed
        return travel + speed * time, speed


def fastest(travel: float, start: float, end: float, limit: float, acceleration: float) -> AxisPlan:
    """The way of least duration: one change of speed at full acceleration, perhaps the speed limit, another change.

    The travel of the direct change of speed from start to end tells on which side the peak lies, and
    peak^2 = a |travel| + (start^2 + end^2) / 2 if the limit allows it.

    Args:
        travel: to cover [unit], signed.
        start: speed now [unit/s]; above the limit it is reduced first.
        end: speed at the end [unit/s], within the limit.
        limit: the highest speed [unit/s], positive.
        acceleration: the highest acceleration [unit/s2], positive.
    """
    peak, hold = _course(travel, start, end, limit, acceleration)
    return _by_peak(start, peak, end, acceleration, hold)


def least_duration(travel: float, start: float, end: float, limit: float, acceleration: float) -> float:
    """How long the fastest way takes [s], without the way."""
    peak, hold = _course(travel, start, end, limit, acceleration)
    return (abs(peak - start) + abs(end - peak)) / acceleration + hold


def _course(travel: float, start: float, end: float, limit: float, acceleration: float) -> tuple[float, float]:
    """Speed between the two changes of the fastest way, and how long it is held."""
    direct = (start + end) / 2 * abs(end - start) / acceleration
    if abs(travel - direct) <= ROUNDING * (start * start + end * end) / acceleration:
        return end, 0.0
    side = 1.0 if travel > direct else -1.0
    free_peak = math.sqrt(max(0.0, side * acceleration * travel + (start * start + end * end) / 2))
    if free_peak <= limit:
        return side * free_peak, 0.0
    peak = side * limit
    changes = (abs(peak - start) * (start + peak) + abs(end - peak) * (peak + end)) / (2 * acceleration)
    return peak, max(0.0, (travel - changes) / peak)


def in_time(
    travel: float, start: float, end: float, limit: float, acceleration: float, duration: float
) -> AxisPlan | None:
    """The way of the given duration that needs the least acceleration; None if the limits do not allow it.

    Two halves of opposite acceleration A: A^2 T^2 / 4 - A q - (end - start)^2 / 4 = 0 with
    q = travel - (start + end) T / 2. Where their peak is above the limit, the limit is held between them.
    """
    if travel == 0.0 and start == end and duration <= AT_ONCE_S:
        return AxisPlan(start, ())
    if duration <= AT_ONCE_S or abs(start) > limit:
        return None
    q = travel - (start + end) * duration / 2
    least = 2 * (q + math.copysign(math.hypot(q, (end - start) * duration / 2), q)) / duration**2
    peak = (start + end + least * duration) / 2
    needed, hold = abs(least), 0.0
    if abs(peak) > limit:
        peak = math.copysign(limit, peak)
        changes = (abs(peak - start) * (start + peak) + abs(end - peak) * (peak + end)) / 2
        without_hold = (abs(peak - start) + abs(end - peak)) * peak - changes
        surplus = peak * duration - travel
        needed = without_hold / surplus if surplus else math.inf
        hold = (travel - changes / needed) / peak if needed > 0.0 else -1.0
    if hold < 0.0 or needed > acceleration * (1 + 1e-12):
        return None
    return _by_peak(start, peak, end, needed, hold) if needed else AxisPlan(start, ((duration, 0.0),))


def with_a_rest(
    travel: float, start: float, end: float, limit: float, acceleration: float, duration: float
) -> AxisPlan:
    """Brake, rest, then the fastest way: of the given duration, or its shortest if that is longer."""
    brake = braking(start, acceleration)
    onward = fastest(travel - brake.at(brake.duration)[0], 0.0, end, limit, acceleration)
    rest = max(0.0, duration - brake.duration - onward.duration)
    return AxisPlan(start, (*brake.pieces, (rest, 0.0), *onward.pieces))


def braking(start: float, acceleration: float) -> AxisPlan:
    """To rest."""
    return AxisPlan(start, ((abs(start) / acceleration, -math.copysign(acceleration, start)),))


def _by_peak(start: float, peak: float, end: float, acceleration: float, hold: float) -> AxisPlan:
    first, last = peak - start, end - peak
    return AxisPlan(
        start,
        (
            (abs(first) / acceleration, math.copysign(acceleration, first)),
            (hold, 0.0),
            (abs(last) / acceleration, math.copysign(acceleration, last)),
        ),
    )
