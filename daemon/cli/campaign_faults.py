"""``canhelm campaign faults``: faults at every moment of a boot, a steering manoeuvre, a drive and a stop."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter
from cyclopts.validators import Number

from canhelm.errors import UsageError
from daemon.cli.campaign_options import Out, Workers, work_off, worked_by
from daemon.cli.output import Json, console, plain, say, show, wants_json, words
from daemon.cli.pictures import can_draw

if TYPE_CHECKING:
    from daemon.campaigns.faults.outcome import Outcome
    from daemon.campaigns.faults.strikes import Injection

SHOWN = 20
"""Violations that a person is shown at once; all are in the file."""

Samples = Annotated[int, Parameter(validator=Number(gte=1))]
Only = Annotated[str | None, Parameter(help="KIND:INDEX of one injection: plays it again, and tells what happens.")]


def faults(
    *kinds: str,
    samples: Samples = 30,
    seed: int = 1,
    only: Only = None,
    out: Out = Path("campaign-faults"),
    workers: Workers = None,
    json: Json = None,
) -> int:
    """Break a simulated MAX2D at every moment, and judge by the simulation's truth what it does.

    Exit code 1 where anything was violated.

    Example: `canhelm campaign faults --out faults`

    Example: `canhelm campaign faults --only lose:3100`

    Args:
        kinds: Of faults, as docs/fault-campaign.md lists them; all without any.
        samples: Injections of each kind in each manoeuvre but the stop, which has them at every point.
        seed: Seed of the simulated network, and of what is chosen.
    """
    if only is not None:
        return _play_again(only, seed, json)
    from daemon.campaigns.faults.plan import named, planned
    from daemon.campaigns.faults.points import note_points

    names = named(kinds)
    points, undisturbed = note_points(seed)
    if undisturbed.judge.violations:
        raise UsageError(f"without any fault: {words(undisturbed.judge.violations)}", remedy="report it with the seed")
    plan = planned(points, samples, seed, names)
    return _try(plan, seed, out, workers or len(os.sched_getaffinity(0)), json)


def _try(plan: Sequence[Injection], seed: int, out: Path, workers: int, json: bool | None) -> int:
    """Try what is missing in the results file of ``out``; tables of all that was planned."""
    from daemon.campaigns.faults.results import opened, violated, write_summary
    from daemon.campaigns.faults.workers import outcomes_of

    with opened(out, seed) as results:
        missing = [injection for injection in plan if injection not in results.tried]

        def kept() -> Iterator[int]:
            for outcome in outcomes_of(missing, seed, workers):
                results.keep(outcome)
                yield 1

        work_off("injections", len(plan) - len(missing), len(plan), out, worked_by(workers), kept())
        tried = [results.tried[injection] for injection in plan]
    say(f"table and violations: {write_summary(out, seed, tried)}")
    _show(tried, json)
    _draw(tried, out)
    failed = violated(tried)
    say(f"{len(tried)} injections, {len(failed)} violations")
    for outcome in failed[:SHOWN]:
        say(f"{outcome.strike}:{outcome.index} ({outcome.manoeuvre}): {words(outcome.violations)}")
    return 1 if failed else 0


def _play_again(text: str, seed: int, json: bool | None) -> int:
    """One injection in this process, and everything that the daemon says of it."""
    import msgspec

    from daemon.campaigns.faults.plan import injection_of
    from daemon.campaigns.faults.points import try_one

    injection = injection_of(text)
    course = try_one(injection, seed)
    outcome = course.outcome
    if outcome is None:
        remedy = "the results have those that can be: the index counts frames, or control cycles"
        raise UsageError(f"{injection} strikes nothing", value=text, remedy=remedy)
    for event in course.events:
        if event["time_s"] >= outcome.at_s:
            say(f"{event['time_s']:.3f} s {event['source']}: {event['message']}")
    show(plain(msgspec.to_builtins(outcome)), json=json)
    return 1 if outcome.violations else 0


def _show(tried: Iterable[Outcome], json: bool | None) -> None:
    """The table: an object a row, or on a terminal a row a fault with a column a manoeuvre."""
    from daemon.campaigns.faults.results import table

    rows = table(tried)
    if wants_json(json):
        show(rows, json=True)
        return
    from rich.table import Table

    manoeuvres = list(dict.fromkeys(row["manoeuvre"] for row in rows))
    drawn = Table("fault", *manoeuvres, title="injections / violations / worst time to rest / recovered by")
    for fault in dict.fromkeys(row["fault"] for row in rows):
        cells = {row["manoeuvre"]: _cell(row) for row in rows if row["fault"] == fault}
        drawn.add_row(fault, *(cells.get(manoeuvre, "") for manoeuvre in manoeuvres))
    console().print(drawn)


def _cell(row: dict[str, Any]) -> str:
    rest = "-" if row["worst_rest_s"] is None else f"{row['worst_rest_s']:.2f} s"
    return f"{row['injections']} / {row['violations']} / {rest} / {words(row['recovered'])}"


def _draw(tried: Sequence[Outcome], out: Path) -> None:
    if can_draw():
        from daemon.campaigns.faults.pictures import draw_rests

        say(f"picture {draw_rests(tried, out)}")
