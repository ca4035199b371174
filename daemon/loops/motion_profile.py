"""Speeds along a line: what to command next so that a limit, an acceleration and an end point are all kept."""

from __future__ import annotations

import math
from typing import Final

ARRIVED_M: Final = 1e-9
"""What remains of a way when it is covered, rounding apart."""


def ramp(speed: float, wanted: float, acceleration: float, dt: float) -> float:
    """The speed one step nearer to ``wanted``, changed by at most ``acceleration * dt``."""
    step = acceleration * dt
    return speed + max(-step, min(step, wanted - speed))


def speed_to_end(speed: float, limit: float, acceleration: float, remaining: float, dt: float) -> float:
    """The speed to hold for the next ``dt`` on the way to an end point where the motion rests.

    Braking from v is a staircase v, v - s, v - 2 s, ... with s = a dt. Its n + 1 steps cover
    dt ((n + 1) v - s n (n + 1) / 2); solved for v with the n whose staircase just fits into the remaining way, the sum
    of ``speed * dt`` is the way exactly.

    Args:
        speed: the speed of the last step [m/s], signed.
        limit: the highest speed [m/s], not negative.
        acceleration: of both ramps [m/s2].
        remaining: way to go [m], signed.
        dt: length of a step [s].
    """
    if abs(remaining) < ARRIVED_M:
        return ramp(speed, 0.0, acceleration, dt)
    stair = acceleration * dt
    single_step = abs(remaining) / dt
    n = math.floor((math.sqrt(1 + 8 * single_step / stair) - 1) / 2)
    braking = single_step / (n + 1) + stair * n / 2
    return ramp(speed, math.copysign(min(limit, braking), remaining), acceleration, dt)


def approach_speed(error: float, gain: float, deceleration: float) -> float:
    """Speed at which to approach a point under feedback: proportional when near, by constant deceleration when far.

    ``gain * error`` up to the error where its slope meets that of sqrt(2 d e), then the square root, shifted so that
    speed and slope are continuous.

    Args:
        error: distance to the point [m], not negative.
        gain: of the proportional part [1/s].
        deceleration: of the far part [m/s2].
    """
    knee = deceleration / (gain * gain)
    if error <= knee:
        return gain * error
    return math.sqrt(2 * deceleration * (error - knee / 2))
