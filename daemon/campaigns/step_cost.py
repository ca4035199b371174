"""What one step of a law costs."""

from __future__ import annotations

import math
import time

from daemon.campaigns.cases import LAWS, SPEED_M_S
from daemon.campaigns.following_runs import Law, cascade_law, thesis_law
from daemon.campaigns.ideal_semitrailer import LINE_BACKWARDS
from daemon.loops.odometry import Pose

REPETITIONS, STEPS = 5, 1000


def step_costs_us() -> dict[str, float]:
    """Time of one step of each law on this machine, the best of some repetitions [us]."""
    laws = (thesis_law(LINE_BACKWARDS), cascade_law(LINE_BACKWARDS, math.radians(60)))
    return {name: _cost_us(law) for name, law in zip(LAWS, laws, strict=True)}


def _cost_us(law: Law) -> float:
    pose, best = Pose(0.0, 0.1, 0.05), math.inf
    for _ in range(REPETITIONS):
        begin = time.perf_counter()
        for _ in range(STEPS):
            law(pose, 0.1, 0.02, -SPEED_M_S)
        best = min(best, time.perf_counter() - begin)
    return best / STEPS * 1e6
