"""``canhelm status``."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from daemon.cli.options import DEFAULT, Options
from daemon.cli.output import show, words
from daemon.cli.own_profile import is_own

if TYPE_CHECKING:
    from rich.console import Console, ConsoleOptions, RenderableType, RenderResult
    from rich.table import Table

COLUMNS = {
    "node": "node",
    "name": "name",
    "device": "device",
    "state": "state",
    "velocity_rpm": "rpm",
    "speed_m_s": "m/s",
    "current_a": "A",
    "heading_deg": "heading °",
}
"""Fields of a node that are shown, and the heads of their columns."""
NARROW = 80
"""A terminal with fewer columns than this does without the devices' types."""
HIDDEN = ("type", "methods", "name", "bit_rate", "pose", "wheels_deg", "icr", "following")
"""Fields of a section that do not change, or are told elsewhere in it, and are left to JSON."""
TOLD_AT_ZERO = ("section", "piece")
"""Fields that are numbers of something, not counters."""
BUS_GROUPS = {
    "line": ("baud", "line_utilisation", "own_idle_share", "exchanges"),
    "line plan": ("planned_", "speed_limit_", "silent_line_"),
    "bus trouble": (
        "dropped_", "error_frames", "down", "remedy", "line_down", "silent_nodes", "resyncs", "line_retries",
        "unknown", "malformed", "foreign", "late_answers", "toggle_errors", "nodes_lost", "internal_errors",
    ),
}  # fmt: skip
"""Fields of the bus that have a line of their own, by how they begin."""
SEVERE = ("fault", "estop", "refused", "absent", "error")
BUSY = ("active", "stopping", "waiting", "booting", "configuring", "warning")
SHOWN_EVENTS = 5


def status(
    *,
    follow: Annotated[bool, Parameter(negative=())] = False,
    rate: float = 5.0,
    options: Options = DEFAULT,
) -> None:
    """State of the vehicle, its nodes, brakes, bus and control cycle at a glance.

    Example: `canhelm status --json | jq .state`

    Parameters
    ----------
    follow: bool
        Go on, one JSON object a line.
    rate: float
        Samples a second with --follow.
    """
    with options.client() as client:
        if not follow:
            show(client.status(), table, options.json)
            return
        for method, params in client.notifications(rate):
            if method == "status":
                show(params, json=True)


def table(data: Mapping[str, Any]) -> RenderableType:
    """The status for a terminal."""
    from rich.console import Group

    nodes = data.get("nodes") or ()
    parts: list[RenderableType] = [_headline(data), _NodeTable(nodes), *_troubles(nodes)]
    if data.get("setup") == "needed":
        parts.append("the robot was not set up: `canhelm setup`")
    elif data.get("setup") == "waived" and is_own(data.get("profile_file")):
        parts.append("its setup is waived: nobody has looked at wheels, encoders and brakes (`canhelm setup`)")
    parts += [_found(row) for row in data.get("found") or ()]
    parts.append(_brakes(data.get("brakes") or ()))
    parts += [_section(f"brick {brick['name']}", brick) for brick in data.get("bricks") or ()]
    sections = {title: data.get(title) for title in ("vehicle", "localisation", "motions", "cycle")}
    sections |= {**_bus_groups(data.get("bus") or {}), "recording": data.get("recording")}
    parts += [_section(title, value) for title, value in sections.items() if value]
    if data.get("holder"):
        parts.append(f"held by {data['holder'].get('client')}")
    parts += [_event(event) for event in list(data.get("events") or ())[-SHOWN_EVENTS:]]
    return Group(*parts)


def _headline(data: Mapping[str, Any]) -> RenderableType:
    from rich.text import Text

    state = str(data.get("state"))
    line = Text.assemble(str(data.get("robot")), "  ", (state, f"bold {_colour(state)}"))
    if data.get("message"):
        line.append(f"  {data['message']}")
    if data.get("role", "configure") != "configure":
        line.append(f"  (your role: {data['role']})", "dim")
    return line


def _colour(state: str) -> str:
    if state in SEVERE:
        return "red"
    return "yellow" if state in BUSY else "green"


@dataclass(frozen=True, slots=True)
class _NodeTable:
    """The nodes in a table that fits the terminal."""

    nodes: Sequence[Mapping[str, Any]]

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        yield _nodes(self.nodes, narrow=options.max_width < NARROW)


def _nodes(nodes: Sequence[Mapping[str, Any]], *, narrow: bool) -> Table:
    from rich.table import Table
    from rich.text import Text

    shown = [column for column in COLUMNS if any(column in node for node in nodes)]
    if narrow and "device" in shown:
        shown.remove("device")
    grid = Table(box=None, header_style="bold", padding=(0, 1 if narrow else 2, 0, 0))
    for column in shown:
        grid.add_column(COLUMNS[column], no_wrap=True)
    for node in nodes:
        cells = {column: words(node.get(column)) for column in shown}
        cells["state"] = _node_state(node)
        grid.add_row(*(Text(cell, _style(column, cell)) for column, cell in cells.items()))
    return grid


def _troubles(nodes: Sequence[Mapping[str, Any]]) -> list[RenderableType]:
    from rich.text import Text

    told = [(str(node.get("name")), _trouble(node)) for node in nodes]
    return [Text.assemble((f"{name}: ", "bold red"), trouble) for name, trouble in told if trouble]


def _node_state(node: Mapping[str, Any]) -> str:
    return str(node.get("state", "ready") if node.get("node_state") == "ready" else node.get("node_state"))


def _style(column: str, cell: str) -> str:
    return _colour(cell) if column == "state" else ""


def _trouble(node: Mapping[str, Any]) -> str:
    fault = node.get("fault")
    if isinstance(fault, Mapping):
        return f"{fault.get('message', '')} - {fault.get('remedy', '')}"
    return str(fault or "") or ("" if node.get("node_state") == "ready" else str(node.get("status")))


def _found(row: Mapping[str, Any]) -> RenderableType:
    """What a first look at a node without a profile has told."""
    from rich.text import Text

    told = "; ".join(str(row[key]) for key in ("device", "firmware", "state", "remark") if row.get(key))
    return Text.assemble((f"node {row.get('node')}: ", "bold"), told)


def _brakes(brakes: Sequence[Mapping[str, Any]]) -> RenderableType:
    from rich.text import Text

    told = ", ".join(f"{brake.get('name')} {brake.get('state')}" for brake in brakes)
    return Text.assemble(("brakes: ", "bold"), told or "none")


def _section(title: str, value: Any) -> RenderableType:
    from rich.text import Text

    items = value if isinstance(value, list) else [value]
    return Text.assemble((f"{title}: ", "bold"), "; ".join(words(_telling(item)) for item in items))


def _bus_groups(bus: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """What is told of the bus, by the head of its line."""
    rest = _telling(bus)
    groups = {
        title: {key: rest.pop(key) for key in list(rest) if key.startswith(beginnings)}
        for title, beginnings in BUS_GROUPS.items()
    }
    return {"bus": rest, **groups}


def _telling(item: Mapping[str, Any]) -> dict[str, Any]:
    """A section without what never changes, what is empty, and counters that stand at zero."""
    return {
        key: value
        for key, value in item.items()
        if key not in HIDDEN and (value or isinstance(value, float) or key in TOLD_AT_ZERO)
    }


def _event(event: Mapping[str, Any]) -> RenderableType:
    from rich.text import Text

    remedy = f" - {event['remedy']}" if event.get("remedy") else ""
    when = time.strftime("%H:%M:%S", time.localtime(event.get("unix_s")))
    severity = str(event.get("severity"))
    return Text.assemble(
        f"{when}  ", (severity, _colour(severity)), f"  {event.get('source')}: {event.get('message')}{remedy}"
    )
