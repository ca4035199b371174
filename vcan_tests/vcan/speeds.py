"""What the kernel's bus adds to ``make bench``: latency, jitter of SYNC, and the highest rate that is kept, as JSON.

The simulated network is a process of its own there.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import os
import sys
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import asdict
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from benchmarks.jitter import PERIOD_S, PRODUCERS, Producer, period_errors_us, ticks_in
from benchmarks.latency import latencies_s
from benchmarks.rates import kept_in_real_time
from drivers.bus.broadcast_manager import RepeatedFrame
from drivers.canopen.nmt import SYNC_COB_ID
from vcan_tests.arguments import positive
from vcan_tests.kernel import running
from vcan_tests.vcan.bench import Simulator, patient, write_profile
from vcan_tests.vcan.socketcan_bench import Witness, opened

BUS = "vcan0"


def main(argv: Sequence[str] | None = None) -> int:
    """Measure on the running kernel, and write what was found."""
    parser = argparse.ArgumentParser(prog="python -m vcan_tests.vcan.speeds", description=__doc__)
    parser.add_argument("--seconds", type=positive, default=10.0)
    parser.add_argument("--out", type=Path, required=True, help="file to write")
    asked = parser.parse_args(argv)
    with running.buses_up(), TemporaryDirectory() as folder:
        asked.out.write_text(json.dumps(measure(Path(folder), asked.seconds)))
    return 0


def measure(folder: Path, seconds: float) -> dict[str, Any]:
    """Everything, one after the other, with times in microseconds."""
    producers = {**PRODUCERS, "the kernel's broadcast manager": by_kernel}
    jitter = {
        words: period_errors_us(asyncio.run(_stamps_s(produce, ticks_in(seconds))))
        for words, produce in producers.items()
    }
    with ExitStack() as stack:
        stack.callback(Simulator(write_profile(folder, patient(100)), f"socketcan:{BUS}").end)
        latencies = asyncio.run(latencies_s(f"socketcan:{BUS}", seconds))
        rates = kept_in_real_time(f"socketcan:{BUS}", seconds, lambda _: None)
    return {
        "kernel": os.uname().release,
        "processors": os.cpu_count(),
        "latency_us": [1e6 * latency for latency in latencies],
        "jitter_us": jitter,
        "rates": [asdict(rate) for rate in rates],
    }


async def by_kernel(ticks: int, _: Callable[[], None]) -> None:
    """Tick by the kernel, which sends the frame itself."""
    frame = RepeatedFrame(BUS, SYNC_COB_ID, b"", PERIOD_S, ticks)
    frame.start()
    await asyncio.sleep(ticks * PERIOD_S)
    frame.close()


async def _stamps_s(produce: Producer, ticks: int) -> list[float]:
    """Times at which SYNCs were on the bus, by the kernel's stamps."""
    async with opened(BUS) as sender, opened(BUS) as receiver:
        witness = Witness(receiver)
        await produce(ticks, lambda: sender.send(SYNC_COB_ID))
        return witness.stamps


if __name__ == "__main__":
    sys.exit(main())
