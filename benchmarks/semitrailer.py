"""The semi-trailer driven backwards for minutes, over the simulated CAN network.

    python -m benchmarks.semitrailer [--minutes N] [--seed S]

From the repository's root. Line and circle of 1 m, each begun 0.1 m beside; angle sensors and tracking system have
noise (:mod:`daemon.demo_semitrailer`). Errors are the truth's, once the first one has settled.
"""

from __future__ import annotations

import argparse
import math
import time

from daemon.cli.output import say
from daemon.demo_semitrailer import SETTLED_M, circle_backwards, drive, line_backwards
from daemon.runtime.clock import run_virtual
from profiles.loader import load

SPEED_M_S = 0.2


def main() -> None:
    """Drive both, print one line each."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--minutes", type=float, default=10.0, help="of driving, each")
    parser.add_argument("--seed", type=int, default=0, help="of everything random")
    given = parser.parse_args()
    way_m = SPEED_M_S * 60 * given.minutes
    profile = load("semitrailer").profile
    for manoeuvre in (line_backwards(way_m), circle_backwards(way_m / math.tau)):
        begin = time.perf_counter()
        result = run_virtual(drive(profile, manoeuvre, given.seed, None, say))
        trace, seconds = result.trace, time.perf_counter() - begin
        squares = [error * error for error, way in zip(trace.error_m, trace.way_m, strict=True) if way > SETTLED_M]
        rms_mm = 1e3 * math.sqrt(math.fsum(squares) / len(squares))
        told = f"{result.numbers['achieved']}, rms {rms_mm:.1f} mm, {result.numbers['late_cycles']} late cycles"
        print(f"{manoeuvre.identity}: {told}, {seconds:.0f} s of computing", flush=True)


if __name__ == "__main__":
    main()
