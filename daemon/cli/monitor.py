"""``canhelm monitor``."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from canhelm.client import Client
from daemon.cli.options import DEFAULT, Options
from daemon.cli.output import console, show, wants_json
from daemon.cli.status import table


def monitor(*, rate: float = 5.0, options: Options = DEFAULT) -> None:
    """Live screen of the robot; JSON lines where the output is no terminal. Ctrl-C ends it, the robot goes on.

    Example: `canhelm monitor --rate 10`

    Parameters
    ----------
    rate: float
        Samples a second.
    """
    with options.client() as client:
        if wants_json(options.json):
            for status in _statuses(client, rate):
                show(status, json=True)
        else:
            _live(client, rate)


def _statuses(client: Client, rate: float) -> Iterator[dict[str, Any]]:
    yield client.status()
    for method, params in client.notifications(rate):
        if method == "status":
            yield params


def _live(client: Client, rate: float) -> None:
    from rich.live import Live

    with Live(console=console(), screen=True, auto_refresh=False) as screen:
        try:
            for status in _statuses(client, rate):
                screen.update(table(status), refresh=True)
        except KeyboardInterrupt:
            return
