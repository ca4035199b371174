"""Speeds along a line: what to command next so that a limit, an acceleration and an end point are all kept."""

from __future__ import annotations

import math


def ramp(speed: float, wanted: float, acceleration: float, dt: float) -> float:
    """The speed one step nearer to ``wanted``, changed by at most ``acceleration * dt``."""
    step = acceleration * dt
    return speed + max(-step, min(step, wanted - speed))


def speed_to_end(speed: float, limit: float, acceleration: float, remaining: float, dt: float) -> float:
    """The speed to hold for the next ``dt`` on the way to an end point where the motion rests.

    The remaining way that a staircase of speeds with steps ``a dt`` needs from speed v to rest is
    v^2 / (2 a) + v dt / 2; solved for v, with the last step cut to what remains, the sum of ``speed * dt`` is the
    way exactly.

    Args:
        speed: the speed of the last step [m/s], signed.
        limit: the highest speed [m/s], not negative.
        acceleration: of both ramps [m/s2].
        remaining: way to go [m], signed.
        dt: length of a step [s].
    """
    half_step = acceleration * dt / 2
    braking = math.sqrt(half_step * half_step + 2 * acceleration * abs(remaining)) - half_step
    wanted = math.copysign(min(limit, braking, abs(remaining) / dt), remaining)
    return ramp(speed, wanted, acceleration, dt)


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
