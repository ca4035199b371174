"""The shortest time of a double integrator in closed form: what estimates of arrival are compared with."""

from __future__ import annotations

import math


def shortest_time(distance: float, speed: float, final_speed: float, v_max: float, a_max: float) -> float:
    """Shortest time to go ``distance`` from ``speed`` to ``final_speed`` [s].

    An optimal motion accelerates fully to a peak speed one way and fully back from it, or holds the speed limit in
    between; both signs of the peak's side are tried. A start above the limit comes down to it first.
    """
    return min(
        _over_a_peak(distance, speed, final_speed, v_max, a_max),
        _over_a_peak(-distance, -speed, -final_speed, v_max, a_max),
    )


def _over_a_peak(distance: float, speed: float, final_speed: float, v_max: float, a_max: float) -> float:
    """The time over a peak that is not below both end speeds; infinite if there is none."""
    if speed > v_max:
        way = (speed * speed - v_max * v_max) / (2 * a_max)
        return (speed - v_max) / a_max + _over_a_peak(distance - way, v_max, final_speed, v_max, a_max)
    square = a_max * distance + (speed * speed + final_speed * final_speed) / 2
    peaks = [] if square < 0 else [math.sqrt(square), -math.sqrt(square)]
    times = [_time(distance, speed, final_speed, peak, v_max, a_max) for peak in peaks]
    return min(times, default=math.inf)


def _time(distance: float, speed: float, final_speed: float, peak: float, v_max: float, a_max: float) -> float:
    if peak < max(speed, final_speed) - 1e-12 or peak < -v_max:
        return math.inf
    if peak <= v_max:
        return (2 * peak - speed - final_speed) / a_max
    cruise = distance - (2 * v_max * v_max - speed * speed - final_speed * final_speed) / (2 * a_max)
    return (2 * v_max - speed - final_speed) / a_max + cruise / v_max
