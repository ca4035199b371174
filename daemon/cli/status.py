"""``canhelm status``."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from daemon.cli.options import DEFAULT, Options
from daemon.cli.output import show, words

if TYPE_CHECKING:
    from rich.console import RenderableType
    from rich.table import Table

COLUMNS = ("node", "name", "device", "node_state", "state", "velocity_rpm", "speed_m_s", "current_a", "heading_deg")
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

    parts: list[RenderableType] = [_headline(data), _nodes(data.get("nodes") or ())]
    parts += [
        _line(title, data[title]) for title in ("brakes", "vehicle", "motions", "cycle", "bus") if data.get(title)
    ]
    parts += [_event(event) for event in list(data.get("events") or ())[-SHOWN_EVENTS:]]
    return Group(*parts)


def _headline(data: Mapping[str, Any]) -> RenderableType:
    from rich.text import Text

    state = str(data.get("state"))
    line = Text.assemble(str(data.get("robot")), "  ", (state, f"bold {_colour(state)}"))
    if data.get("message"):
        line.append(f"  {data['message']}")
    return line


def _colour(state: str) -> str:
    if state in SEVERE:
        return "red"
    return "yellow" if state in BUSY else "green"


def _nodes(nodes: Any) -> Table:
    from rich.table import Table
    from rich.text import Text

    shown = [column for column in COLUMNS if any(column in node for node in nodes)]
    grid = Table(*shown, "status", box=None, header_style="bold", pad_edge=False)
    for node in nodes:
        cells = [Text(words(node.get(column)), _state_style(column, node)) for column in shown]
        grid.add_row(*cells, Text(_sentence(node)))
    return grid


def _state_style(column: str, node: Mapping[str, Any]) -> str:
    return _colour(str(node.get(column))) if column in ("state", "node_state") else ""


def _sentence(node: Mapping[str, Any]) -> str:
    fault = node.get("fault")
    if isinstance(fault, Mapping):
        return f"{fault.get('message', '')} - {fault.get('remedy', '')}".rstrip(" -")
    return str(fault or node.get("status") or "")


def _line(title: str, value: Any) -> RenderableType:
    from rich.text import Text

    items = value if isinstance(value, list) else [value]
    return Text.assemble((f"{title}: ", "bold"), "; ".join(words(item) for item in items))


def _event(event: Mapping[str, Any]) -> RenderableType:
    from rich.text import Text

    remedy = f" - {event['remedy']}" if event.get("remedy") else ""
    when = words(event.get("time_s"), digits=7)
    severity = str(event.get("severity"))
    return Text.assemble(
        f"{when} s  ", (severity, _colour(severity)), f"  {event.get('source')}: {event.get('message')}{remedy}"
    )
