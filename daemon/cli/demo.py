"""``canhelm demo``: the published manoeuvres on a simulated network, in one process."""

from __future__ import annotations

import importlib.util
import signal
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from canhelm.errors import UsageError
from daemon.cli.demo_view import DemoView
from daemon.cli.output import Json, say, show

if TYPE_CHECKING:
    from rich.table import Table

    from daemon.demo import FigureResult


def demo(
    *,
    figure: str | None = None,
    virtual_time: Annotated[bool, Parameter(negative=())] = False,
    seed: int = 0,
    out: Path | None = None,
    profile: str = "max2d",
    bus: str = "simulated",
    json: Json = None,
) -> int:
    """Boot a simulated MAX2D and drive the manoeuvres that its designers published.

    Example: `canhelm demo --virtual-time --out demo-out`

    Args:
        figure: One figure (4.6, 4.7, 4.15 or 4.16); all of them without it.
        virtual_time: As fast as the processor goes instead of in real time; the same run every time.
        seed: Seed of everything random in the simulated network.
        out: Folder for pictures and the candump log.
        profile: A robot with paired steering and simulation data.
        bus: `simulated`, or `rs232` (`rs232@38400`): the same robot behind the serial line of one of its drives.
    """
    from daemon.demo import FIGURES, Demo
    from daemon.runtime.clock import run_precise, run_virtual
    from profiles.loader import load

    figures = tuple(entry for entry in FIGURES if figure in (None, entry.identity))
    if not figures:
        have = ", ".join(entry.identity for entry in FIGURES)
        raise UsageError(f"no figure {figure!r}", remedy=f"one of {have}")
    robot = load(profile).profile
    if bus.partition("@")[0] not in ("simulated", "rs232"):
        raise UsageError(
            f"the demo simulates its network, on {bus!r} it cannot", remedy="--bus simulated or --bus rs232"
        )
    if out is not None:
        _make_folder(out)
    _end_by_signals()
    with DemoView(every=100 if virtual_time else 10) as view:

        async def drive() -> list[FigureResult]:
            return await Demo(robot, seed, out, view.tell, view.watch, bus).run(figures)

        results = run_virtual(drive()) if virtual_time else run_precise(drive())
    show([result.numbers for result in results], lambda _: _table(results), json)
    if out is not None:
        _draw(results, robot.vehicle, out)
    return 0


def _end_by_signals() -> None:
    """The loop ends the demo in order on SIGINT, which shells ignore for background jobs; other signals become one."""
    signal.signal(signal.SIGINT, signal.default_int_handler)
    for number in (signal.SIGTERM, signal.SIGHUP):
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, _as_ctrl_c)


def _as_ctrl_c(number: int, _: object) -> None:
    signal.raise_signal(signal.SIGINT)


def _make_folder(out: Path) -> None:
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UsageError(
            f"--out {out} is no folder and cannot be made one: {error.strerror}",
            value=str(out),
            remedy="name a folder that this user may write to",
        ) from error


def _table(results: list[FigureResult]) -> Table:
    from rich.table import Table

    table = Table("figure", "move", "quantity", "published", "commanded", "achieved", title="MAX2D, simulated")
    for result in results:
        numbers = result.numbers
        keys = ("radius_m",) if result.figure.move == "turn" else ("end_x_m", "end_y_m")
        for key in keys:
            cells = [numbers[column].get(key) for column in ("published", "commanded", "achieved")]
            shown = ["-" if cell is None else f"{cell:.3f}" for cell in cells]
            table.add_row(result.figure.identity, result.figure.move, key, *shown)
        achieved = numbers["achieved"]
        table.add_row("", "", "steering error, deg", "-", "0", f"{achieved['steering_error_deg']:.2f}")
        table.add_row("", "", "slip ratio | slip angle, deg", "-", "-",
                      f"{achieved['max_slip_ratio']:.3f} | {achieved['max_slip_angle_deg']:.2f}")  # fmt: skip
        table.add_section()
    return table


def _draw(results: list[FigureResult], geometry: Any, out: Path) -> None:
    if importlib.util.find_spec("matplotlib") is None:
        say("no pictures: matplotlib is missing - pip install 'canhelm[plot]'")
        return
    from daemon.demo_pictures import draw

    for result in results:
        say(f"picture {draw(result, geometry, out)}")
