"""The control cycle beside its peers: 1 SYNC, 6 TPDOs decoded, 4 RPDOs encoded and sent.

Every row has the same simulated side, whose cost counts in each; all run in turn in this one process.
"""

from __future__ import annotations

from benchmarks.bars import draw_bars
from benchmarks.cycle_canhelm import CanhelmCycle, LawAlone
from benchmarks.cycle_floors import AsyncioFloor, Floor
from benchmarks.cycle_peers import CanopenAsyncio, PythonCan, PythonCanopen
from benchmarks.interleaving import Measured, Row, measure, verdict
from benchmarks.section import Options, Section, Table

CYCLES = 300
"""Of one row before the next one has its turn."""
WANTED = (None, 2.0, 0.35)
"""Of the ratios, with recording on."""
TITLE = "The control cycle: 1 SYNC out, 6 TPDOs in and decoded, 4 RPDOs out; CPU of the whole process"


def run(options: Options) -> Section:
    """Measure all rows in turn."""
    canhelm, unrecorded = CanhelmCycle(recording=True), CanhelmCycle(recording=False)
    rows: list[Row] = [
        Floor(),
        AsyncioFloor(),
        PythonCan(),
        PythonCanopen(),
        CanopenAsyncio(),
        canhelm,
        unrecorded,
        LawAlone(canhelm),
    ]
    found = measure(rows, CYCLES, options.seconds, options.tell)
    for row in (canhelm, unrecorded):
        row.require_whole()
    ratios = {key: _ratios(found, key) for key in ("canhelm", "canhelm_without_recording")}
    tables = (found.table(TITLE, "floor", "asyncio_floor"), _ratio_table(*ratios.values()))
    picture = draw_bars(found, "CPU of one control cycle [us]", options.out / "cycle.png")
    return Section("cycle", tables, {"rows": found.figures(), "ratios": ratios}, (picture,))


def _ratios(found: Measured, key: str) -> dict[str, float]:
    return {
        "to_asyncio_floor": found.ratio(key, "asyncio_floor"),
        "to_asyncio_floor_without_law": found.ratio(key, "asyncio_floor", "law"),
        "to_python_canopen": found.ratio(key, "python_canopen"),
    }


def _ratio_table(on: dict[str, float], off: dict[str, float]) -> Table:
    """The ratios, and what those with recording on are wanted to be at most."""
    names = ("to the asyncio floor", "the same without the law", "to python-canopen by name")
    rows = [
        (name, on[key], off[key], wanted, verdict(on[key], wanted) if wanted else None)
        for name, key, wanted in zip(names, on, WANTED, strict=True)
    ]
    heads = ("", "recording on", "recording off", "wanted at most", "with recording on")
    return Table("canhelm: ratios of CPU, medians of the ratios of all turns", heads, rows)
