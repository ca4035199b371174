"""``canhelm doctor --bench``: this machine's own latency and loss."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine
from typing import TYPE_CHECKING, Any

from canhelm import protocol
from canhelm.client import Client
from canhelm.errors import CanhelmError, Refused, UsageError
from daemon.cli.output import say, words

if TYPE_CHECKING:
    from rich.console import RenderableType

SHORTEST_S = 3.0


def measure(duration_s: float, bus: str, profile: str) -> dict[str, Any]:
    """Run the daemon at growing rates; the highest safe one, and how it fared at each.

    Raises:
        UsageError: the time is too short, or the bus means nothing.
        Refused: a daemon uses this bus.
        Timeout: the robot did not boot.
    """
    if not duration_s >= SHORTEST_S:
        raise UsageError(f"--bench {duration_s:g} is too short", limit=SHORTEST_S, remedy="give 30 seconds")
    from daemon.board_bench import RATES_HZ, bench
    from daemon.runtime.clock import run_precise
    from profiles.loader import load

    robot = load(profile).profile
    simulated = bus == "simulated"
    if not simulated:
        _require_free(bus)
    say(f"{duration_s:g} s in all for {len(RATES_HZ)} rates, and the boot-ups")
    runner: Callable[[Coroutine[Any, Any, dict[str, Any]]], dict[str, Any]]
    runner = run_precise if simulated else asyncio.run
    return runner(bench(robot, bus, duration_s, say))


def _require_free(bus: str) -> None:
    """Raise Refused where a daemon that answers uses this bus."""
    for path in protocol.find_sockets():
        try:
            with Client(str(path)) as client:
                status = client.status()
        except CanhelmError:
            continue
        name = str((status.get("bus") or {}).get("name"))
        if name == bus.partition(":")[2]:
            message = f"the daemon of {status.get('robot')} uses {name}"
            raise Refused(message, remedy="stop it first; or leave --bus out: the bench then simulates its network")


def table(result: dict[str, Any]) -> RenderableType:
    """The figures for a terminal."""
    from rich.table import Table

    highest = result["highest_safe_hz"]
    told = f"highest safe rate {highest:g} Hz" if highest else "not even the lowest rate is safe"
    heads = ("rate [Hz]", "cycles", "late", "worst jitter [ms]", "latency [ms]", "worst latency [ms]", "lost frames")
    grid = Table(*heads, "safe", title=f"{told}, {result['bus']} network", box=None, header_style="bold")
    for rate in result["rates"]:
        grid.add_row(*(words(value) for value in rate.values()))
    return grid
