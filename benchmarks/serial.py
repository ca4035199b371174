"""How busy a serial line is that carries a whole robot: cycles a second and shares of the time, on virtual time."""

from __future__ import annotations

import asyncio

from benchmarks.robots import Scene, begin, booted
from benchmarks.section import Options, Section, Table
from daemon.runtime.clock import run_virtual
from profiles.loader import load

BAUD_RATES = (115200, 57600, 38400, 19200)
UNDER_WAY_S = 5.0
MOTION = Scene("drives straight on, 0.3 m/s", "drive.parallel", (("angle_deg", 0.0), ("speed_m_s", 0.3)))


def run(options: Options) -> Section:
    """The MAX2D behind the simulated line of its first drive, driving."""
    found: dict[int, tuple[float, float, float]] = {}
    for baud in BAUD_RATES:
        options.tell(f"{baud} baud")
        found[baud] = run_virtual(_line(baud, options.seconds))
    heads = ("baud", "cycles a second", "line busy", "waits for this side")
    rows = [(str(baud), hz, f"{busy:.1%}", f"{idle:.1%}") for baud, (hz, busy, idle) in found.items()]
    names = ("cycle_hz", "line_share", "own_idle_share")
    figures = {str(baud): dict(zip(names, values, strict=True)) for baud, values in found.items()}
    return Section("serial", [Table(f"RS-232, the MAX2D {MOTION.words}", heads, rows)], figures)


async def _line(baud: int, seconds: float) -> tuple[float, float, float]:
    """Cycles a second, share of the time that the line is busy, and that it waits for this side."""
    async with booted(load("max2d").profile, f"rs232@{baud}") as robot:
        await begin(robot, MOTION)
        await asyncio.sleep(UNDER_WAY_S)
        cycles = robot.app.cycle.counters.cycles
        await asyncio.sleep(seconds)
        line = robot.app.bus.details()
        hz = (robot.app.cycle.counters.cycles - cycles) / seconds
        return hz, line["line_utilisation"], line["own_idle_share"]
