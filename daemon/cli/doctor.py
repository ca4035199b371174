"""``canhelm doctor``: what is wrong with this machine, the daemon, its bus and its drives."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from canhelm import protocol
from canhelm.client import Client
from canhelm.errors import CanhelmError
from daemon.cli.doctor_machine import (
    NETWORK_DEVICES,
    USB_DEVICES,
    adapter_findings,
    bit_rate_findings,
    interface_findings,
    kernel_has_can,
    machine_findings,
    name_findings,
)
from daemon.cli.doctor_status import WATCHED_S, status_findings
from daemon.cli.finding import Finding
from daemon.cli.options import DEFAULT, Options
from daemon.cli.output import say, show
from drivers.bus.can_link import read_link

if TYPE_CHECKING:
    from rich.table import Table

STYLES = {"ok": "green", "note": "yellow", "problem": "red"}


def doctor(
    *,
    bundle: Path | None = None,
    bench: float | None = None,
    bus: str = "simulated",
    profile: str = "max2d",
    options: Options = DEFAULT,
) -> int:
    """What is wrong with this machine, the daemon, its bus and its drives, each with the line that mends it.

    Works without a daemon. The exit code is 1 if there is a problem.

    Example: `canhelm doctor --bundle problem.zip`

    Parameters
    ----------
    bundle: Path
        Write all that a report of a problem needs into this new ZIP file: versions, findings, status, profile, journal
        and the last run.
    bench: float
        Measure for so many seconds in all which rate of control cycles this machine keeps; looks for no problems.
    bus: str
        Where to measure: a robot's bus, without a daemon; the default simulates one in this process.
    profile: str
        The robot to measure with.
    """
    if bench is not None:
        return _bench(bench, bus, profile, options)
    interfaces = interface_findings(NETWORK_DEVICES, has_can=kernel_has_can())
    findings = [*machine_findings(), *interfaces, *adapter_findings(USB_DEVICES), *_daemon_findings(options)]
    rows = [asdict(finding) for finding in findings]
    show(rows, _table, options.json)
    if bundle is not None:
        from daemon.cli.bundle import pack

        say(f"{bundle} holds {', '.join(pack(bundle, rows, options))}; look through it before you send it")
    return int(any(finding.verdict == "problem" for finding in findings))


def _bench(duration_s: float, bus: str, profile: str, options: Options) -> int:
    """Measure; the exit code is 1 where not even the lowest rate is safe."""
    from daemon.cli import bench

    result = bench.measure(duration_s, bus, profile)
    show(result, bench.table, options.json)
    return int(result["highest_safe_hz"] is None)


def _table(rows: list[Mapping[str, str]]) -> Table:
    from rich.table import Table
    from rich.text import Text

    grid = Table("check", "verdict", "finding", "what mends it", box=None, header_style="bold", pad_edge=False)
    for row in rows:
        verdict = Text(row["verdict"], STYLES[row["verdict"]])
        grid.add_row(row["check"], verdict, Text(row["finding"]), Text(row["mend"]))
    return grid


def _daemon_findings(options: Options) -> Iterator[Finding]:
    chosen = options.socket or options.robot
    live = protocol.find_sockets()
    if not chosen and not live:
        start = "canhelm run --simulate --profile max2d, or: systemctl start canhelm@NAME"
        yield Finding("daemon", "note", "no daemon is running", start)
        return
    for path in [None] if chosen else live:
        try:
            with Client(path or options.socket, options.robot) as client:
                yield Finding("daemon", "ok", f"answers on {client.path}")
                earlier = client.status()
                status = _next_status(client)
                yield from status_findings(status, earlier)
                bus = status.get("bus") or {}
                yield from name_findings(bus, NETWORK_DEVICES)
                yield from bit_rate_findings(bus, read_link(str(bus.get("name"))))
        except CanhelmError as error:
            yield Finding("daemon", "problem", error.message, error.remedy or "")


def _next_status(client: Client) -> Mapping[str, Any]:
    """The status after :data:`WATCHED_S`."""
    return next(params for method, params in client.notifications(1.0 / WATCHED_S) if method == "status")
