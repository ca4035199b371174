"""What the numbers of a run say about the robot."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import groupby
from statistics import fmean, median
from typing import Any

import msgspec

from daemon.runs.table import Table

EQUAL_M_S = 1e-3
"""Wheels whose commanded speeds differ less run side by side: nothing but their sizes sets them against each other."""
MOVING_M_S = 0.05
SETTLING_S = 0.5
"""After the begin of equal speeds, until currents are steady."""
SHORTEST_S = 0.5
OUTLIER_SHARE = 0.25
"""Of the continuous current, by which a wheel's current stands out from the others'."""
FEWEST_WHEELS = 3
CURRENT_LIMITS = ("continuous_current_a", "output_current_a")
"""Of a drive in the profile; it cuts the current off at the second at once, and at the first after a while."""
AT_LIMIT_SHARE = 0.01
"""Of a current limit, by which a current that is held there is measured beside it."""
HELD_S = 0.1
"""A current that passes by a limit is away sooner."""


class _Profile(msgspec.Struct):
    """As much of a profile as is looked at here."""

    drives: dict[str, dict[str, Any]] = {}


def side_by_side(table: Table) -> list[int]:
    """Rows in which all wheels have rolled at one constant commanded speed for a while."""
    commanded = list(table.of("commanded_m_s").values())
    rows: list[int] = []
    since_s, before = table.time_s[0], 0.0
    for row, time_s in enumerate(table.time_s):
        speeds = [column[row] for column in commanded]
        equal = max(speeds) - min(speeds) < EQUAL_M_S and abs(speeds[0]) > MOVING_M_S
        if not equal or abs(speeds[0] - before) > EQUAL_M_S:
            since_s = time_s
        elif time_s - since_s > SETTLING_S:
            rows.append(row)
        before = speeds[0]
    return rows


def mean_currents_a(table: Table, rows: list[int]) -> dict[str, float]:
    """Mean current of each wheel, positive where the motor pushes into the direction of travel."""
    commanded = table.of("commanded_m_s")
    return {
        name: fmean(column[row] if commanded[name][row] > 0 else -column[row] for row in rows)
        for name, column in table.of("current_a").items()
    }


def read_signs(table: Table, profile: Mapping[str, Any]) -> list[str]:
    """What stands out, one sentence each.

    Wheels that roll side by side on one body share the load. A wheel that is larger than the profile says is turned too
    fast for the body: it pushes, and the others hold it back; one that is too small is dragged. The drive keeps the
    speed of its motor either way, so that it is the currents that tell.

    Args:
        table: of the run.
        profile: the run's own.
    """
    rows = side_by_side(table)
    if len(table.wheels) < FEWEST_WHEELS or not rows:
        return []
    if table.time_s[rows[-1]] - table.time_s[rows[0]] < SHORTEST_S:
        return []
    currents = mean_currents_a(table, rows)
    away = {name: current - _others(currents, name) for name, current in currents.items()}
    name = max(away, key=lambda wheel: abs(away[wheel]))
    continuous_a = _current_limits(profile, name).get("continuous_current_a")
    if continuous_a is None or abs(away[name]) < OUTLIER_SHARE * continuous_a:
        return []
    does, size = ("pushes", "larger") if away[name] > 0 else ("is dragged", "smaller")
    others = sorted(current for wheel, current in currents.items() if wheel != name)
    return [
        f"{name} {does}: {currents[name]:+.2f} A, the other wheels {others[0]:+.2f} to {others[-1]:+.2f} A at the same "
        f"speed; its wheel is {size} than the profile's wheel_radius_m says, or its gear ratio or encoder pulses are "
        f"wrong"
    ]


def currents_at_limit(table: Table, profile: Mapping[str, Any]) -> dict[str, list[float]]:
    """When a drive held its motor's current at one of its limits, by motor and limit (``rear_left at 5 A``) [s].

    Args:
        table: of the run.
        profile: the run's own; motors that have no such limit in it are left out.
    """
    times: dict[str, list[float]] = {}
    for name, column in table.of("current_a").items():
        for limit_a in _current_limits(profile, name).values():
            if when := _held(table.time_s, column, limit_a):
                times[f"{name} at {limit_a:g} A"] = when
    return times


def _current_limits(profile: Mapping[str, Any], name: str) -> dict[str, float]:
    """Those of :data:`CURRENT_LIMITS` that a drive has in a profile, which may be damaged [A]."""
    try:
        drive = msgspec.convert(profile, _Profile).drives.get(name, {})
        return {key: msgspec.convert(drive[key], float) for key in CURRENT_LIMITS if key in drive}
    except msgspec.ValidationError:
        return {}


def _held(time_s: Sequence[float], current_a: Sequence[float], limit_a: float) -> list[float]:
    held: list[float] = []
    near = [abs(abs(current) - limit_a) <= AT_LIMIT_SHARE * limit_a for current in current_a]
    for at_limit, rows in groupby(zip(time_s, near, strict=True), key=lambda row: row[1]):
        times = [time for time, _ in rows]
        if at_limit and times[-1] - times[0] >= HELD_S:
            held.extend(times)
    return held


def _others(currents: Mapping[str, float], name: str) -> float:
    return median(current for wheel, current in currents.items() if wheel != name)
