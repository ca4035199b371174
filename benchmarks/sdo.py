"""An expedited SDO upload beside its peers: request, answer, value; client and server in this one process."""

from __future__ import annotations

from benchmarks.bars import draw_bars
from benchmarks.interleaving import Row, measure, verdict
from benchmarks.sdo_canhelm import SdoCanhelm
from benchmarks.sdo_floors import SdoAsyncioFloor, SdoFloor
from benchmarks.sdo_peers import SdoCanopenAsyncio, SdoPythonCanopen
from benchmarks.section import Options, Section, Table

UPLOADS = 300
"""Of one row before the next one has its turn."""
WANTED = 1.3
"""Of the ratio to the asyncio floor."""
TITLE = "An expedited SDO upload: client and server; CPU of the whole process"


def run(options: Options) -> Section:
    """Measure all rows in turn."""
    rows: list[Row] = [SdoFloor(), SdoAsyncioFloor(), SdoCanhelm(), SdoPythonCanopen(), SdoCanopenAsyncio()]
    found = measure(rows, UPLOADS, options.seconds, options.tell)
    ratio = found.ratio("canhelm", "asyncio_floor")
    heads = ("", "ratio of CPU", "wanted at most", "verdict")
    told = ("to the asyncio floor", ratio, WANTED, verdict(ratio, WANTED))
    tables = (
        found.table(TITLE, "floor", "asyncio_floor"),
        Table("canhelm: the ratio of CPU, the median of the ratios of all turns", heads, (told,)),
    )
    picture = draw_bars(found, "CPU of one SDO upload [us]", options.out / "sdo.png")
    return Section("sdo", tables, {"rows": found.figures(), "ratios": {"canhelm_to_asyncio_floor": ratio}}, (picture,))
