"""What a scan of the bus says to people and programs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from drivers.bus.contract import Bus
from drivers.canopen.boot import STATE_WORDS
from drivers.canopen.codes import NmtState
from drivers.canopen.scan import FoundNode

PROFILES = {0x0191: "I/O module (CiA 401)", 0x0192: "drive (CiA 402)", 0x0196: "encoder (CiA 406)"}
"""Device profiles by the low word of the device type 0x1000."""
VENDOR_MAXON = 251
_NUMBERS = ("vendor_id", "product_code", "revision_number", "serial_number", "device_type")


def _profile(found: FoundNode) -> int:
    return found.numbers.get("device_type", 0) & 0xFFFF


FIRMWARE: tuple[tuple[tuple[int, int], Callable[[FoundNode], bool], Callable[[int], str]], ...] = (
    ((0x2003, 1), lambda found: found.numbers.get("vendor_id") == VENDOR_MAXON, lambda value: f"{value:04X}"),
    ((0x6507, 0), lambda found: _profile(found) == 0x0196, lambda value: f"{value >> 16:04X}"),
)
"""Where the firmware's version stands: object, for which nodes, and how its value is written."""


def node_entry(found: FoundNode, firmware: str) -> dict[str, Any]:
    """One node of the scan."""
    numbers = {name: f"0x{found.numbers[name]:08X}" if name in found.numbers else "" for name in _NUMBERS}
    return {
        "node": found.node,
        "name": found.name,
        "device": found.device_name or PROFILES.get(_profile(found), ""),
        "firmware": firmware,
        "state": _state(found),
        **numbers,
        "remark": _remark(found),
    }


def missing_entry(node: int, name: str) -> dict[str, Any]:
    """A node of the profile that was not heard."""
    empty = dict.fromkeys(("device", "firmware"), "")
    remark = "in the profile, but silent: check its power, its node id, its bit rate and the cable"
    return {"node": node, "name": name, **empty, "state": "absent", **dict.fromkeys(_NUMBERS, ""), "remark": remark}


def _state(found: FoundNode) -> str:
    state = found.sighting.state
    if state is None:
        return "answers" if found.answers else "restarting"
    return STATE_WORDS.get(state, f"state {state}")


def _remark(found: FoundNode) -> str:
    seen = found.sighting
    if seen.two_nodes:
        heard = f"{seen.doubled} doubled answers ({seen.differing} of them differ), {seen.boot_ups} boot-ups"
        return (
            f"two nodes have this id: {heard}; take one of them from the bus (pull its plug) and give the other one "
            f"its id: `canhelm nodes set-id {found.node} ID`, or by DIP switches, off and on"
        )
    if seen.state == NmtState.STOPPED:
        return f"stopped, so it does not say what it is: `canhelm nmt preop {found.node}`, then scan again"
    return "" if found.name else "not in the profile"


def bit_rate_remark(bus: Bus, anyone: bool, missing: Sequence[str]) -> str:
    """What error frames say about bit rates, as far as listening tells; empty where there is nothing to say."""
    count = bus.counters.error_frames
    if not count:
        return ""
    head = f"{count} error frames on {bus.name} since it was opened"
    if not anyone:
        return (
            f"{head}, and nobody answers: {bus.bit_rate} bit/s is probably not the bit rate of this network; "
            "an EPOS 24/5 knows 1000, 800, 500, 250, 125, 50 and 20 kbit/s"
        )
    if missing:
        return (
            f"{head}, and {', '.join(missing)} keeps silent: probably set to another bit rate than {bus.bit_rate} bit/s"
        )
    return f"{head}: check termination (120 ohm at both ends), cable and shield"
