"""How long it takes from a press on the page's stop to the quick stop of every drive on the bus.

The press is timed by the browser (``event.timeStamp`` and ``performance.timeOrigin``), the frames by the daemon
(``bus.frames``). Both clocks go by the kernel's monotonic one; the daemon dates its frames from the moment on at which
somebody asks for them first. Two things are compared besides: the browser's time of day with this program's, before and
after, and what the daemon's clock has left out because the machine kept its process waiting (``stood_still_s`` of
``status``), which is added, as a person would have to wait for it, too.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from statistics import quantiles
from typing import TYPE_CHECKING

from canhelm.client import Client
from vcan_tests.station.browser import Operator
from vcan_tests.station.processes import Robot, at_rest, speeds
from vcan_tests.vcan.witness import frames_of

if TYPE_CHECKING:
    from playwright.sync_api import Page

SPEED_M_S = 0.4
RPDO3 = range(0x401, 0x405)
QUICK_STOP = b"\x02\x00"
NOTE_PRESS = """() => document.getElementById("stop").addEventListener("pointerdown", event => {
    window.pressed_s = (performance.timeOrigin + event.timeStamp) / 1000;
}, {capture: true})"""
NOW = "() => (performance.timeOrigin + performance.now()) / 1000"


@dataclass(frozen=True)
class Press:
    """One press of the stop.

    Attributes:
        first_s, last_s: from the press to the quick stop of the first drive, and of the last one.
        still_s: what of it the daemon's clock has left out at most.
    """

    first_s: float
    last_s: float
    still_s: float


@dataclass(frozen=True)
class Latency:
    """What was measured.

    Attributes:
        presses: each.
        clock_s: largest difference between the browser's time of day and this program's; the way to the browser and
            back is in it.
    """

    presses: list[Press]
    clock_s: float

    def lines(self) -> list[str]:
        """For people."""
        cuts = [
            quantiles([getattr(press, name) for press in self.presses], n=100, method="inclusive")
            for name in ("first_s", "last_s")
        ]
        told = [f"p50 {cut[49] * 1e3:.1f} ms, p99 {cut[98] * 1e3:.1f} ms" for cut in cuts]
        still = max(press.still_s for press in self.presses)
        return [
            f"stop, {len(self.presses)} presses: first drive {told[0]}; all four {told[1]}",
            f"the daemon's clock stood still for {still * 1e3:.0f} ms in one of them at most; the browser's time of "
            f"day and this program's differ by {self.clock_s * 1e3:.1f} ms at most",
        ]


def clock_difference_s(page: Page) -> float:
    """Largest that the browser's time of day may differ from ours: the best of some looks."""
    bounds = []
    for _ in range(10):
        before_s = time.time()
        theirs_s = float(page.evaluate(NOW))
        bounds.append(max(abs(theirs_s - before_s), abs(time.time() - theirs_s)))
    return min(bounds)


def measure(operator: Operator, robot: Robot, presses: int) -> Latency:
    """Drive, press stop, and again.

    Args:
        operator: with that robot chosen.
        robot: a MAX2D.
        presses: how many.
    """
    operator.page.evaluate(NOTE_PRESS)
    clock_s = clock_difference_s(operator.page)
    with Client(robot.socket) as client:
        dated_s = float(client.status()["cycle"]["stood_still_s"])
        mark = int(client.call("bus.frames")["next"])
        taken = []
        for _ in range(presses):
            press, mark = _press(operator, robot, client, mark, dated_s)
            taken.append(press)
    return Latency(taken, max(clock_s, clock_difference_s(operator.page)))


def _press(operator: Operator, robot: Robot, client: Client, mark: int, dated_s: float) -> tuple[Press, int]:
    """One press at full speed, and the number of the next frame.

    Args:
        operator, robot: who presses, and what drives.
        client: for the frames.
        mark: number of a frame before it.
        dated_s: what the daemon's clock had left out when it dated its frames first.
    """
    robot.tidy()
    client.call("drive.parallel", angle_deg=0.0, speed_m_s=SPEED_M_S, duration_s=60.0, wait=False)
    moving = robot.comes_to(lambda status: min(speeds(status)) > 0.95 * SPEED_M_S)
    operator.page.locator("#stop").hover()
    operator.page.mouse.down()
    operator.page.mouse.up()
    pressed_s = float(operator.page.evaluate("() => window.pressed_s"))
    still_s = float(robot.comes_to(at_rest)["cycle"]["stood_still_s"])
    answer = client.call("bus.frames", after=mark)
    assert answer["lost"] == 0, answer["lost"]
    stops: dict[int, float] = {}
    for frame in frames_of("".join(f"{line}\n" for line in answer["frames"])):
        if frame.can_id in RPDO3 and frame.data[:2] == QUICK_STOP and frame.time_s + still_s - dated_s >= pressed_s:
            stops.setdefault(frame.can_id, frame.time_s + still_s - dated_s - pressed_s)
    assert len(stops) == len(RPDO3), stops
    press = Press(min(stops.values()), max(stops.values()), still_s - moving["cycle"]["stood_still_s"])
    return press, int(answer["next"])
