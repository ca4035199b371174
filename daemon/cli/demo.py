"""``canhelm demo``: the published manoeuvres on a simulated network, in one process."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from canhelm.errors import UsageError
from daemon.cli.demo_ackermann import demo_ackermann
from daemon.cli.demo_max2d_path import demo_max2d_path
from daemon.cli.demo_run import DemoRun
from daemon.cli.demo_semitrailer import demo_semitrailer
from daemon.cli.demo_view import DemoView
from daemon.cli.output import Json, say, show, words
from daemon.cli.pictures import can_draw
from daemon.cli.run import simulates

if TYPE_CHECKING:
    from rich.table import Table

    from daemon.demo import Figure, FigureResult
    from daemon.demo_nxt import NxtResult
    from daemon.demo_turtle import TurtleResult
    from profiles.faults import PlacedFault
    from profiles.schema import Profile

NXT = "nxt"
PATH_IN_PIECES = "path-in-pieces"
ACKERMANN = ("ackermann", "step-from-rest", "step-to-the-right", "step-slower", "step-far")
SEMITRAILER = ("semitrailer", "line-backwards", "circle-backwards", "park-parallel", "park-perpendicular")


def demo(
    *,
    figure: str | None = None,
    virtual_time: Annotated[bool, Parameter(negative=())] = False,
    seed: int = 0,
    out: Path | None = None,
    profile: str | None = None,
    bus: str = "simulated",
    faults: Path | None = None,
    json: Json = None,
) -> int:
    """Boot a simulated robot and drive the manoeuvres that its designers published.

    Example: `canhelm demo --virtual-time --out demo-out`

    Args:
        figure: One figure of the MAX2D (4.6, 4.7, 4.15 or 4.16), all of them without it; one of the Turtle (7.3, 7.4,
            7.6, 7.7, ice-off, ice-on), or `turtle` for all of those; `nxt` for the NXT robot's;
            one of the semi-trailer (line-backwards, circle-backwards, park-parallel, park-perpendicular), or
            `semitrailer` for all of those; one of the Ackermann car (step-from-rest, step-to-the-right, step-slower,
            step-far), or `ackermann` for all of those; `path-in-pieces`, the MAX2D on a path.
        virtual_time: As fast as the processor goes instead of in real time; the same run every time.
        seed: Seed of everything random in the simulated network.
        out: Folder for pictures and the candump log.
        profile: A robot like the figure's with simulation data; `max2d` or `turtle` without it.
        bus: `simulated`, or `rs232` (`rs232@38400`): the same robot behind the serial line of one of its drives.
        faults: YAML file of faults that strike the MAX2D on its figures (docs/faults.md).
    """
    from daemon import demo_turtle
    from daemon.demo import FIGURES
    from daemon.runtime.clock import run_patient, run_virtual
    from profiles.faults import load_faults
    from profiles.loader import load

    if faults and figure not in (None, *(entry.identity for entry in FIGURES)):
        raise UsageError("--faults is for the figures of the MAX2D", value=figure, remedy="leave out one of the two")
    run = DemoRun(seed, out, json, run_virtual if virtual_time else run_patient)
    if figure == NXT:
        return _nxt(load(profile or NXT).profile, run)
    if figure in (*SEMITRAILER, *ACKERMANN, PATH_IN_PIECES):
        return _on_paths(figure, profile, run)
    figures = tuple(entry for entry in FIGURES if figure in (None, entry.identity))
    turtle = tuple(entry for entry in demo_turtle.FIGURES if figure in (demo_turtle.GROUP, entry.identity))
    if not figures and not turtle:
        others = (demo_turtle.GROUP, NXT, *SEMITRAILER, *ACKERMANN, PATH_IN_PIECES)
        have = ", ".join(entry.identity for entry in (*FIGURES, *demo_turtle.FIGURES))
        raise UsageError(f"no figure {figure!r}", remedy=f"one of {have}, {', '.join(others)}")
    robot = load(profile or ("turtle" if turtle else "max2d")).profile
    if turtle and bus != "simulated":
        raise UsageError("the accelerometer needs CAN", value=bus, remedy="leave --bus out")
    if not simulates(bus):
        raise UsageError(
            f"the demo simulates its network, on {bus!r} it cannot", remedy="--bus simulated or --bus rs232"
        )
    strikes = load_faults(faults, robot) if faults else ()
    run.begin()
    if turtle:
        return run.drive(
            [partial(demo_turtle.drive, robot, entry, seed, out, say) for entry in turtle], _turtle_table, _draw_turtle
        )
    return _max2d(figures, robot, bus, run, strikes, every=100 if virtual_time else 10)


def _max2d(
    figures: tuple[Figure, ...], robot: Profile, bus: str, run: DemoRun, faults: Sequence[PlacedFault], every: int
) -> int:
    from daemon.demo import Demo

    with DemoView(every) as view:

        async def drive() -> list[FigureResult]:
            return await Demo(robot, run.seed, run.out, view.tell, view.watch, bus, faults).run(figures)

        results: list[FigureResult] = run.runner(drive())
    run.show(results, _table, partial(_draw, robot))
    return 0


def _on_paths(figure: str, profile: str | None, run: DemoRun) -> int:
    """A figure of a vehicle that steers while it rolls, or of the MAX2D on a path."""
    from profiles.loader import load

    run.begin()
    if figure == PATH_IN_PIECES:
        return demo_max2d_path(load(profile or "max2d").profile, run)
    group, drive = (SEMITRAILER, demo_semitrailer) if figure in SEMITRAILER else (ACKERMANN, demo_ackermann)
    return drive(figure, load(profile or group[0]).profile, run)


def _turtle_table(rows: list[dict[str, Any]]) -> Table:
    from rich.table import Table

    table = Table("figure", "move", "quantity", "published", "commanded", "achieved", title="Turtle, simulated")
    for row in rows:
        for key, value in row["achieved"].items():
            cells = [row["published"].get(key), row["commanded"].get(key), value]
            shown = ["-" if cell is None else f"{cell:g}" for cell in cells]
            table.add_row(row["figure"], row["move"], key, *shown)
        table.add_section()
    return table


def _draw_turtle(result: TurtleResult, folder: Path) -> Path:
    from daemon.demo_turtle_pictures import draw

    return draw(result, folder)


def _nxt(robot: Profile, run: DemoRun) -> int:
    from daemon import demo_nxt

    run.begin()

    async def drive() -> list[NxtResult]:
        return [await demo_nxt.drive(robot, figure, run.seed, say) for figure in demo_nxt.FIGURES]

    results: list[NxtResult] = run.runner(drive())
    calls = demo_nxt.report_calls()
    show([*(result.numbers for result in results), *(call.numbers for call in calls)], _nxt_table, run.json)
    if run.out is not None and can_draw():
        from daemon.demo_nxt_pictures import draw_calls, draw_moves

        for path in (draw_moves(results, run.out), *draw_calls(calls, run.out)):
            say(f"picture {path}")
    return 0


def _nxt_table(rows: list[dict[str, Any]]) -> Table:
    from rich.table import Table

    table = Table("figure", "quantity", "published", "open loop", "feedback", title="NXT, simulated")
    for row in rows:
        published, ways = row["published"], [row.get(way, {}) for way in ("open_loop", "feedback")]
        if "reached" in row:
            told = [words(published["reached"]), "-", f"{words(row['reached'])} ({row['duration_s']:g} s)"]
            table.add_row(row["figure"], "reached", *told)
            continue
        for key in ("error_cm", "heading_error_deg", "tacho_error_deg", "duration_s"):
            table.add_row(row["figure"], key, *(words(part.get(key)) for part in (published, *ways)))
        table.add_section()
    return table


def _table(rows: list[dict[str, Any]]) -> Table:
    from rich.table import Table

    table = Table("figure", "move", "quantity", "published", "commanded", "achieved", title="MAX2D, simulated")
    for row in rows:
        keys = ("radius_m",) if row["move"] == "turn" else ("end_x_m", "end_y_m")
        for key in keys:
            cells = [row[column].get(key) for column in ("published", "commanded", "achieved")]
            shown = ["-" if cell is None else f"{cell:.3f}" for cell in cells]
            table.add_row(row["figure"], row["move"], key, *shown)
        achieved = row["achieved"]
        table.add_row("", "", "steering error, deg", "-", "0", f"{achieved['steering_error_deg']:.2f}")
        table.add_row("", "", "slip ratio | slip angle, deg", "-", "-",
                      f"{achieved['max_slip_ratio']:.3f} | {achieved['max_slip_angle_deg']:.2f}")  # fmt: skip
        table.add_section()
    return table


def _draw(robot: Profile, result: FigureResult, folder: Path) -> Path:
    from daemon.demo_pictures import draw
    from profiles.schema import PairedSteerGeometry

    assert isinstance(robot.vehicle, PairedSteerGeometry)
    return draw(result, robot.vehicle, folder)
