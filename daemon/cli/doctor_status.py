"""The doctor's look at a daemon's status: vehicle, nodes, control cycle, bus, recording."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from daemon.cli.finding import Finding
from daemon.cli.own_profile import is_own

WANTED_BUFFER = 1000
"""Frames that the kernel shall keep for a daemon that is late."""
RAISE_BUFFER = "sudo sysctl -w net.core.rmem_max=4194304, then restart the daemon"
LATE_SHARE, FEW_LATE = 0.001, 5
"""More late cycles than this share of all, and than this number, are many."""
WATCHED_S = 1.0
"""How long the daemon's counters are watched: what is not counted meanwhile is over."""
STARTING = ("waiting", "booting")
"""States of a vehicle whose nodes are being configured, which a serial line has to carry beside its cycle."""
LESSER_ROLES = {"watch": "only watch and stop", "drive": "watch, drive and stop"}
"""What those who may not do everything may do."""
SLOW_LINE = 0.8
"""Share of its planned rate below which a serial line is slow."""
FASTER_LINE = "free this machine; a USB adapter needs its latency timer at 1 ms (setserial DEVICE low_latency)"


def status_findings(status: Mapping[str, Any], earlier: Mapping[str, Any]) -> Iterator[Finding]:
    """What a daemon's status tells of trouble.

    Args:
        status: how it is now.
        earlier: how it was a moment ago. What was counted before is a note, what is counted still a problem.
    """
    state = str(status.get("state"))
    stopped = state in ("fault", "estop")
    message = str(status.get("message") or state)
    sentence = message if message.startswith(state) else f"{state}: {message}"
    if stopped:
        yield Finding("vehicle", "problem", sentence, "canhelm reset")
    else:
        yield Finding("vehicle", "note" if state in STARTING else "ok", sentence)
    yield from _setup_findings(status)
    yield from _role_findings(status)
    nodes = status.get("nodes") or ()
    for node in nodes:
        yield _node_finding(node)
    api, cycle, bus = (status.get(part) or {} for part in ("api", "cycle", "bus"))
    old_api, old_cycle, old_bus = (earlier.get(part) or {} for part in ("api", "cycle", "bus"))
    yield _cycle_finding(cycle, old_cycle, api.get("pid"))
    yield _bus_finding(bus, old_bus, starting=state in STARTING)
    yield from _wire_findings(bus, old_bus, anyone=any(node.get("node_state") == "ready" for node in nodes))
    yield from _line_findings(bus, cycle, starting=state in STARTING)
    yield from _recording_findings(status.get("recording") or {})
    yield from _runs_findings(status.get("runs") or {})
    if api.get("internal_errors"):
        found = f"{api['internal_errors']} requests failed inside the daemon"
        yield _counted("api", found, "report it with the daemon's log", goes_on=_goes_on(api, old_api))


def _setup_findings(status: Mapping[str, Any]) -> Iterator[Finding]:
    if status.get("setup") == "needed":
        yield Finding("setup", "note", "this robot was not set up, and does not drive before", "canhelm setup")
    elif status.get("setup") == "waived" and is_own(status.get("profile_file")):
        yield Finding("setup", "note", "its setup is waived: nobody has looked at its wheels", "canhelm setup")


def _role_findings(status: Mapping[str, Any]) -> Iterator[Finding]:
    role = status.get("role")
    if role == "configure":
        yield Finding("role", "ok", "you may watch, drive and configure this robot")
    elif role in LESSER_ROLES:
        mend = f"for more: {status.get('role_remedy')} (docs/rights.md)"
        yield Finding("role", "note", f"you may {LESSER_ROLES[role]} this robot", mend)


def _wire_findings(bus: Mapping[str, Any], earlier: Mapping[str, Any], *, anyone: bool) -> Iterator[Finding]:
    """What errors on the wire and doubled answers tell of bit rates and node ids."""
    errors, toggles = bus.get("error_frames", 0), bus.get("toggle_errors", 0)
    if errors > earlier.get("error_frames", 0) and not anyone:
        name, rate = bus.get("name"), bus.get("bit_rate")
        other = 500_000 if rate == 1_000_000 else 1_000_000
        mend = f"sudo ip link set {name} down; sudo ip link set {name} up type can bitrate {other}"
        found = f"{errors} error frames, and no node answers: probably another bit rate than {rate}"
        yield Finding("wire", "problem", found, f"{mend}, or another one, and network.bit_rate in the profile")
    if toggles:
        found = f"{toggles} guarding answers came twice or out of turn: two nodes may have one id"
        goes_on = toggles > earlier.get("toggle_errors", 0)
        yield _counted("node ids", found, "canhelm nodes scan", goes_on=goes_on)


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
        yield Finding("runs", "problem", str(runs["message"]), str(runs.get("remedy", "")))


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
