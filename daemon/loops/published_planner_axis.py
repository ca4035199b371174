"""One axis of the Turtle robot's trajectory planner as its report prints it (listing C.1, check_case, calculate_time).

A double integrator goes from where it is, at any speed, to a point where it shall have a final speed. Each case of the
report is a leg of constant acceleration; the estimated time of arrival is the sum of the legs until the axis converges.
Numbers are those of the listing, peculiarities included; docs/turtle.md lists them.
"""

from __future__ import annotations

import math
from enum import IntEnum
from typing import Final, NamedTuple

SAMPLE_TIME_S: Final = 0.001
"""The report's control cycle."""
POSITION_WINDOW_M: Final = 0.005
"""An axis this near to its goal counts as there (EPSILON_POSITION_CONVERGED)."""
SPEED_WINDOW_M_S2: Final = 2.5
"""Times the sample time: the speeds that count as equal (EPSILON_VELOCITY_CONVERGED, 0.0025 m/s at 1 ms)."""
MAX_LEGS: Final = 10
"""Legs that are added up before the listing gives up (N)."""
RUN_UP_FACTOR: Final = 1.1
"""How much faster than needed the run-up is."""
_EPS: Final = 1e-16


class AxisCase(IntEnum):
    """What an axis does, by the numbers of the report (case 1, "driving in wrong direction", cannot occur)."""

    ARRIVED = -1
    """The planner found this axis within its windows and asked for no case."""
    CONVERGED = 0
    TOP_SPEED = 3
    """Driving at the speed limit."""
    BRAKE = 4
    """Decelerating to the final speed, in time or too late."""
    TOO_FAST = 5
    """Above the speed limit: after another goal, or by noise."""
    RUN_UP = 6
    """Too near to reach the final speed ("aanloopje"): first away from the goal."""
    TO_TOP_SPEED = 21
    """Accelerating to the speed limit."""
    TO_PEAK = 22
    """Accelerating to a speed below the limit, from where braking begins at once."""


_CONVERGED: Final = AxisCase.CONVERGED  # looking up a member costs more than a comparison of floats
_TOP_SPEED: Final = AxisCase.TOP_SPEED
_BRAKE: Final = AxisCase.BRAKE
_TOO_FAST: Final = AxisCase.TOO_FAST
_RUN_UP: Final = AxisCase.RUN_UP
_TO_TOP_SPEED: Final = AxisCase.TO_TOP_SPEED
_TO_PEAK: Final = AxisCase.TO_PEAK

Leg = tuple[AxisCase, float, float, float, float]
"""A stretch of constant acceleration: case, acceleration [m/s2], duration [s], way [m], speed at its end [m/s]."""


class AxisPlan(NamedTuple):
    """What ``calculate_time`` returns.

    Attributes:
        eta_s: estimated time of arrival; 0 where the legs did not converge, as printed.
        acceleration: of the first leg [m/s2], the command.
        case: of the first leg.
        overshoot: 0, or 1 and 2 for braking towards a goal at greater and at smaller coordinates, or 3 when the axis
            cannot arrive after that first leg: it overshoots.
        converged: False when ``MAX_LEGS`` legs were not enough.
    """

    eta_s: float
    acceleration: float
    case: AxisCase
    overshoot: int
    converged: bool


def settle(final_speed: float, speed: float, a_max: float, dt: float) -> float:
    """Acceleration that reaches ``final_speed`` in one step, within ``a_max``."""
    return min(max((final_speed - speed) / dt, -a_max), a_max)


def next_leg(distance: float, speed: float, final_speed: float, v_max: float, a_max: float, dt: float) -> Leg:
    """The next leg (check_case).

    Args:
        distance: goal minus position [m].
        speed: [m/s].
        final_speed: wanted at the goal [m/s].
        v_max: speed limit [m/s], positive.
        a_max: acceleration [m/s2], positive.
        dt: sample time [s].
    """
    if distance > 0 or (distance == 0 and final_speed < 0):
        return _leg_forward(distance, speed, final_speed, v_max, a_max, dt)
    leg = _leg_forward(-distance, -speed, -final_speed, v_max, a_max, dt)
    case, acceleration, duration, way, end_speed = leg
    if case is _CONVERGED:
        return leg  # the listing returns before it mirrors this one back
    return case, -acceleration, duration, -way, -end_speed


def _leg_forward(distance: float, speed: float, final_speed: float, v_max: float, a_max: float, dt: float) -> Leg:
    window = SPEED_WINDOW_M_S2 * dt
    if distance <= POSITION_WINDOW_M and abs(final_speed - speed) < window:
        return _CONVERGED, settle(final_speed, speed, a_max, dt), 0.0, 0.0, final_speed
    if speed > v_max:
        way = 0.5 * (speed * speed - v_max * v_max) / a_max
        return _TOO_FAST, -a_max, (speed - v_max) / a_max, way, v_max
    braking_way = 0.5 * (speed * speed - final_speed * final_speed) / a_max
    if abs(speed - v_max) <= window and distance > braking_way:
        way = distance + 0.5 * (final_speed * final_speed - v_max * v_max) / a_max + _EPS
        duration = distance / v_max + 0.5 * final_speed * final_speed / v_max / a_max - 0.5 * v_max / a_max
        return _TOP_SPEED, (v_max - speed) / dt, duration, way, v_max
    if speed > 0 and distance <= braking_way:
        return _BRAKE, -a_max, (speed - final_speed) / a_max, braking_way, final_speed
    if distance > -braking_way:
        return _accelerate(distance, speed, final_speed, v_max, a_max)
    return _run_up(distance, speed, final_speed, a_max)


def _accelerate(distance: float, speed: float, final_speed: float, v_max: float, a_max: float) -> Leg:
    """Case 2: forward at full acceleration, to the speed limit or to the speed where braking has to begin."""
    peak = math.sqrt(distance * a_max + 0.5 * (speed * speed + final_speed * final_speed))
    if (v_max - speed) / a_max <= (peak - speed) / a_max:
        way = 0.5 * (v_max * v_max - speed * speed) / a_max
        return _TO_TOP_SPEED, a_max, (v_max - speed) / a_max, way, v_max
    way = 0.5 * distance + 0.25 * (final_speed * final_speed - speed * speed) / a_max + _EPS
    return _TO_PEAK, a_max, (peak - speed) / a_max, way, peak


def _run_up(distance: float, speed: float, final_speed: float, a_max: float) -> Leg:
    squares = 0.5 * (speed * speed + final_speed * final_speed)
    if final_speed > 0:
        turn = -RUN_UP_FACTOR * math.sqrt(max(0.0, squares - distance * a_max))
        way = 0.5 * (speed * speed - turn * turn) / a_max
        return _RUN_UP, -a_max, (speed - turn) / a_max, way, turn
    turn = RUN_UP_FACTOR * math.sqrt(distance * a_max + squares)
    way = 0.5 * (turn * turn - speed * speed) / a_max
    return _RUN_UP, a_max, (turn - speed) / a_max, way, turn


def plan_axis(
    distance: float, speed: float, final_speed: float, v_max: float, a_max: float, dt: float = SAMPLE_TIME_S
) -> AxisPlan:
    """Command and estimated time of arrival of one axis (calculate_time).

    Args:
        distance: goal minus position [m].
        speed: [m/s].
        final_speed: wanted at the goal [m/s].
        v_max: speed limit of this axis [m/s], positive.
        a_max: acceleration limit of this axis [m/s2], positive.
        dt: sample time [s].
    """
    leg = next_leg(distance, speed, final_speed, v_max, a_max, dt)
    first_case, first_acceleration = leg[0], leg[1]
    overshoot = _braking_flag(distance, first_acceleration)
    elapsed = 0.0
    for number in range(MAX_LEGS):
        case, _, duration, way, end_speed = leg
        if case is _CONVERGED:
            return AxisPlan(elapsed, first_acceleration, first_case, overshoot, True)
        if number == 1 and overshoot:
            overshoot = 3
        elapsed += duration
        distance -= way
        speed = end_speed
        leg = next_leg(distance, speed, final_speed, v_max, a_max, dt)
    return AxisPlan(0.0, first_acceleration, first_case, overshoot, False)


def _braking_flag(distance: float, acceleration: float) -> int:
    if acceleration < 0 < distance:
        return 1
    return 2 if distance < 0 < acceleration else 0
