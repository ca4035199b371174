"""Traction control on a floor with ice: way aside, time lost, the safety factor's unrest, slip found against the truth.

    .venv/bin/python -m benchmarks.traction [SEEDS]

Each scenario is driven without traction control, with the published one, and with the improved one by accelerometer and
by motor currents alone; first on the small plant of the tests, then on the simulated Turtle over the bus. Last the
MAX2D.
"""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Callable
from statistics import mean

from benchmarks import turtle_on_bus
from daemon.loops.planner import PlanarState
from daemon.loops.traction import Traction
from profiles.schema import FloorPatch
from vcan_tests.daemon import gripping_robot
from vcan_tests.daemon.gripping_robot import Drive, Way
from vcan_tests.daemon.omni_floor import ICE, OmniFloor, dry, ice_between
from vcan_tests.daemon.test_max2d_traction import WHERE, driven

GOAL = PlanarState(3.0, 0.0)
HEAD = f"{'':34}{'arrives':>8}{'lost':>7}{'aside':>8}{'end off':>9}{'changes':>9}{'turns':>7}{'found/missed/false':>20}"

Make = Callable[[str, int, Way, bool], Drive]
"""A drive of a scenario, with a seed, by a way to answer slip, with or without the accelerometer."""

PATCHES = {
    "dry": None,
    "ice while speeding up": (0.3, 1.0, -9.0, 9.0),
    "ice under the left wheels": (0.2, 1.5, 0.05, 9.0),
    "ice while braking": (1.8, 2.6, -9.0, 9.0),
}


def report(name: str, drives: list[Drive], undisturbed_s: float) -> None:
    """One line: means over the seeds, sums of the events."""
    arrived = mean(driven.arrived_s for driven in drives)
    aside = mean(driven.aside(1 + 0j) for driven in drives)
    off = mean(abs(driven.cycles[-1].place - 3) for driven in drives)
    changes = mean(driven.factor_changes() for driven in drives)
    turns = mean(driven.turned_round() for driven in drives)
    events = "/".join(str(sum(column)) for column in zip(*(driven.events() for driven in drives), strict=True))
    lost = arrived - undisturbed_s
    print(f"{name:34}{arrived:7.2f}s{lost:6.2f}s{aside:7.3f}m{off:8.3f}m{changes:9.1f}{turns:7.1f}{events:>20}")


def compare(title: str, make: Make, seeds: range) -> None:
    """All scenarios on one plant."""
    undisturbed_s = make("dry", 1, Way.OFF, False).arrived_s
    print(f"\n{title}; means over {len(seeds)} seeds\n{HEAD}")
    ways = {
        "off": (Way.OFF, False),
        "published": (Way.PUBLISHED, False),
        "improved, accelerometer": (Way.IMPROVED, False),
        "improved, currents": (Way.IMPROVED, True),
    }
    for scenario in PATCHES:
        print(scenario)
        for name, (way, by_currents) in ways.items():
            report(f"  {name}", [make(scenario, seed, way, by_currents) for seed in seeds], undisturbed_s)


def small_plant(scenario: str, seed: int, way: Way, by_currents: bool) -> Drive:
    bounds = PATCHES[scenario]
    floor = OmniFloor(ice_between(*bounds) if bounds else dry, seed)
    return gripping_robot.drive(floor, GOAL, way, by_currents=by_currents)


def turtle(scenario: str, seed: int, way: Way, by_currents: bool) -> Drive:
    bounds = PATCHES[scenario]
    return turtle_on_bus.drive(_patch(*bounds) if bounds else None, seed, way, by_currents=by_currents)


def _patch(x_from: float, x_to: float, y_from: float, y_to: float) -> FloorPatch:
    middle = (x_from + x_to) / 2, (y_from + y_to) / 2
    return FloorPatch(x_m=middle[0], y_m=middle[1], length_m=x_to - x_from, width_m=y_to - y_from, friction=ICE)


def max2d() -> None:
    """The MAX2D over the bus: the largest slip of a wheel while it drives 1.2 m straight ahead and comes to rest."""
    print("\nsimulated MAX2D over the bus, 0.8 m/s2, ice of friction 0.03 under all wheels; largest slip")
    for ice in (None, *WHERE):
        off, on = driven(False, ice), driven(True, ice)
        slips = f"{off.worst_slip_m_s:.3f} m/s off, {on.worst_slip_m_s:.3f} m/s on"
        print(f"  {ice or 'dry':34}{slips}, held in {on.held_cycles} cycles")


def cost_us() -> float:
    """Median duration of one step of slip detection and safety factor."""
    traction, durations = Traction(1.5), []
    for number in range(20000):
        begin = time.perf_counter()
        traction.step((math.sin(number / 50), 0.1), (1.0, 0.0), 0.01)
        durations.append(time.perf_counter() - begin)
    return sorted(durations)[len(durations) // 2] * 1e6


def main() -> None:
    seeds = range(1, 1 + (int(sys.argv[1]) if len(sys.argv) > 1 else 3))
    print(f"seeds {seeds.start} to {seeds.stop - 1}; ice has a friction of {ICE}")
    compare("small plant, accelerometer noise 0.1 m/s2", small_plant, seeds)
    compare("simulated Turtle over the bus", turtle, seeds)
    max2d()
    print(f"\none step of traction control: {cost_us():.1f} us at the median")


if __name__ == "__main__":
    main()
