"""The control cycle beside its peers: 1 SYNC, 6 TPDOs decoded, 4 RPDOs encoded and sent.

Every row has the same simulated side, whose cost counts in each; all run in turn in this one process.
"""

from __future__ import annotations

from benchmarks.bars import draw_bars
from benchmarks.cycle_canhelm import CanhelmCycle, LawAlone
from benchmarks.cycle_floors import AsyncioFloor, Floor
from benchmarks.cycle_peers import CanopenAsyncio, PythonCan, PythonCanopen
from benchmarks.interleaving import Row, measure
from benchmarks.section import Options, Section, Table

CYCLES = 300
"""Of one row before the next one has its turn."""
TITLE = "The control cycle: 1 SYNC out, 6 TPDOs in and decoded, 4 RPDOs out; CPU of the whole process"


def run(options: Options) -> Section:
    """Measure all rows in turn."""
    canhelm = CanhelmCycle(recording=True)
    rows: list[Row] = [
        Floor(),
        AsyncioFloor(),
        PythonCan(),
        PythonCanopen(),
        CanopenAsyncio(),
        canhelm,
        CanhelmCycle(recording=False),
        LawAlone(canhelm),
    ]
    found = measure(rows, CYCLES, options.seconds, options.tell)
    without_law = found.ratio("canhelm", "asyncio_floor", "law")
    ratios = {
        "canhelm_to_asyncio_floor_without_law": without_law,
        "canhelm_to_asyncio_floor": found.ratio("canhelm", "asyncio_floor"),
        "canhelm_to_python_canopen": found.ratio("canhelm", "python_canopen"),
    }
    tables = (
        found.table(TITLE, "floor", "asyncio_floor"),
        Table(
            "canhelm with recording on",
            ("", "ratio of CPU", "at most"),
            (
                ("to the asyncio floor, without the law", without_law, 2.0),
                ("to python-canopen by name", ratios["canhelm_to_python_canopen"], 0.35),
            ),
        ),
    )
    picture = draw_bars(found, "CPU of one control cycle [us]", options.out / "cycle.png")
    return Section("cycle", tables, {"rows": found.figures(), "ratios": ratios}, (picture,))
