"""``python -m benchmarks [PART ...] --out bench-out``: what canhelm costs and how fast it is on this machine.

A part is a module here with ``run(options) -> Section``. All of them, one after the other, take about ten minutes.
"""

from __future__ import annotations

import argparse
import json
import logging
import os
import platform
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from datetime import UTC, datetime
from importlib import import_module
from pathlib import Path
from typing import Any

from rich.table import Table as Grid
from rich.text import Text

from benchmarks.section import Options, Section, Table
from canhelm import __version__
from canhelm.errors import CanhelmError
from daemon.cli.motion import INTERRUPTED
from daemon.cli.output import console, say, say_error, words
from daemon.cli.pictures import make_folder
from vcan_tests.arguments import positive

PARTS = (
    "cycle",
    "sdo",
    "latency",
    "jitter",
    "process",
    "command_line",
    "simulation",
    "nodes",
    "rates",
    "serial",
    "campaigns",
)
"""In the order in which they run."""
BOOTED = ("vcan",)
"""Runs when it is asked for: needs a kernel's CAN."""
RESULTS = "bench.json"
SECONDS = """of each measurement (default 10); virtual ones in simulation, nodes, serial and the first table of rates;
cycle and sdo have them for all their rows together; the starts in process take what they take"""


def main(argv: Sequence[str] | None = None) -> int:
    """Measure what was asked for; what an earlier run found of other parts stays in the results."""
    asked = _parse(argv)
    names, done = asked.parts or PARTS + BOOTED * asked.vcan, 0
    try:
        make_folder(asked.out)
        for name in names:
            _measure_and_show(name, asked)
            done += 1
    except CanhelmError as error:
        say_error(error)
        return error.exit_code
    except KeyboardInterrupt:
        say(f"interrupted; kept in {asked.out / RESULTS}: {done} of {len(names)} parts")
        return INTERRUPTED
    return 0


def _measure_and_show(name: str, asked: argparse.Namespace) -> None:
    with _progress(name) as tell:
        section = measure(name, Options(asked.out, asked.seconds, tell))
    keep(section, asked.out / RESULTS)
    for table in section.tables:
        console().print(grid(table), "")
    for picture in section.pictures:
        console().print(f"picture: {picture}", markup=False)


def _parse(argv: Sequence[str] | None) -> argparse.Namespace:
    known = PARTS + BOOTED
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    parser.add_argument("parts", nargs="*", metavar="PART", help=f"of {', '.join(known)} (default: all but vcan)")
    parser.add_argument("--out", type=Path, default=Path("bench-out"), help="folder for figures and pictures")
    parser.add_argument("--seconds", type=positive, default=10.0, help=SECONDS)
    parser.add_argument("--vcan", action="store_true", help="the part vcan, too, on a kernel that is booted if need be")
    asked = parser.parse_args(argv)
    if unknown := sorted(set(asked.parts) - set(known)):
        parser.error(f"no such part: {', '.join(unknown)}; there are {', '.join(known)}")
    return asked


@contextmanager
def _progress(name: str) -> Iterator[Callable[[str], None]]:
    """Shows on a terminal what a part is at."""
    shown = console(stderr=True)
    if not shown.is_terminal:
        yield lambda _: None
        return
    with shown.status(name) as status:
        yield lambda words: status.update(f"{name}: {words}")


def measure(name: str, options: Options) -> Section:
    """Run one part."""
    section: Section = import_module(f"benchmarks.{name}").run(options)
    return section


def keep(section: Section, path: Path) -> None:
    """Put a part's figures into the results, in place of older ones of that part."""
    results: dict[str, Any] = json.loads(path.read_text()) if path.exists() else {}
    results[section.name] = {"measured": _circumstances(), **section.figures}
    path.write_text(json.dumps(results, indent=2) + "\n")


def _circumstances() -> dict[str, Any]:
    """On what machine, and when."""
    return {
        "at": datetime.now(UTC).isoformat(timespec="seconds"),
        "canhelm": __version__,
        "python": platform.python_version(),
        "kernel": platform.release(),
        "processors": len(os.sched_getaffinity(0)),
        "load": round(os.getloadavg()[0], 2),
    }


def grid(table: Table) -> Grid:
    """A table for a terminal."""
    drawn = Grid(title=Text(table.title), title_justify="left", box=None, header_style="bold")
    for head in table.heads:
        drawn.add_column(Text(head))  # a plain string loses its [us]: rich takes that for markup
    for row in table.rows:
        drawn.add_row(*(Text(words(value, 3)) for value in row))
    return drawn


if __name__ == "__main__":
    logging.getLogger("canhelm").setLevel(logging.CRITICAL)  # robots at rates that no wire carries have much to say
    sys.exit(main())
