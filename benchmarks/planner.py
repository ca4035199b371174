"""The planner's acceptance: random problems driven to their end, the optimum, Ruckig, and what a step costs.

    .venv/bin/python -m benchmarks.planner [--problems 10000] [--optimum 300] [--seed 1]

The optimum needs the extra `optimum` (cvxpy and Clarabel); without it that part is left out, and says so.
"""

from __future__ import annotations

import argparse
import math
import random
import statistics
import sys
from collections import Counter
from collections.abc import Callable, Sequence
from importlib.util import find_spec
from time import perf_counter

import ruckig

from daemon.loops import planner_axis
from daemon.loops.planner import Plan, PlanarState, Result, follow, plan_motion
from daemon.loops.published_planner import PlanningProblem, PublishedPlanner
from vcan_tests.daemon.planner_problems import Problem, drive, miss_m, miss_m_s, random_problems

CYCLE_S = 0.01
ALLOWED = 1e-9
ARRIVED_M = 1e-3
ARRIVED_M_S = 1e-3
ALLOWED_US = 60.0
TRIALS = 5


def main(argv: Sequence[str]) -> int:
    parser = argparse.ArgumentParser(description="the planner's acceptance")
    parser.add_argument("--problems", type=int, default=10_000)
    parser.add_argument("--optimum", type=int, default=300, help="how many to compare with the true optimum")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args(argv)
    print(f"seed {options.seed}, cycle {CYCLE_S * 1e3:g} ms, exact integration of each cycle's acceleration")
    problems = random_problems(options.problems, options.seed)
    held = [
        driven(problems),
        from_rest_to_rest(options.seed),
        against_ruckig(options.seed),
        against_the_optimum(problems[: options.optimum]),
        cost(problems[:1000]),
    ]
    return 0 if all(held) else 1


def driven(problems: list[Problem]) -> bool:
    """Drives every problem to its end and counts what went wrong."""
    shapes, faults = Counter[str](), Counter[str]()
    excess = far = fast = -math.inf
    for problem in problems:
        plan = plan_motion(problem.start, problem.goal, problem.limits)
        end = drive(plan, CYCLE_S)
        missed, differs = miss_m(end.state, problem.goal), miss_m_s(end.state, problem.goal)
        shapes[plan.way.shape] += 1
        faults["above v_max"] += not end.over_speed <= ALLOWED
        faults["above a_max"] += not end.over_acceleration <= ALLOWED
        faults["not arrived"] += not (end.result is Result.ARRIVED and missed < ARRIVED_M and differs < ARRIVED_M_S)
        excess, far, fast = max(excess, end.over_speed, end.over_acceleration), max(far, missed), max(fast, differs)
    print(f"{len(problems)} problems: " + ", ".join(f"{faults[name]} {name}" for name in faults))
    print(
        f"  largest excess {excess:.1e}; ends {far:.1e} m, {fast:.1e} m/s from the goal at most; shapes {dict(shapes)}"
    )
    return not any(faults.values())


def from_rest_to_rest(seed: int, count: int = 1000) -> bool:
    """The straight line's time is the optimum: 2 sqrt(s / a), or s / v + v / a where v_max is reached."""
    worst = 0.0
    for problem in random_problems(count, seed):
        speed, acceleration = problem.limits.speed, problem.limits.acceleration
        way = math.hypot(problem.goal.x, problem.goal.y)
        short = way * acceleration <= speed * speed
        best = 2 * math.sqrt(way / acceleration) if short else way / speed + speed / acceleration
        goal = PlanarState(problem.goal.x, problem.goal.y)
        worst = max(worst, abs(plan_motion(PlanarState(), goal, problem.limits).ends / best - 1))
    print(f"{count} from rest to rest: time differs from the optimum by {worst:.1e} of it at most")
    return worst < 1e-3


def against_ruckig(seed: int, count: int = 4000) -> bool:
    """One axis: the duration beside Ruckig's without a jerk limit."""
    draw, worst = random.Random(seed), 0.0
    for index in range(count):
        limit, acceleration, travel = draw.uniform(0.2, 3), draw.uniform(0.3, 3), draw.uniform(-3, 3)
        start, end = draw.uniform(-limit, limit), draw.uniform(-limit, limit) * (index % 2)
        ours = planner_axis.fastest(travel, start, end, limit, acceleration).duration
        worst = max(worst, abs(ours - _ruckig([travel], [start], [end], limit, acceleration)))
    print(f"{count} of one axis against Ruckig: durations differ by {worst:.1e} s at most")
    return worst < 1e-9


def _ruckig(travel: list[float], start: list[float], end: list[float], limit: float, acceleration: float) -> float:
    problem = ruckig.InputParameter(len(travel))
    problem.target_position, problem.current_velocity, problem.target_velocity = travel, start, end
    problem.max_velocity = [limit] * len(travel)
    problem.max_acceleration = [acceleration] * len(travel)
    problem.max_jerk = [math.inf] * len(travel)
    trajectory = ruckig.Trajectory(len(travel))
    ruckig.Ruckig(len(travel)).calculate(problem, trajectory)
    return float(trajectory.duration)


def against_the_optimum(problems: list[Problem]) -> bool:
    """Durations over those of the second-order cone program."""
    if find_spec("cvxpy") is None:
        print("optimum: left out, it needs pip install 'canhelm[optimum]'")
        return True
    from benchmarks.planner_optimum import Optimum

    optimum = Optimum()
    ratios = []
    for problem in problems:
        plan = plan_motion(problem.start, problem.goal, problem.limits)
        ratios.append(plan.ends / optimum.time(problem))
    ratios.sort()
    median, late = statistics.median(ratios), ratios[int(0.99 * (len(ratios) - 1))]
    print(f"{len(ratios)} against the optimum: ratio median {median:.5f}, p99 {late:.4f}, largest {ratios[-1]:.4f}")
    return median <= 1.01 and late <= 1.05


def cost(problems: list[Problem]) -> bool:
    """Microseconds of a planning step of each kind, the machine as it is.

    A step along the plan is what a robot pays in each cycle, a plan made anew what it pays for a new goal or a push. A
    plan has to be within the limit at the best of a few trials, which is what it costs without its neighbours.
    """
    plans = [plan_motion(problem.start, problem.goal, problem.limits) for problem in problems]
    step = _microseconds("a step along the plan", [_step(plan) for plan in plans])
    anew = _microseconds("a plan made anew", [_plan(problem) for problem in problems])
    _microseconds("a call of the published planner", [_published(problem) for problem in problems])
    _microseconds("Ruckig, two synchronised axes, no jerk limit", [_by_ruckig(problem) for problem in problems])
    return max(step, anew) <= ALLOWED_US


def _step(plan: Plan) -> Callable[[], object]:
    now = plan.ends * 0.4
    state = plan.at(now)
    return lambda: follow(plan, now, state, CYCLE_S)


def _plan(problem: Problem) -> Callable[[], object]:
    return lambda: plan_motion(problem.start, problem.goal, problem.limits)


def _published(problem: Problem) -> Callable[[], object]:
    start, goal, limits = problem.start, problem.goal, problem.limits
    given = PlanningProblem(
        (goal.x, goal.y), (start.vx, start.vy), (goal.vx, goal.vy), limits.speed, limits.acceleration
    )
    return lambda: PublishedPlanner().step(given)


def _by_ruckig(problem: Problem) -> Callable[[], object]:
    start, goal, limits = problem.start, problem.goal, problem.limits
    share = math.sqrt(0.5)
    travel, begin, end = [goal.x, goal.y], [start.vx, start.vy], [goal.vx, goal.vy]
    return lambda: _ruckig(travel, begin, end, limits.speed, limits.acceleration * share)


def _microseconds(name: str, calls: list[Callable[[], object]]) -> float:
    """Prints what a call takes, once and at best; returns the median of the best."""
    once = sorted(map(_timed, calls))
    best = sorted(min(_timed(call) for _ in range(TRIALS)) for call in calls)
    late = int(0.99 * (len(calls) - 1))
    print(
        f"{name}: {statistics.median(once):.1f} us median, {once[late]:.0f} us p99;"
        f" best of {TRIALS} {statistics.median(best):.1f} us median, {best[late]:.0f} us p99"
    )
    return statistics.median(best)


def _timed(call: Callable[[], object]) -> float:
    began = perf_counter()
    call()
    return (perf_counter() - began) * 1e6


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
