"""Latency, jitter of SYNC and the highest rate on a kernel's CAN: the running one's, else a user-mode kernel's."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

from benchmarks.jitter import jitter_table
from benchmarks.latency import latency_table
from benchmarks.pictures import draw_histograms
from benchmarks.rates import highest_of, real_table
from benchmarks.section import Options, Section
from benchmarks.spread import spread
from canhelm.errors import CanhelmError
from daemon.board_bench import RateResult
from vcan_tests.kernel import running
from vcan_tests.kernel.guest import exchange_folder, run_in_guest
from vcan_tests.kernel.processes import run as run_task
from vcan_tests.kernel.tools import require_tools
from vcan_tests.vcan import speeds

MODULE = "vcan_tests.vcan.speeds"
RESULT = "speeds.json"
LONGEST_S, MEASUREMENTS = 300.0, 15
"""Time for the guest itself; more than there are measurements."""


def run(options: Options) -> Section:
    """The simulated network is a process of its own there. Raises CanhelmError where the guest failed."""
    options.tell("on a kernel's CAN")
    found = _measured(options.seconds)
    where = f"vcan, kernel {found['kernel']}, {found['processors']} processor(s)"
    rates = [RateResult(**rate) for rate in found["rates"]]
    latency_us, jitter_us = found["latency_us"], found["jitter_us"]
    tables = [
        latency_table({where: latency_us}),
        jitter_table(where, jitter_us),
        real_table(f"{where}, simulated network in a process of its own", rates),
    ]
    pictures = [
        draw_histograms({where: latency_us}, "Latency", "time", options.out / "vcan-latency.png"),
        draw_histograms(jitter_us, f"Jitter of SYNC on {where}", "|period - 10 ms|", options.out / "vcan-jitter.png"),
    ]
    figures = {
        "where": where,
        "latency": spread(latency_us).figures("us"),
        "jitter": {words: spread(errors).figures("us") for words, errors in jitter_us.items()},
        "rates": found["rates"],
        "highest_hz": highest_of(rates),
    }
    return Section("vcan", tables, figures, pictures)


def _measured(seconds: float) -> dict[str, Any]:
    with exchange_folder() as folder:
        if running.has_vcan():
            speeds.main(["--seconds", str(seconds), "--out", str(folder / RESULT)])
        else:
            _in_guest(folder, seconds)
        found: dict[str, Any] = json.loads((folder / RESULT).read_text())
        return found


def _in_guest(folder: Path, seconds: float) -> None:
    require_tools()
    command = [sys.executable, "-m", MODULE, "--seconds", str(seconds), "--out", f"/run/guest/{RESULT}"]
    outcome = run_task(run_in_guest(command, folder, timeout_s=LONGEST_S + MEASUREMENTS * seconds))
    if outcome.status:
        raise CanhelmError(f"the guest ended with exit status {outcome.status}")
