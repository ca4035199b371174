"""How many times as fast as real time a whole simulated robot runs: six nodes, physics and daemon, on one core."""

from __future__ import annotations

import asyncio
from statistics import median
from time import process_time

from benchmarks.robots import STANDING, STRAIGHT, TURNING, Scene, begin, booted, robot_at
from benchmarks.section import Options, Section, Table
from daemon.runtime.clock import run_virtual

SCENES = (STANDING, STRAIGHT, TURNING)
CYCLE_HZ = 100.0
UNDER_WAY_S = 8.0
"""Virtual time after which a motion is at its speed."""
PASSES = 5
"""One after the other, so that a machine that is slow for a while is so for all scenes."""


def run(options: Options) -> Section:
    """``options.seconds`` are virtual, in each of five passes over all scenes."""
    spans_s: dict[Scene, list[float]] = {scene: [] for scene in SCENES}
    for number in range(PASSES):
        for scene in SCENES:
            options.tell(f"{scene.words}, pass {number + 1} of {PASSES}")
            spans_s[scene].append(run_virtual(_processor_s(scene, options.seconds)))
    rows, figures = [], []
    for scene, spans in spans_s.items():
        factors = [options.seconds / span_s for span_s in spans]
        cost_us = 1e6 * median(spans) / (options.seconds * CYCLE_HZ)
        rows.append((scene.words, median(factors), min(factors), max(factors), cost_us))
        figures.append({"scene": scene.words, "times_real_time": median(factors), "cycle_us": cost_us})
    heads = ("the MAX2D", "x real time", "least", "most", "processor [us a cycle]")
    table = Table(f"simulation and daemon, {CYCLE_HZ:g} Hz, on virtual time", heads, rows)
    return Section("simulation", [table], {"scenes": figures})


async def _processor_s(scene: Scene, seconds: float) -> float:
    """Processor time of so many virtual seconds."""
    async with booted(robot_at(CYCLE_HZ)) as robot:
        await begin(robot, scene)
        await asyncio.sleep(UNDER_WAY_S)
        begin_s = process_time()
        await asyncio.sleep(seconds)
        return process_time() - begin_s
