"""What a node costs: the daemon's time in a cycle and the bits on the wire, from 2 nodes to 127."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import linear_regression

from msgspec.structs import replace

from benchmarks.bus_limit import cycle_bits
from benchmarks.load import load_of
from benchmarks.pictures import COLOURS, panels, saved
from benchmarks.robots import ROBOT, STANDING
from benchmarks.section import Options, Section, Table
from profiles.loader import load
from profiles.schema import Profile

COUNTS = (2, 6, 16, 32, 64, 127)
CYCLE_HZ = 20.0
"""What the wire carries with 127 drives."""
BIT_RATE = 1_000_000
SETTLE_S = 1.0
HEADS = (
    "drives",
    "daemon [us]",
    "by the line [us]",
    "bits",
    "least bits",
    "most bits",
    "the wire's limit [Hz]",
    "boot [s]",
)
PASSES = 3
"""One after the other, so that a machine that is slow for a while is so for all of them; the best one counts."""


@dataclass(frozen=True)
class Line:
    """The straight line through costs.

    Attributes:
        each: cost of one more.
        none: cost without any.
        residual: largest distance of a cost from the line.
    """

    each: float
    none: float
    residual: float

    def at(self, count: float) -> float:
        """The cost of so many by this line."""
        return self.none + self.each * count


def fit(counts: Sequence[float], costs: Sequence[float]) -> Line:
    """The straight line with the least squares."""
    each, none = linear_regression(counts, costs)
    residual = max(abs(cost - none - each * count) for count, cost in zip(counts, costs, strict=True))
    return Line(each, none, residual)


def drives_only(count: int, cycle_hz: float) -> Profile:
    """So many wheel drives on stands, without a vehicle."""
    profile = load(ROBOT).profile
    drive = profile.drives["rear_left"]
    return replace(
        profile,
        network=replace(profile.network, cycle_hz=cycle_hz),
        drives={f"drive_{node}": replace(drive, node=node) for node in range(1, count + 1)},
        encoders={},
        brakes={},
        vehicle=None,
    )


def run(options: Options, counts: Sequence[int] = COUNTS) -> Section:
    """Drives that stand; every one of them sends its readings and gets its targets in each cycle."""
    costs_us: dict[int, float] = {}
    bits: dict[int, float] = {}
    boots_s: dict[int, float] = {}
    for number in range(PASSES):
        for count in counts:
            options.tell(f"{count} nodes, pass {number + 1} of {PASSES}")
            found = load_of(drives_only(count, CYCLE_HZ), STANDING, options.seconds / PASSES, SETTLE_S)
            assert found.daemon_us is not None, "the wire carries all readings"
            costs_us[count] = min(found.daemon_us, costs_us.get(count, math.inf))
            bits[count], boots_s[count] = found.bits, found.boot_s
    line = fit(list(costs_us), list(costs_us.values()))
    figures = {
        "node_us": line.each,
        "without_nodes_us": line.none,
        "residual_us": line.residual,
        "counts": {
            str(count): {"daemon_us": cost, "bits": bits[count], "boot_s": boots_s[count]}
            for count, cost in costs_us.items()
        },
    }
    picture = _draw(costs_us, bits, line, options.out / "nodes.png")
    return Section("nodes", [_table(costs_us, bits, boots_s, line)], figures, [picture])


def _table(costs_us: Mapping[int, float], bits: Mapping[int, float], boots_s: Mapping[int, float], line: Line) -> Table:
    rows = [
        (count, cost, line.at(count), bits[count], *cycle_bits(count), BIT_RATE / bits[count], boots_s[count])
        for count, cost in costs_us.items()
    ]
    title = (
        f"the daemon's time in a cycle, {CYCLE_HZ:g} Hz, virtual time; the straight line, {line.each:.2f} us a drive "
        f"and {line.none:.0f} us, misses it by up to {line.residual:.0f} us"
    )
    return Table(title, HEADS, rows)


def _draw(costs_us: Mapping[int, float], bits: Mapping[int, float], line: Line, path: Path) -> Path:
    counts = list(costs_us)
    figure, (cost, limit) = panels(1, 2, (12, 4.5))
    cost.plot(counts, list(costs_us.values()), "o", color=COLOURS[0])
    ends = [0, max(counts)]
    cost.plot(ends, [line.at(end) for end in ends], color="black", linewidth=0.9)
    cost.set(
        title=f"{line.each:.2f} µs a drive, up to {line.residual:.0f} µs beside the line",
        xlabel="drives",
        ylabel="the daemon's time in a cycle [µs]",
    )
    limit.plot(counts, [BIT_RATE / bits[count] for count in counts], "o-", color=COLOURS[0], label="the wire")
    by_daemon = [1e6 / cost for cost in costs_us.values()]
    limit.plot(counts, by_daemon, "s-", color=COLOURS[1], label="the daemon alone")
    limit.set(title="limits", xlabel="drives", ylabel="cycles a second", xscale="log", yscale="log")
    limit.legend(fontsize="small")
    return saved(figure, path)
