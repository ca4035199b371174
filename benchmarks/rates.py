"""How fast the control cycle of the MAX2D can be: what each rate costs, what the wire carries, what this machine keeps.

On virtual time the processor takes no time, so only the wire can be too slow; in real time both can.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path

from benchmarks.bus_limit import Bits, cycle_bits
from benchmarks.load import Load, load_of
from benchmarks.nodes import BIT_RATE
from benchmarks.pictures import COLOURS, panels, saved
from benchmarks.robots import STRAIGHT, robot_at
from benchmarks.section import Options, Section, Table
from canhelm.errors import Timeout
from daemon.board_bench import RateResult, measure_rate
from daemon.runtime.clock import run_precise

RATES_HZ = (100.0, 200.0, 500.0, 700.0, 850.0, 1000.0)
STEP_HZ, LOWEST_HZ, HIGHEST_HZ = 10, 100, 1000
"""The grid on which the highest rate is looked for on virtual time."""
REAL_RATES_HZ = (100.0, 200.0, 300.0, 400.0, 500.0, 600.0, 700.0, 800.0, 900.0)
ALLOWED_LATE = 1e-3
"""Share of the cycles that may be late at a rate that is kept."""
SETTLE_S = 2.0
DRIVES, ENCODERS = 4, 2


def run(options: Options) -> Section:
    """Costs at some rates, the wire's limit, and the highest rate of this machine in real time."""
    loads = {hz: _load_at(hz, options.seconds, options.tell) for hz in RATES_HZ}
    in_time = highest_kept(lambda hz: _is_in_time(_load_at(hz, options.seconds, options.tell)))
    complete = highest_kept(lambda hz: _is_complete(_load_at(hz, options.seconds, options.tell)))
    real = kept_in_real_time("simulated", options.seconds, options.tell)
    bits = cycle_bits(DRIVES, ENCODERS)
    title = (
        f"{DRIVES} drives and {ENCODERS} encoders: {bits.least} to {bits.most} bits in a cycle, "
        f"{BIT_RATE / bits.most:.0f} to {BIT_RATE / bits.least:.0f} Hz fill the wire; on virtual time less than "
        f"{ALLOWED_LATE:.1%} of the cycles are late up to {in_time or 0} Hz, and as few lack a reading up to "
        f"{complete or 0} Hz"
    )
    costs = Table(title, COST_HEADS, [cost_row(hz, found) for hz, found in loads.items()])
    figures = {
        "least_cycle_bits": bits.least,
        "most_cycle_bits": bits.most,
        "highest_in_time_hz": in_time,
        "highest_complete_hz": complete,
        "loads": {f"{hz:g}": asdict(found) if found else None for hz, found in loads.items()},
        "real_time": [asdict(result) for result in real],
        "highest_real_hz": highest_of(real),
    }
    tables = [costs, real_table("simulated network in the same process", real)]
    return Section("rates", tables, figures, [_draw(loads, bits, options.out / "rates.png")])


COST_HEADS = (
    "rate [Hz]",
    "daemon [us a cycle]",
    "of a core",
    "wire busy",
    "late cycles [%]",
    "incomplete cycles [%]",
    "lost frames",
)


def cost_row(hz: float, found: Load | None) -> tuple[str | float | None, ...]:
    """One rate; where the wire was too full to boot, that alone."""
    if found is None:
        return (hz, "does not boot", *[None] * (len(COST_HEADS) - 2))
    core = None if found.daemon_us is None else f"{found.daemon_us * hz / 1e6:.2%}"
    shares = [f"{100.0 * cycles / found.cycles:.2f}" for cycles in (found.late_cycles, found.incomplete_cycles)]
    daemon = "not seen: readings come late" if found.daemon_us is None else found.daemon_us
    return (hz, daemon, core, f"{found.wire_share:.2%}", *shares, found.lost_frames)


def _load_at(hz: float, seconds: float, tell: Callable[[str], None]) -> Load | None:
    """None where it does not boot, or does not move."""
    tell(f"{hz:g} Hz on virtual time")
    try:
        return load_of(robot_at(hz), STRAIGHT, seconds, SETTLE_S)
    except Timeout:
        return None


def _is_in_time(found: Load | None) -> bool:
    return found is not None and found.late_cycles <= ALLOWED_LATE * found.cycles and found.lost_frames == 0


def _is_complete(found: Load | None) -> bool:
    return found is not None and _is_in_time(found) and found.incomplete_cycles <= ALLOWED_LATE * found.cycles


def highest_kept(keeps: Callable[[float], bool]) -> int | None:
    """The highest rate of the grid that is kept; None: not even the lowest. Above one that is not kept none is."""
    rates = range(LOWEST_HZ, HIGHEST_HZ + 1, STEP_HZ)
    low, high = -1, len(rates)
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (middle, high) if keeps(rates[middle]) else (low, middle)
    return rates[low] if low >= 0 else None


def _draw(loads: Mapping[float, Load | None], bits: Bits, path: Path) -> Path:
    figure, (axes,) = panels(1, 1, (8, 4.5))
    booted = {hz: found for hz, found in loads.items() if found is not None}
    shares = {
        "the wire is busy": [found.wire_share for found in booted.values()],
        "a core, by the daemon": [(found.daemon_us or math.nan) * hz / 1e6 for hz, found in booted.items()],
        "cycles without some reading": [found.incomplete_cycles / found.cycles for found in booted.values()],
    }
    for colour, (words, values) in zip(COLOURS, shares.items(), strict=False):
        axes.plot(list(booted), [100.0 * value for value in values], "o-", color=colour, label=words)
    axes.axvspan(BIT_RATE / bits.most, BIT_RATE / bits.least, alpha=0.2, color="black", label="the wire's limit")
    axes.set(title="MAX2D at 1 Mbit/s", xlabel="cycles a second", ylabel="share [%]", xlim=(0.0, HIGHEST_HZ))
    axes.legend(fontsize="small")
    return saved(figure, path)


def kept_in_real_time(bus: str, seconds: float, tell: Callable[[str], None]) -> list[RateResult]:
    """Growing rates in real time, up to the first one that is not kept; that one is the last."""
    results: list[RateResult] = []
    for hz in REAL_RATES_HZ:
        tell(f"{hz:g} Hz for {seconds:g} s")
        try:
            results.append(run_precise(measure_rate(robot_at(hz), bus, hz, seconds)))
        except Timeout:
            break
        if not _is_kept_in_real_time(results[-1]):
            break
    return results


def _is_kept_in_real_time(result: RateResult) -> bool:
    return result.cycles > 0 and result.late_cycles <= ALLOWED_LATE * result.cycles


def highest_of(results: Sequence[RateResult]) -> float | None:
    """The highest rate that was kept."""
    return max((result.hz for result in results if _is_kept_in_real_time(result)), default=None)


def real_table(where: str, results: Sequence[RateResult]) -> Table:
    """Rates in real time."""
    heads = (
        "rate [Hz]",
        "cycles",
        "late cycles",
        "median latency [ms]",
        "worst latency [ms]",
        "worst jitter [ms]",
        "lost frames",
    )
    rows = [
        (r.hz, r.cycles, r.late_cycles, r.latency_ms, r.worst_latency_ms, r.worst_jitter_ms, r.lost_frames)
        for r in results
    ]
    highest = highest_of(results)
    return Table(f"in real time, {where}: {highest:g} Hz kept" if highest else f"in real time, {where}", heads, rows)
