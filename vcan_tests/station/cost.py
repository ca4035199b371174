"""What open pages cost: the control cycle's time, processor time, bytes; and whether a page that stays open grows."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from statistics import mean
from typing import TYPE_CHECKING, Any

from vcan_tests.station.browser import Operator
from vcan_tests.station.processes import Fleet, Robot
from vcan_tests.station.wire import Wire, wire_to

if TYPE_CHECKING:
    from playwright.sync_api import Browser

PAGES = (0, 1, 5, 5, 1, 0)
"""Forth and back, so that a machine that gets slower meanwhile is no difference."""
COUNT_UPDATES = """() => {
    window.updates = 0;
    return import("/page/station.js").then(({station}) => station.on("status", () => window.updates++));
}"""


@dataclass(frozen=True)
class Cost:
    """A while with some pages open.

    Attributes:
        pages: how many.
        seconds: how long.
        cycles: control cycles in it.
        late: of them, more than half a period late.
        daemon_s: processor time of the daemon, a second.
        station_s: of the station, a second.
        bytes_s: went to the pages, a second; TCP's and IP's own are not counted.
    """

    pages: int
    seconds: float
    cycles: int
    late: int
    daemon_s: float
    station_s: float
    bytes_s: float


@dataclass(frozen=True)
class Look:
    """A look at a page that stays open.

    Attributes:
        at_s: after it was opened.
        updates: that it got.
        heap_bytes: of JavaScript, after its garbage was collected.
        nodes: of the document, those that nobody has collected among them.
        listeners: of events.
        daemon_bytes, station_bytes: resident memory.
    """

    at_s: float
    updates: int
    heap_bytes: int
    nodes: int
    listeners: int
    daemon_bytes: int
    station_bytes: int

    def line(self) -> str:
        """For people."""
        return (
            f"{self.at_s / 60:6.1f} min {self.updates:7d} updates, heap {self.heap_bytes / 1e6:.2f} MB, "
            f"{self.nodes} nodes, {self.listeners} listeners, daemon {self.daemon_bytes / 2**20:.1f} MiB, "
            f"station {self.station_bytes / 2**20:.1f} MiB"
        )


def cost_of_pages(browser: Browser, fleet: Fleet, seconds: float) -> list[Cost]:
    """The cost of no, one and five pages, each measured twice; between them nothing else is open."""
    robot = next(iter(fleet.robots.values()))
    return [_cost(browser, fleet, robot, pages, seconds) for pages in PAGES]


def table(costs: Sequence[Cost]) -> list[str]:
    """For people: a line for each number of pages, the mean of its turns."""
    lines = []
    for pages in sorted({cost.pages for cost in costs}):
        turns = [cost for cost in costs if cost.pages == pages]
        cycle_us = 1e6 * mean(cost.daemon_s * cost.seconds / cost.cycles for cost in turns)
        cycles, late = sum(cost.cycles for cost in turns), sum(cost.late for cost in turns)
        daemon, station = (100.0 * mean(getattr(cost, name) for cost in turns) for name in ("daemon_s", "station_s"))
        kilobytes = mean(cost.bytes_s for cost in turns) / 1e3 / max(pages, 1)
        lines.append(
            f"{pages} pages: {cycle_us:.0f} us of the daemon a cycle ({daemon:.1f} % of a core), "
            f"{late} of {cycles} late; station {station:.1f} % of a core, {kilobytes:.1f} kB/s a page"
        )
    return lines


@contextmanager
def open_pages(browser: Browser, wire: Wire, robot: Robot, pages: int) -> Iterator[list[Operator]]:
    """People at so many pages who watch a robot, while the ``with`` block lasts."""
    with ExitStack() as stack:
        operators = []
        for _ in range(pages):
            operator = Operator(browser, wire.url)
            stack.callback(operator.close)
            operator.open(robot.name)
            operators.append(operator)
        yield operators


def _cost(browser: Browser, fleet: Fleet, robot: Robot, pages: int, seconds: float) -> Cost:
    with wire_to(fleet.station.port) as wire, open_pages(browser, wire, robot, pages):
        before = _counters(fleet, robot, wire)
        _pass(browser, seconds)
        after = _counters(fleet, robot, wire)
    took_s, cycles, late, daemon_s, station_s, size = (now - then for now, then in zip(after, before, strict=True))
    return Cost(pages, took_s, int(cycles), int(late), daemon_s / took_s, station_s / took_s, size / took_s)


def _pass(browser: Browser, seconds: float) -> None:
    """Let the time pass that is measured, at an empty page that asks nobody for anything."""
    page = browser.new_page()
    page.wait_for_timeout(seconds * 1e3)
    page.close()


def _counters(fleet: Fleet, robot: Robot, wire: Wire) -> tuple[float, ...]:
    cycle = robot.status()["cycle"]
    processors = (robot.processor_s(), fleet.station.processor_s())
    return (time.monotonic(), cycle["cycles"], cycle["late_cycles"], *processors, wire.bytes_of["down"])


def watch_open_page(browser: Browser, fleet: Fleet, minutes: float, told: Callable[[Look], None]) -> list[Look]:
    """Looks at a page that stays open: after its first minute, and each tenth of the time from there on.

    The robot drives in a circle meanwhile, so that map and devices are drawn anew at each update.
    """
    robot = next(iter(fleet.robots.values()))
    with wire_to(fleet.station.port) as wire, open_pages(browser, wire, robot, 1) as (operator,):
        operator.go_to("devices")
        operator.page.evaluate(COUNT_UPDATES)
        robot.call("drive.turn", rear_deg=-15.0, front_deg=15.0, speed_m_s=0.2, duration_s=3600.0, wait=False)
        session = operator.context.new_cdp_session(operator.page)
        begun_s, looks = time.monotonic(), []
        for tenth in range(11):
            wanted_s = min(60.0, 6.0 * minutes) + tenth * (60.0 * minutes - min(60.0, 6.0 * minutes)) / 10.0
            operator.page.wait_for_timeout(max(0.0, wanted_s - (time.monotonic() - begun_s)) * 1e3)
            looks.append(_look(operator, session, fleet, robot, time.monotonic() - begun_s))
            told(looks[-1])
        robot.call("stop")
        assert operator.unexpected() == [], operator.unexpected()
    return looks


def _look(operator: Operator, session: Any, fleet: Fleet, robot: Robot, at_s: float) -> Look:
    session.send("HeapProfiler.collectGarbage")
    session.send("HeapProfiler.collectGarbage")
    memory = session.send("Memory.getDOMCounters")
    heap = session.send("Runtime.getHeapUsage")["usedSize"]
    updates = int(operator.page.evaluate("() => window.updates"))
    resident = (robot.memory_bytes(), fleet.station.memory_bytes())
    return Look(at_s, updates, int(heap), memory["nodes"], memory["jsEventListeners"], *resident)
