"""``canhelm campaign``: series of simulated runs: the semi-trailer's laws as in its thesis' chapter 6, and faults."""

from __future__ import annotations

import math
import os
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import App, Parameter
from cyclopts.validators import Number

from daemon.cli.campaign_faults import faults
from daemon.cli.campaign_options import Out, Workers, work_off, worked_by
from daemon.cli.output import Json, console, say, show, wants_json, words
from daemon.cli.pictures import can_draw

if TYPE_CHECKING:
    from daemon.campaigns.cases import Case, Outcome
    from daemon.campaigns.tables import Row

app = App(name="campaign", help="Series of simulated runs, resumable, on all cores or a Dask cluster.")
app.command(faults)

Dask = Annotated[str | None, Parameter(help="Address of a Dask scheduler, whose workers drive instead.")]


@app.command
def bounds(
    *,
    through: Literal["ideal", "can"] = "ideal",
    random: Annotated[int | None, Parameter(validator=Number(gte=1))] = None,
    seed: int = 2009,
    out: Out = Path("campaign-bounds"),
    workers: Workers = None,
    dask: Dask = None,
    json: Json = None,
) -> int:
    """Largest errors and settling distances from initial errors, beside the bounds of the semi-trailer thesis.

    Example: `canhelm campaign bounds --out bounds`

    Args:
        through: Ideal kinematics, or the daemon on the simulated CAN network with all its sensors' faults (2 s a run).
        random: Number of random initial states; 200 without it, 20 through CAN.
        seed: Seed of them.
    """
    from daemon.campaigns import tables
    from daemon.campaigns.cases import bounds_cases
    from daemon.campaigns.step_cost import step_costs_us

    count = random or {"ideal": 200, "can": 20}[through]
    say(f"{count} random states of seed {seed}")
    finished = drive_missing(bounds_cases(count, seed, through), out, workers, dask)
    named = {
        "largest errors, position m/heading °/bending angle °, and settled after m": tables.bounds_table(finished),
        "by law": tables.law_table(finished),
        "of the 40 states never settle, by the steering's rate": tables.rates_table(finished),
        "one step of a law": [{"law": law, "cost_us": cost} for law, cost in step_costs_us().items()],
    }
    _show(named, json)
    _draw("bounds", finished, out)
    return 0


@app.command
def tuning(
    *,
    out: Out = Path("campaign-tuning"),
    workers: Workers = None,
    dask: Dask = None,
    json: Json = None,
) -> int:
    """The two parameters of the thesis' law: its own tests, and the 40 initial errors with each pair.

    Example: `canhelm campaign tuning --out tuning`
    """
    from daemon.campaigns import tables
    from daemon.campaigns.cases import tuning_cases

    finished = drive_missing(tuning_cases(), out, workers, dask)
    named = {
        "c_p: the bending angle to its target": tables.bending_table(finished),
        "c_v: from half a metre beside the line": tables.look_ahead_table(finished),
        "the 40 states: the best pair, and the thesis' pair": tables.best_tunings(finished),
    }
    _show(named, json)
    _draw("tuning", finished, out)
    return 0


def drive_missing(cases: Sequence[Case], out: Path, workers: int | None, dask: str | None) -> Mapping[Case, Outcome]:
    """Drive what is missing in the results file of ``out``; all runs in the order of the plan."""
    from daemon.campaigns.results import opened, write_parquet
    from daemon.campaigns.workers import drive_all

    with opened(out, cases) as results:
        missing = results.missing
        count = workers or len(os.sched_getaffinity(0))

        def kept() -> Iterator[int]:
            for batch in drive_all(missing, count, dask):
                results.keep(batch)
                yield len(batch)

        work_off("runs", len(cases) - len(missing), len(cases), out, dask or worked_by(count), kept())
        write_parquet(results, out)
        return results.in_order()


def _show(named: Mapping[str, Sequence[Row]], json: bool | None) -> None:
    """Each table on a terminal; else each row as an object that says which table it is of."""
    if wants_json(json):
        show([{"table": name, **row} for name, rows in named.items() for row in rows], json=True)
        return
    from rich.table import Table

    for name, rows in named.items():
        table = Table(*(rows[0] if rows else ()), title=name)
        for row in rows:
            table.add_row(*(_cell(value) for value in row.values()))
        console().print(table)


def _cell(value: Any) -> str:
    if not isinstance(value, Mapping):
        return "never" if value is None else words(value, digits=3)
    largest = f"{value['position_m']:.2f}/{value['heading_deg']:.0f}/{value['bending_deg']:.0f}"
    settled = value.get("worst_settle_m", math.nan)
    return f"{largest} " + ("never" if settled is None else f"{settled:.2f}".replace("nan", ""))


def _draw(what: Literal["bounds", "tuning"], finished: Mapping[Case, Outcome], out: Path) -> None:
    if not can_draw():
        return
    from daemon.campaigns import pictures

    draw = pictures.draw_bounds if what == "bounds" else pictures.draw_tuning
    for path in draw(finished, out):
        say(f"picture {path}")
