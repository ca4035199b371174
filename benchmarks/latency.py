"""How soon the targets follow the readings: from the delivery of a cycle's last TPDO to its last RPDO in the queue."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Mapping, Sequence
from time import perf_counter

from benchmarks.pictures import draw_histograms
from benchmarks.robots import STRAIGHT, begin, booted, robot_at
from benchmarks.section import Options, Section, Table
from benchmarks.spread import cell_heads, histogram, log_edges, spread
from daemon.app import App
from daemon.loops.measurement import Measurement
from daemon.runtime.clock import run_precise

CYCLE_HZ = 100.0
UNDER_WAY_S = 1.0
EDGES_US = [round(edge, 3) for edge in log_edges(10.0, 10_000.0, 10)]


class Stopwatch:
    """Times the steps of a control cycle that its last reading has begun.

    Args:
        app: a daemon that has booted.

    Attributes:
        latencies_s: from the delivery of the last TPDO to all RPDOs in the bus's transmit queue.
    """

    def __init__(self, app: App) -> None:
        assert app.bus.receiver is not None
        self.latencies_s: list[float] = []
        self._receive = app.bus.receiver
        self._delivered_s = math.nan
        app.bus.receiver = self._on_frame
        vehicle = app.supervisor.vehicle
        self._observe = vehicle.observe
        vehicle.observe = self._on_sent  # type: ignore[method-assign]  # what a step does next

    def _on_frame(self, can_id: int, data: bytes, timestamp_s: float) -> None:
        self._delivered_s = perf_counter()
        self._receive(can_id, data, timestamp_s)
        self._delivered_s = math.nan

    def _on_sent(self, measurement: Measurement) -> None:
        if not math.isnan(self._delivered_s):
            self.latencies_s.append(perf_counter() - self._delivered_s)
        self._observe(measurement)


def run(options: Options) -> Section:
    """On the simulated bus in real time; the daemon shares its processor with the simulation."""
    options.tell("on the simulated bus")
    values_us = [1e6 * latency for latency in run_precise(latencies_s("simulated", options.seconds))]
    picture = draw_histograms({"simulated bus": values_us}, "Latency", "time", options.out / "latency.png")
    counts = histogram(values_us, EDGES_US)
    figures = {**spread(values_us).figures("us"), "edges_us": EDGES_US, "histogram": counts}
    return Section("latency", [latency_table({"simulated bus": values_us})], {"simulated": figures}, [picture])


def latency_table(values_us: Mapping[str, Sequence[float]]) -> Table:
    """Latencies by where they were measured."""
    rows: list[tuple[str | float | None, ...]] = [(where, *spread(values).cells) for where, values in values_us.items()]
    title = f"from the last TPDO's delivery to the last RPDO in the queue, MAX2D at {CYCLE_HZ:g} Hz"
    return Table(title, ("on", *cell_heads("us")), rows)


async def latencies_s(bus: str, seconds: float) -> list[float]:
    """Latencies of a MAX2D on a bus, driving straight on."""
    async with booted(robot_at(CYCLE_HZ), bus) as robot:
        await begin(robot, STRAIGHT)
        await asyncio.sleep(UNDER_WAY_S)
        stopwatch = Stopwatch(robot.app)
        await asyncio.sleep(seconds)
        return stopwatch.latencies_s
