"""What a campaign found: beside the thesis' bounds and Table B.1, by law, by steering rate, by c_p and c_v."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from statistics import mean
from typing import Any, Final

from daemon.campaigns.cases import LAWS, SPEED_M_S, STEERING_RATE_DEG_S, Case, Outcome, State, Way
from daemon.campaigns.results import Result

Row = dict[str, Any]


@dataclass(frozen=True, slots=True)
class PublishedBound:
    """One row of the thesis: sections 6.2.1 and 6.2.2.

    Attributes:
        path: line or circle.
        test: the initial errors in the thesis' words.
        states: those of ours that it is compared with; of several the worst counts.
        position_m, heading_deg, bending_deg: largest errors that the thesis gives.
    """

    path: Way
    test: str
    states: tuple[State, ...]
    position_m: float
    heading_deg: float
    bending_deg: float


def _position(path: Way, size_m: float, *bound: float) -> PublishedBound:
    states = (State(path, position_m=size_m), State(path, position_m=-size_m))
    return PublishedBound(path, f"position ±{size_m:g} m", states, *bound)


def _heading(path: Way, size_deg: float, *bound: float) -> PublishedBound:
    states = (State(path, heading_deg=size_deg), State(path, heading_deg=-size_deg))
    return PublishedBound(path, f"heading ±{size_deg:g}°", states, *bound)


def _bending(path: Way, size_deg: float, *bound: float) -> PublishedBound:
    states = (State(path, bending_deg=size_deg), State(path, bending_deg=-size_deg))
    return PublishedBound(path, f"bending angle ±{size_deg:g}°", states, *bound)


def _combined(position_m: float, heading_deg: float, *bound: float) -> PublishedBound:
    """A row of Table B.1, whose headings have the other sign than ours (docs/campaigns.md)."""
    test = f"B.1: {position_m:+g} m, {heading_deg:+g}°"
    return PublishedBound("circle", test, (State("circle", position_m, -heading_deg),), *bound)


BOUNDS: Final = (
    _position("line", 0.1, 0.1, 11, 21),
    _position("circle", 0.1, 0.1, 11, 14),
    _position("line", 0.2, 0.2, 19, 38),
    _position("circle", 0.2, 0.2, 19, 30),
    _heading("line", 5, 0.09, 8, 31),
    _heading("circle", 5, 0.078, 7, 20),
    _heading("line", 10, 0.14, 10, 42),
    _heading("circle", 10, 0.07, 10, 33),
    _bending("line", 5, 0.0, 1, 5),
    _bending("circle", 5, 0.02, 5, 6),
    _bending("line", 10, 0.012, 1, 10),
    _bending("circle", 10, 0.02, 3, 10),
    _combined(0.1, 10, 0.042, 14, 31),
    _combined(-0.1, 10, 0.2, 25, 49),
    _combined(0.2, 10, 0.14, 14, 14),
    _combined(-0.2, 10, 0.26, 29, 50),
    _combined(0.1, -10, 0.16, 16, 18),
    _combined(-0.1, -10, 0.1, 10, 14),
    _combined(0.2, -10, 0.28, 22, 24),
    _combined(-0.2, -10, 0.2, 17, 18),
)
"""Section 6.2 and Table B.1."""


def figures(outcomes: Iterable[Outcome]) -> Row:
    """Failures, way until settled, and largest errors of some runs."""
    runs = list(outcomes)
    settled = [run.settle_m for run in runs if run.settle_m is not None]
    return {
        "runs": len(runs),
        "failed": len(runs) - len(settled),
        "mean_settle_m": mean(settled) if settled else None,
        "worst_settle_m": max(settled) if len(settled) == len(runs) else None,
        "position_m": max(run.worst_position_m for run in runs),
        "heading_deg": max(run.worst_heading_deg for run in runs),
        "bending_deg": max(run.worst_bending_deg for run in runs),
    }


def steering_name(rate_deg_s: float | None) -> str:
    """A steering's rate in words."""
    return "ideal" if rate_deg_s is None else f"{rate_deg_s:g}°/s"


def bounds_table(finished: Mapping[Case, Outcome]) -> list[Row]:
    """The thesis' bounds, and ours for each law and steering."""
    columns: dict[tuple[str, float | None], dict[State, Outcome]] = {}
    for case, out in finished.items():
        if case.part == "thesis":
            columns.setdefault((case.law, case.rate_deg_s), {})[case.state] = out
    rows: list[Row] = []
    for bound in BOUNDS:
        published = {key: getattr(bound, key) for key in ("position_m", "heading_deg", "bending_deg")}
        row: Row = {"path": bound.path, "test": bound.test, "published": published}
        for (law, rate), by_state in columns.items():
            row[f"{law}, {steering_name(rate)}"] = figures(by_state[state] for state in bound.states)
        rows.append(row)
    return rows


def law_table(finished: Mapping[Case, Outcome]) -> list[Row]:
    """One row a part, law and steering; at the end the random states that both laws settle."""
    groups: dict[tuple[str, str, float | None], list[Outcome]] = {}
    for case, out in finished.items():
        if case.part != "rates":
            groups.setdefault((case.part, case.law, case.rate_deg_s), []).append(out)
    rows = [_law_row(*group, runs) for group, runs in groups.items()]
    for rate in dict.fromkeys(rate for part, _, rate in groups if part.startswith("random")):
        rows += _settled_by_both(finished, rate)
    return rows


def _law_row(states: str, law: str, rate_deg_s: float | None, runs: Sequence[Outcome]) -> Row:
    return {"states": states, "law": law, "steering": steering_name(rate_deg_s), **figures(runs)}


def _settled_by_both(finished: Mapping[Case, Outcome], rate_deg_s: float | None) -> list[Row]:
    by_state: dict[State, dict[str, Outcome]] = {}
    for case, out in finished.items():
        if case.part.startswith("random") and case.rate_deg_s == rate_deg_s:
            by_state.setdefault(case.state, {})[case.law] = out
    both = [pair for pair in by_state.values() if all(out.settle_m is not None for out in pair.values())]
    if not both:
        return []
    return [_law_row("settled by both", law, rate_deg_s, [pair[law] for pair in both]) for law in LAWS]


def rates_table(finished: Mapping[Case, Outcome]) -> list[Row]:
    """Failures of the 40 states by the steering's rate a metre of way."""
    rows: dict[float, Row] = {}
    for case, out in finished.items():
        if case.part == "rates" and case.rate_deg_s is not None:
            rate = round(case.rate_deg_s / SPEED_M_S)
            row = rows.setdefault(rate, {"rate_deg_m": rate, **dict.fromkeys(LAWS, 0), "of": 0})
            row[case.law] += out.settle_m is None
            row["of"] += case.law == LAWS[0]
    return [rows[rate] for rate in sorted(rows)]


def bending_table(finished: Mapping[Case, Outcome]) -> list[Row]:
    """c_p: way and overshoot of the thesis' two tests."""
    cases = [case for case in finished if case.part == "c_p"]
    cases.sort(key=lambda case: (case.rate_deg_s or 0.0, case.target_deg, case.bending_gain))
    return [
        {
            "bending_deg": f"{case.bending_deg:g} to {case.target_deg:g}",
            "steering": steering_name(case.rate_deg_s),
            "c_p": case.bending_gain,
            "reached_m": finished[case].settle_m,
            "overshoot_deg": finished[case].overshoot_deg,
        }
        for case in cases
    ]


def look_ahead_table(finished: Mapping[Case, Outcome]) -> list[Row]:
    """c_v: way and overshoot from half a metre beside the line."""
    cases = [case for case in finished if case.part == "c_v"]
    cases.sort(key=lambda case: (case.rate_deg_s or 0.0, case.look_ahead_m))
    return [
        {
            "steering": steering_name(case.rate_deg_s),
            "c_v_m": case.look_ahead_m,
            "settle_m": finished[case].settle_m,
            "overshoot_m": finished[case].overshoot_m,
            "bending_deg": finished[case].worst_bending_deg,
        }
        for case in cases
    ]


def _pair(result: Result) -> tuple[float, float, float]:
    case = result[0]
    return (case.rate_deg_s or 0.0, case.bending_gain, case.look_ahead_m)


def grid_table(finished: Mapping[Case, Outcome]) -> list[Row]:
    """The 40 states with each pair of c_p and c_v."""
    results = sorted(((case, out) for case, out in finished.items() if case.part == "grid"), key=_pair)
    rows: list[Row] = []
    for (rate, gain, ahead), group in groupby(results, _pair):
        key = {"steering": steering_name(rate or None), "c_p": gain, "c_v_m": ahead}
        rows.append(key | figures(out for _, out in group))
    return rows


def best_tunings(finished: Mapping[Case, Outcome]) -> list[Row]:
    """Of each steering, the pair with the fewest failures and then the shortest mean way, and the thesis' pair."""
    rows: list[Row] = []
    for steering in (steering_name(None), steering_name(STEERING_RATE_DEG_S)):
        grid = [row for row in grid_table(finished) if row["steering"] == steering]
        best = min(grid, key=lambda row: (row["failed"], row["mean_settle_m"] or 0.0))
        rows += [best, *(row for row in grid if (row["c_p"], row["c_v_m"]) == (4.0, 0.425) and row is not best)]
    return rows
