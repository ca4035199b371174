"""Figures of the two laws that follow paths with a semi-trailer backwards.

    python -m benchmarks.path_following [--states N] [--seed S]

From the repository's root. Ideal kinematics, 0.2 m/s, commands held for 50 ms. A run has settled where the position's
error stays within 1 cm and the heading's within 1 degree; distances are the truck's.
"""

from __future__ import annotations

import argparse
import math
import time
from collections.abc import Callable
from statistics import mean

from daemon.campaigns.following_runs import (
    SPEED_M_S,
    Law,
    Run,
    State,
    campaign,
    cascade_law,
    forty_states,
    random_states,
    thesis_law,
)
from daemon.campaigns.ideal_semitrailer import LINE_BACKWARDS
from daemon.loops.odometry import Pose
from daemon.loops.path import Piece

RATES_DEG_M = (200, 250, 300, 400, 600, 1000, None)


def thesis(piece: Piece, rate_rad_s: float | None) -> Law:
    """The thesis' law, which does not know the steering's rate."""
    return thesis_law(piece)


LAWS: dict[str, Callable[[Piece, float | None], Law]] = {"thesis": thesis, "cascade": cascade_law}


def figures(runs: list[Run]) -> str:
    """Failures, settling distances and worst errors in one row."""
    settled = [run.settle_m for run in runs if run.settle_m is not None]
    position, heading, bending = (max(run.worst[kind] for run in runs) for kind in range(3))
    worst = f"{max(settled):.2f}" if len(settled) == len(runs) else "never"
    return (
        f"{len(runs) - len(settled):3d}/{len(runs)} | {mean(settled):.3f} | {worst:>5} | {position:.3f} | "
        f"{math.degrees(heading):4.1f} | {math.degrees(bending):4.1f}"
    )


def print_table(title: str, states: list[State], rates_deg_s: tuple[float | None, ...]) -> None:
    """One row a law and rate."""
    print(f"\n{title}\nlaw     | steering  | failed | mean m | worst m | position m | heading deg | bending deg")
    for name, law in LAWS.items():
        for rate in rates_deg_s:
            actuator = "ideal" if rate is None else f"{rate:g} deg/s"
            print(f"{name:7} | {actuator:9} | {figures(campaign(law, states, rate))}", flush=True)


def print_states_that_both_settle(states: list[State], rate_deg_s: float) -> None:
    """Mean settling distance and worst bending error where neither law fails."""
    runs = [campaign(law, states, rate_deg_s) for law in LAWS.values()]
    both = [pair for pair in zip(*runs, strict=True) if all(run.settle_m is not None for run in pair)]
    print(f"\nthe {len(both)} of {len(states)} random states that both laws settle at {rate_deg_s:g} deg/s")
    for number, name in enumerate(LAWS):
        settled = mean(pair[number].settle_m or 0.0 for pair in both)
        bending = math.degrees(max(pair[number].worst[2] for pair in both))
        print(f"{name:7} | mean {settled:.3f} m | worst bending error {bending:.1f} deg")


def step_cost_us(law: Law) -> float:
    """Time of one step, the best of five thousand-step runs."""
    pose, best = Pose(0.0, 0.1, 0.05), math.inf
    for _ in range(5):
        begin = time.perf_counter()
        for _ in range(1000):
            law(pose, 0.1, 0.02, -SPEED_M_S)
        best = min(best, time.perf_counter() - begin)
    return best * 1000


def main() -> None:
    """Print all tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--states", type=int, default=200, help="number of random initial states")
    parser.add_argument("--seed", type=int, default=2009, help="of the random initial states")
    given = parser.parse_args()
    print_table("the 40 states of section 6.2 and Table B.1", forty_states(), (60, None))
    chance = random_states(given.states, given.seed)
    print_table(f"{given.states} random states, seed {given.seed}", chance, (60, None))
    print_states_that_both_settle(chance, 60)
    print("\nfailures of 40 by the steering's rate a metre of way")
    for rate in RATES_DEG_M:
        runs = [campaign(law, forty_states(), rate and rate * SPEED_M_S) for law in LAWS.values()]
        failed = [sum(run.settle_m is None for run in of_law) for of_law in runs]
        print(f"{rate or 'ideal':>5} deg/m | " + " | ".join(f"{n} {c}" for n, c in zip(LAWS, failed, strict=True)))
    print("\none step")
    for name, law in LAWS.items():
        print(f"{name:7} | {step_cost_us(law(LINE_BACKWARDS, math.radians(60))):.1f} us")


if __name__ == "__main__":
    main()
