"""How many runs of a campaign a second of wall time has, by the number of workers."""

from __future__ import annotations

import os
from time import perf_counter

from benchmarks.section import Options, Section, Table
from daemon.campaigns.cases import bounds_cases
from daemon.campaigns.workers import drive_all

RUNS_A_SECOND = 40
"""So many runs for each second that a measurement shall last."""
SEED = 2009


def run(options: Options) -> Section:
    """The runs of ``canhelm campaign bounds`` on ideal kinematics; start of the workers included."""
    wanted = round(RUNS_A_SECOND * options.seconds)
    cases = bounds_cases(wanted, SEED, "ideal")[:wanted]
    speeds: dict[int, float] = {}
    for workers in sorted({1, len(os.sched_getaffinity(0))}):
        options.tell(f"{len(cases)} runs, {workers} workers")
        begin_s = perf_counter()
        done = sum(len(results) for results in drive_all(cases, workers))
        speeds[workers] = done / (perf_counter() - begin_s)
    rows = [(workers, speed, speed / speeds[1]) for workers, speed in speeds.items()]
    table = Table(f"{len(cases)} runs of `campaign bounds`", ("workers", "runs a second", "x one worker"), rows)
    return Section("campaigns", [table], {"runs": len(cases), "runs_a_second": speeds})
