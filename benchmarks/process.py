"""The daemon as a process: how soon it can be asked, and drive; what memory it takes."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable, Coroutine
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from typing import Any

from benchmarks.robots import booted
from benchmarks.section import Options, Section, Table
from canhelm.client import Client
from daemon.runtime.clock import run_precise, run_virtual
from profiles.loader import load
from vcan_tests.vcan.bench import Daemon, write_profile

TIMES = 3
LOOKS_HZ = 50.0
FASTEST_M_S, DRIVEN_S = 0.5, 3600
MIB = 1 << 20
PAGE_BYTES = 4096


def run(options: Options) -> Section:
    """With its simulated network in the same process; ``options.seconds`` are those of driving."""
    options.tell("booting in this process")
    inside_s = {"virtual time": _boot_s(run_virtual), "real time": _boot_s(run_precise)}
    starts = []
    for number in range(TIMES):
        options.tell(f"start {number + 1} of {TIMES}")
        with TemporaryDirectory() as folder:
            starts.append(_start(Path(folder), options.seconds if number == 0 else 0.0))
    asked_s, idle_s = (median(times) for times in zip(*(start[:2] for start in starts), strict=True))
    memory = starts[0][2]
    rows = [(f"from the daemon's start in a running process to all nodes, {k}", v) for k, v in inside_s.items()]
    rows += [("from the process' start until it can be asked", asked_s), ("until all nodes are operational", idle_s)]
    tables = [
        Table("start-up of the MAX2D, simulated", ("", "s"), rows),
        Table("resident memory, simulated network included", ("", "MiB"), list(memory.items())),
    ]
    boot = {"boot_virtual_s": inside_s["virtual time"], "boot_real_s": inside_s["real time"]}
    figures = {**boot, "asked_s": asked_s, "idle_s": idle_s, "memory_mib": memory}
    return Section("process", tables, figures)


def _boot_s(runner: Callable[[Coroutine[Any, Any, float]], float]) -> float:
    """Time from a daemon's start until all nodes are operational, by the clock of its loop."""

    async def boot() -> float:
        loop = asyncio.get_running_loop()
        begin_s = loop.time()
        async with booted(load("max2d").profile):
            return loop.time() - begin_s

    return runner(boot())


def _start(folder: Path, driving_s: float) -> tuple[float, float, dict[str, float]]:
    """Times from a process' start until it can be asked, and until it is idle; its memory [MiB] at some moments."""
    begin_s = time.monotonic()
    daemon = Daemon(write_profile(folder), "simulated", ("--runs", str(folder / "runs")), niceness=0)
    try:
        asked_s = time.monotonic() - begin_s
        memory = {"can be asked": _resident_mib(daemon)}
        _wait(daemon, lambda status: status["state"] == "idle")
        idle_s = time.monotonic() - begin_s
        memory["idle"] = _resident_mib(daemon)
        if driving_s:
            daemon.begin("drive", "parallel", "--angle=0", f"--speed={FASTEST_M_S}", f"--duration={DRIVEN_S}")
            _wait(daemon, lambda status: status["state"] == "active")
            memory["drives"] = _resident_mib(daemon)
            enough_s = time.monotonic() + driving_s
            _wait(daemon, lambda _: time.monotonic() >= enough_s)
            memory[f"has driven for {driving_s:g} s"] = _resident_mib(daemon)
    finally:
        daemon.end()
    return asked_s, idle_s, memory


def _wait(daemon: Daemon, reached: Callable[[dict[str, Any]], bool]) -> None:
    """Look at the status until something is so."""
    with Client(daemon.socket) as client:
        for method, status in client.notifications(rate_hz=LOOKS_HZ):
            if method == "status" and reached(status):
                return
    raise AssertionError("the daemon hung up")


def _resident_mib(daemon: Daemon) -> float:
    pages = Path(f"/proc/{daemon.process.pid}/statm").read_text().split()[1]
    return int(pages) * PAGE_BYTES / MIB
