"""``make station-figures``: how soon a stop is on the bus, what open pages cost, and whether an open page grows."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from vcan_tests.arguments import positive
from vcan_tests.station import cost, latency
from vcan_tests.station.browser import Operator, chromium
from vcan_tests.station.processes import Fleet, running_fleet
from vcan_tests.station.suite import require_chromium, version

if TYPE_CHECKING:
    from playwright.sync_api import Browser

Kept = dict[str, object]


def main() -> int:
    """Measure what was asked for; the figures go to stdout and into a file."""
    parser = argparse.ArgumentParser(prog="make station-figures", description=__doc__)
    parser.add_argument("--part", choices=list(MEASURES), action="append", help="only this one")
    parser.add_argument("--minutes", type=positive, default=10.0, help="that a page stays open (default 10)")
    parser.add_argument("--seconds", type=positive, default=20.0, help="of each number of pages (default 20)")
    parser.add_argument("--presses", type=int, default=100, help="of the stop (default 100)")
    parser.add_argument("--out", type=Path, default=Path("bench-out"), help="folder for station.json")
    asked = parser.parse_args()
    require_chromium()
    print(version(), flush=True)
    kept: Kept = {}
    with (
        TemporaryDirectory() as folder,
        chromium() as browser,
        running_fleet(Path(folder), ("max2d",)) as fleet,
    ):
        for part in asked.part or MEASURES:
            MEASURES[part](browser, fleet, asked, kept)
    asked.out.mkdir(parents=True, exist_ok=True)
    (asked.out / "station.json").write_text(json.dumps(kept, indent=1))
    return 0


def _say(*lines: str) -> None:
    print(*lines, sep="\n", flush=True)


def _stop(browser: Browser, fleet: Fleet, asked: argparse.Namespace, kept: Kept) -> None:
    operator, robot = Operator(browser, fleet.station.url), fleet.robots["max2d"]
    operator.open(robot.name)
    found = latency.measure(operator, robot, asked.presses)
    operator.close()
    kept["stop"] = asdict(found)
    _say(*found.lines())


def _pages(browser: Browser, fleet: Fleet, asked: argparse.Namespace, kept: Kept) -> None:
    costs = cost.cost_of_pages(browser, fleet, asked.seconds)
    kept["pages"] = [asdict(each) for each in costs]
    _say(*cost.table(costs))


def _open(browser: Browser, fleet: Fleet, asked: argparse.Namespace, kept: Kept) -> None:
    looks = cost.watch_open_page(browser, fleet, asked.minutes, lambda look: _say(look.line()))
    kept["open"] = [asdict(each) for each in looks]


MEASURES: dict[str, Callable[[Browser, Fleet, argparse.Namespace, Kept], None]]
MEASURES = {"stop": _stop, "pages": _pages, "open": _open}


if __name__ == "__main__":
    sys.exit(main())
