"""How fast the control cycle of the MAX2D can be: what each rate costs, what the wire carries, what this machine keeps.

On virtual time the processor takes no time, so only the wire can be too slow; in real time both can.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict

from benchmarks.bus_limit import cycle_bits
from benchmarks.load import Load, load_of
from benchmarks.nodes import BIT_RATE
from benchmarks.robots import STRAIGHT, robot_at
from benchmarks.section import Options, Section, Table
from canhelm.errors import Timeout
from daemon.board_bench import RateResult, measure_rate
from daemon.runtime.clock import run_precise

RATES_HZ = (100.0, 200.0, 500.0, 1000.0)
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
    highest = highest_kept(lambda hz: _is_kept(_load_at(hz, options.seconds, options.tell)))
    real = kept_in_real_time("simulated", options.seconds, options.tell)
    least, most = cycle_bits(DRIVES, ENCODERS)
    title = (
        f"{DRIVES} drives and {ENCODERS} encoders: {least} to {most} bits in a cycle, {BIT_RATE / most:.0f} to "
        f"{BIT_RATE / least:.0f} Hz fill the wire; {highest or 0} Hz is the highest rate with less than "
        f"{ALLOWED_LATE:.1%} late cycles, on virtual time"
    )
    costs = Table(title, COST_HEADS, [cost_row(hz, found) for hz, found in loads.items()])
    figures = {
        "cycle_bits": {"least": least, "most": most},
        "highest_virtual_hz": highest,
        "loads": {f"{hz:g}": asdict(found) if found else None for hz, found in loads.items()},
        "real_time": [asdict(result) for result in real],
        "highest_real_hz": highest_of(real),
    }
    return Section("rates", [costs, real_table("simulated network in the same process", real)], figures)


COST_HEADS = ("rate [Hz]", "daemon [us a cycle]", "of a core", "wire busy", "late", "incomplete", "frames lost")


def cost_row(hz: float, found: Load | None) -> tuple[str | float | None, ...]:
    """One rate; where the wire was too full to boot, only the rate."""
    if found is None:
        return (hz, *[None] * (len(COST_HEADS) - 1))
    shares = (found.daemon_us * hz / 1e6, found.wire_share, found.late / found.cycles, found.incomplete / found.cycles)
    return (hz, found.daemon_us, *(f"{share:.2%}" for share in shares), found.lost)


def _load_at(hz: float, seconds: float, tell: Callable[[str], None]) -> Load | None:
    """None where it does not boot, or does not move."""
    tell(f"{hz:g} Hz on virtual time")
    try:
        return load_of(robot_at(hz), STRAIGHT, seconds, SETTLE_S)
    except Timeout:
        return None


def _is_kept(found: Load | None) -> bool:
    return found is not None and found.late <= ALLOWED_LATE * found.cycles and found.lost == 0


def highest_kept(keeps: Callable[[float], bool]) -> int | None:
    """The highest rate of the grid that is kept; None: not even the lowest. Above one that is not kept none is."""
    rates = range(LOWEST_HZ, HIGHEST_HZ + 1, STEP_HZ)
    low, high = -1, len(rates)
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (middle, high) if keeps(rates[middle]) else (low, middle)
    return rates[low] if low >= 0 else None


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
    heads = ("rate [Hz]", "cycles", "late", "latency [ms]", "worst latency [ms]", "worst jitter [ms]", "frames lost")
    rows = [
        (r.hz, r.cycles, r.late_cycles, r.latency_ms, r.worst_latency_ms, r.worst_jitter_ms, r.lost_frames)
        for r in results
    ]
    highest = highest_of(results)
    return Table(f"in real time, {where}: {highest:g} Hz kept" if highest else f"in real time, {where}", heads, rows)
