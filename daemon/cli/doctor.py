"""``canhelm doctor``: what is wrong with this machine, the daemon, its bus and its drives."""

from __future__ import annotations

import getpass
import grp
import os
import sys
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from canhelm import protocol
from canhelm.client import Client
from canhelm.errors import CanhelmError
from daemon.cli.options import DEFAULT, Options
from daemon.cli.output import say, show
from drivers.bus.can_link import CanLink, read_link

if TYPE_CHECKING:
    from rich.table import Table

NETWORK_DEVICES = Path("/sys/class/net")
ARPHRD_CAN = "280"
IFF_UP = 1
WANTED_QUEUE = 100
"""Frames; the kernel's default of 10 is less than one control cycle of a robot sends."""
RESTART_MS = 100
"""Delay after which a controller that went bus-off tries again."""
WANTED_BUFFER = 1000
"""Frames that the kernel shall keep for a daemon that is late."""
RAISE_BUFFER = "sudo sysctl -w net.core.rmem_max=4194304, then restart the daemon"
LATE_SHARE, FEW_LATE = 0.001, 5
"""More late cycles than this share of all, and than this number, are many."""
WATCHED_S = 1.0
"""How long the daemon's counters are watched: what is not counted meanwhile is over."""
STARTING = ("waiting", "booting")
"""States of a vehicle whose nodes are being configured, which a serial line has to carry beside its cycle."""
SLOW_LINE = 0.8
"""Share of its planned rate below which a serial line is slow."""
FASTER_LINE = "free this machine; a USB adapter needs its latency timer at 1 ms (setserial DEVICE low_latency)"
OLDEST_PYTHON = (3, 11)
STYLES = {"ok": "green", "note": "yellow", "problem": "red"}


@dataclass(frozen=True, slots=True)
class Finding:
    """One thing that was looked at.

    Attributes:
        check: what was looked at.
        verdict: ``problem`` makes the command's exit code 1.
        finding: what was found.
        mend: the line that mends it; empty where there is nothing to mend.
    """

    check: str
    verdict: Literal["ok", "note", "problem"]
    finding: str
    mend: str = ""


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
        Measure for so many seconds which rate of control cycles this machine keeps, instead of looking for problems.
    bus: str
        Where to measure: a robot's bus, without a daemon; the default simulates one in this process.
    profile: str
        The robot to measure with.
    """
    if bench is not None:
        return _bench(bench, bus, profile, options)
    findings = [*machine_findings(), *interface_findings(NETWORK_DEVICES), *_daemon_findings(options)]
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


# -- this machine -----------------------------------------------------------------------------------------------------


def machine_findings() -> Iterator[Finding]:
    """Python and the group that may use the daemon's socket."""
    version = ".".join(str(part) for part in sys.version_info[:3])
    fits = sys.version_info >= OLDEST_PYTHON
    yield Finding("python", "ok" if fits else "problem", version, "" if fits else "install Python 3.11 or newer")
    try:
        members = grp.getgrnam("canhelm")
    except KeyError:
        yield Finding(
            "group", "note", "there is no group canhelm: sockets stay with their user", "sudo groupadd canhelm"
        )
        return
    user = getpass.getuser()
    if user in members.gr_mem or os.getuid() == 0 or members.gr_gid in os.getgroups():
        yield Finding("group", "ok", f"{user} may use daemons of the group canhelm")
    else:
        yield Finding("group", "note", f"{user} is not in the group canhelm", f"sudo usermod -aG canhelm {user}")


def interface_findings(devices: Path) -> Iterator[Finding]:
    """The CAN interfaces that the kernel lists.

    Args:
        devices: ``/sys/class/net``.
    """
    names = [path.name for path in sorted(devices.glob("*")) if _read(path / "type") == ARPHRD_CAN]
    if not names:
        mend = "plug in an adapter, or: sudo modprobe vcan && sudo ip link add vcan0 type vcan"
        yield Finding("can", "note", "no CAN interface; the simulated bus needs none", mend)
    for name in names:
        yield interface_finding(name, devices / name, read_link(name))


def interface_finding(name: str, folder: Path, link: CanLink) -> Finding:
    """One CAN interface: up, not bus-off, and with a queue that holds a cycle's frames.

    Args:
        name: of the interface.
        folder: of its attributes.
        link: what the kernel tells of it.
    """
    rate, state = link.bit_rate, link.state
    queue = int(_read(folder / "tx_queue_len") or 0)
    shown = f"{rate} bit/s, {state or 'state unknown'}, queue of {queue}" if rate else f"queue of {queue}"
    if not int(_read(folder / "flags") or "0", 16) & IFF_UP:
        virtual = rate is None and name.startswith("vcan")
        set_up = "" if virtual else f" type can bitrate {rate or 1000000} restart-ms {RESTART_MS}"
        return Finding(name, "problem", f"down, {shown}", f"sudo ip link set {name} up{set_up}")
    if state == "BUS-OFF":
        mend = f"check cable, termination and bit rate, then: sudo ip link set {name} down; sudo ip link set {name} up"
        return Finding(name, "problem", shown, mend)
    if state in ("ERROR-PASSIVE", "ERROR-WARNING"):
        return Finding(name, "note", shown, "check cable, termination, bit rate, and that a node has power")
    if queue < WANTED_QUEUE:
        return Finding(name, "note", shown, f"sudo ip link set {name} txqueuelen {WANTED_QUEUE}")
    if rate and link.restart_ms == 0:
        mend = f"{name} type can restart-ms {RESTART_MS}; sudo ip link set {name} up"
        mend = f"sudo ip link set {name} down; sudo ip link set {mend}"
        return Finding(name, "note", f"up, {shown}, stays bus-off once it is", mend)
    return Finding(name, "ok", f"up, {shown}")


def bit_rate_findings(bus: Mapping[str, Any], link: CanLink) -> Iterator[Finding]:
    """Whether the interface has the bit rate that the daemon's profile gives.

    Args:
        bus: of the daemon's status.
        link: what the kernel tells of that interface.
    """
    name, wanted, rate = bus.get("name"), bus.get("bit_rate"), link.bit_rate
    if rate and rate != wanted:
        set_up = f"sudo ip link set {name} up type can bitrate {wanted} restart-ms {RESTART_MS}"
        mend = f"sudo ip link set {name} down; {set_up}"
        yield Finding("bit rate", "problem", f"{name} has {rate} bit/s, the profile says {wanted}", mend)


def _read(path: Path) -> str:
    try:
        return path.read_text().strip()
    except OSError:
        return ""


# -- the daemon -------------------------------------------------------------------------------------------------------


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
                yield from bit_rate_findings(bus, read_link(str(bus.get("name"))))
        except CanhelmError as error:
            yield Finding("daemon", "problem", error.message, error.remedy or "")


def _next_status(client: Client) -> Mapping[str, Any]:
    """The status after :data:`WATCHED_S`."""
    return next(params for method, params in client.notifications(1.0 / WATCHED_S) if method == "status")


def status_findings(status: Mapping[str, Any], earlier: Mapping[str, Any]) -> Iterator[Finding]:
    """What a daemon's status tells of trouble.

    Args:
        status: how it is now.
        earlier: how it was a moment ago. What was counted before is a note, what is counted still a problem.
    """
    state = str(status.get("state"))
    stopped = state in ("fault", "estop")
    sentence = f"{state}: {status['message']}" if status.get("message") else state
    yield Finding("vehicle", "problem" if stopped else "ok", sentence, "canhelm reset" if stopped else "")
    for node in status.get("nodes") or ():
        yield _node_finding(node)
    api, cycle, bus = (status.get(part) or {} for part in ("api", "cycle", "bus"))
    old_api, old_cycle, old_bus = (earlier.get(part) or {} for part in ("api", "cycle", "bus"))
    yield _cycle_finding(cycle, old_cycle, api.get("pid"))
    yield _bus_finding(bus, old_bus, starting=state in STARTING)
    yield from _line_findings(bus, cycle, starting=state in STARTING)
    yield from _recording_findings(status.get("recording") or {})
    yield from _runs_findings(status.get("runs") or {})
    if api.get("internal_errors"):
        found = f"{api['internal_errors']} requests failed inside the daemon"
        yield _counted("api", found, "report it with the daemon's log", goes_on=_goes_on(api, old_api))


def _counted(check: str, found: str, mend: str, *, goes_on: bool) -> Finding:
    """Something that was counted: a problem while it goes on, a note when it is over."""
    if goes_on:
        return Finding(check, "problem", found, mend)
    return Finding(check, "note", f"{found}; none in the last {WATCHED_S:g} s", mend)


def _goes_on(counters: Mapping[str, Any], earlier: Mapping[str, Any]) -> bool:
    """Whether anything in ``counters`` that counts trouble has grown."""
    return any(counters[key] > earlier.get(key, 0) for key in counters if _counts_trouble(key, counters[key]))


def _counts_trouble(key: str, value: Any) -> bool:
    return isinstance(value, int) and bool(value) and ("drop" in key or key in ("late_cycles", "internal_errors"))


def _node_finding(node: Mapping[str, Any]) -> Finding:
    on_can = node.get("node") is not None
    name = f"node {node['node']} ({node.get('name')})" if on_can else str(node.get("name"))
    fault = node.get("fault")
    if isinstance(fault, Mapping):
        return Finding(name, "problem", str(fault.get("message")), str(fault.get("remedy") or "canhelm reset"))
    if fault:
        return Finding(name, "problem", str(fault), "canhelm reset")
    told = str(node.get("status") or node.get("node_state"))
    if node.get("node_state") == "configuring":
        return Finding(name, "note", f"is being configured: {told.removeprefix(f'{name}: ')}")
    if node.get("node_state") != "ready":
        mend = "switch motor power on, and check the cable and the node id" if on_can else "switch the NXT brick on"
        return Finding(name, "problem", told, mend)
    return Finding(name, "ok", f"{node.get('node_state')}, {node.get('state', 'reading')}")


def _recording_findings(recording: Mapping[str, Any]) -> Iterator[Finding]:
    path, lost = recording.get("path"), recording.get("lost", 0)
    if recording.get("failing"):
        found = f"the log {path} cannot be written, {lost} frames are lost"
        yield Finding("recording", "problem", found, "make room on its disk: recording goes on by itself")
    elif lost:
        yield Finding("recording", "note", f"{lost} frames are missing in the log {path}", "its disk was full")
    elif recording:
        yield Finding("recording", "ok", f"{recording.get('frames')} frames in {path}")


def _runs_findings(runs: Mapping[str, Any]) -> Iterator[Finding]:
    if runs.get("message"):
        yield Finding("runs", "problem", str(runs["message"]), "make room there, or: canhelm runs delete NUMBER")


def _cycle_finding(cycle: Mapping[str, Any], earlier: Mapping[str, Any], pid: int | None) -> Finding:
    cycles, late = cycle.get("cycles", 0), cycle.get("late_cycles", 0)
    worst_ms, period_ms = cycle.get("max_lateness_ms", 0.0), 1e3 / cycle.get("hz", 100.0)
    found = f"{late} of {cycles} control cycles were late, the worst one began {worst_ms:.1f} ms late"
    if waited_s := round(cycle.get("stood_still_s", 0.0), 1):
        found += f"; the machine kept the simulated robot and its daemon waiting for {waited_s} s"
    mend = f"give it a real-time priority: sudo chrt -f -p 50 {pid}"
    if late > max(FEW_LATE, LATE_SHARE * cycles):
        return _counted("cycle", found, mend, goes_on=_goes_on(cycle, earlier))
    if worst_ms > period_ms:
        return Finding("cycle", "note", found, mend)
    return Finding("cycle", "ok", found)


def _bus_finding(bus: Mapping[str, Any], earlier: Mapping[str, Any], *, starting: bool) -> Finding:
    if bus.get("down"):
        return Finding("bus", "problem", f"{bus.get('name')} does not work: {bus['down']}", str(bus.get("remedy", "")))
    goes_on = _goes_on(bus, earlier)
    if bus.get("dropped_overflow"):
        return _counted("bus", f"{bus['dropped_overflow']} frames came too fast for it", RAISE_BUFFER, goes_on=goes_on)
    lost = {key: value for key, value in bus.items() if _counts_trouble(key, value)}
    if lost and "planned_hz" in bus:
        told = f"the line was too slow for {sum(lost.values())} targets"
        if starting:
            return Finding("bus", "note", f"{told}; it carries the configuration of nodes meanwhile")
        return _counted("bus", told, FASTER_LINE, goes_on=goes_on)
    if lost:
        told = ", ".join(f"{key} {value}" for key, value in lost.items())
        mend = "lower the load, or look for a node that does not acknowledge"
        return _counted("bus", told, mend, goes_on=goes_on)
    load = f"load {float(bus.get('load') or 0.0):.1%}, nothing dropped"
    room = bus.get("receive_buffer_frames", WANTED_BUFFER)
    if room < WANTED_BUFFER:
        return Finding("bus", "note", f"{load}, the kernel keeps {room} frames for a daemon that is late", RAISE_BUFFER)
    return Finding("bus", "ok", load)


def _line_findings(bus: Mapping[str, Any], cycle: Mapping[str, Any], *, starting: bool) -> Iterator[Finding]:
    """What a serial line gives, where there is one, and what a cable that is pulled would mean.

    Its rate is not judged while the vehicle is starting.
    """
    if "planned_hz" not in bus:
        return
    if bus.get("line_down"):
        yield Finding(
            "serial line", "problem", str(bus["line_down"]), "plug the adapter in; it is opened again by itself"
        )
        return
    at = ", ".join(f"{hz} at {baud} baud" for baud, hz in bus["planned_hz_at_baud"].items())
    rate = f"{cycle.get('achieved_hz')} cycles a second at {bus['baud']} baud, planned {bus['planned_hz']} ({at})"
    if not starting and cycle.get("achieved_hz", 0.0) < SLOW_LINE * bus["planned_hz"]:
        found = f"{rate}: the limits of the vehicle are made for the planned rate"
        yield Finding("line rate", "problem", found, FASTER_LINE)
    if bus.get("silent_nodes"):
        nodes = ", ".join(map(str, bus["silent_nodes"]))
        yield Finding("serial line", "problem", f"{rate}; silent nodes: {nodes}", "switch their power on")
    else:
        yield Finding("serial line", "ok", f"{rate}; resynchronised {bus['resyncs']} times")
    stop = f"at full speed the wheels rest {bus['silent_line_stop_s']} s and {bus['silent_line_stop_m']} m after it"
    if bus.get("silent_line_turn_deg") is not None:
        stop += f", a pair that is being turned {bus['silent_line_turn_deg']} degrees"
    yield Finding("pulled cable", "note", stop, f"the speed limit is {bus['speed_limit_m_s']} m/s; see docs/rs232.md")
