"""Random problems for the planner, and a body that does exactly what it is told."""

from __future__ import annotations

import math
import random
from dataclasses import dataclass

from daemon.loops.planner import Plan, PlanarLimits, PlanarState, Result, follow


@dataclass(frozen=True, slots=True)
class Problem:
    start: PlanarState
    goal: PlanarState
    limits: PlanarLimits


def random_problems(count: int, seed: int) -> list[Problem]:
    """Goals in a square of 6 m, limits 0.2 to 3 m/s and 0.3 to 3 m/s2, moving starts; half of the goals at rest."""
    draw = random.Random(seed)
    problems = []
    for index in range(count):
        x, y = draw.uniform(-3, 3), draw.uniform(-3, 3)
        speed, acceleration = draw.uniform(0.2, 3), draw.uniform(0.3, 3)
        start = _velocity(draw, speed)
        end = _velocity(draw, 0.8 * speed) if index % 2 else (0.0, 0.0)
        limits = PlanarLimits(speed, acceleration, 2.0, 3.0)
        goal = PlanarState(x, y, vx=end[0], vy=end[1])
        problems.append(Problem(PlanarState(vx=start[0], vy=start[1]), goal, limits))
    return problems


def _velocity(draw: random.Random, highest: float) -> tuple[float, float]:
    speed, heading = draw.uniform(0, highest), draw.uniform(-math.pi, math.pi)
    return speed * math.cos(heading), speed * math.sin(heading)


def moved(state: PlanarState, acceleration: tuple[float, float], angular: float, dt: float) -> PlanarState:
    """The state after a time of constant acceleration, exactly."""
    ax, ay = acceleration
    return PlanarState(
        state.x + (state.vx + ax * dt / 2) * dt,
        state.y + (state.vy + ay * dt / 2) * dt,
        state.heading + (state.rate + angular * dt / 2) * dt,
        state.vx + ax * dt,
        state.vy + ay * dt,
        state.rate + angular * dt,
    )


@dataclass(slots=True)
class Drive:
    """What a drive along a plan came to: the state at its end and by how much the limits were exceeded at most."""

    state: PlanarState
    seconds: float = 0.0
    over_speed: float = -math.inf
    over_acceleration: float = -math.inf
    over_rate: float = -math.inf
    over_angular: float = -math.inf
    plans: int = 1
    result: Result = Result.MOVING


def drive(plan: Plan, dt: float, longest_s: float = 1e4) -> Drive:
    """Follow a plan in cycles of dt, the last one shortened to the plan's end."""
    drive = Drive(plan.start)
    allowed = plan.allowed
    while drive.seconds < longest_s:
        left = plan.ends - plan.began - drive.seconds
        cycle = min(dt, left) if left > 1e-12 else dt
        step = follow(plan, plan.began + drive.seconds, drive.state, cycle)
        drive.result = step.result
        if left <= 1e-12 or step.result is Result.INVALID:
            return drive
        drive.plans += step.plan is not plan
        plan, angular = step.plan, step.angular_acceleration_rad_s2
        state = drive.state = moved(drive.state, step.acceleration_m_s2, angular, cycle)
        drive.seconds += cycle
        drive.over_speed = max(drive.over_speed, math.hypot(state.vx, state.vy) - allowed.speed)
        drive.over_acceleration = max(
            drive.over_acceleration, math.hypot(*step.acceleration_m_s2) - allowed.acceleration
        )
        drive.over_rate = max(drive.over_rate, abs(state.rate) - allowed.rate)
        drive.over_angular = max(drive.over_angular, abs(angular) - allowed.angular_acceleration)
    return drive


def miss_m(state: PlanarState, goal: PlanarState) -> float:
    return math.hypot(state.x - goal.x, state.y - goal.y)


def miss_m_s(state: PlanarState, goal: PlanarState) -> float:
    return math.hypot(state.vx - goal.vx, state.vy - goal.vy)
