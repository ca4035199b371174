"""What nobody may do to the nodes of the vehicle through the bus, past the supervisor.

The drives are commanded by the control cycle and guarded by good cycles; a person or a tool that reads and writes
objects must neither disturb a drive that is enabled nor switch one on behind the supervisor's back.
"""

from __future__ import annotations

from canhelm.errors import Interlock
from daemon.runtime.supervisor import Supervisor

CONTROLWORD = 0x6040
LIFE_GUARDING = (0x100C, 0x100D)
BRAKE_OUTPUTS = (0x2078, 0x2079)


def require_all_disabled(supervisor: Supervisor) -> None:
    """Raise Interlock while a drive has power or a setup is under way: network states and objects stay as they are."""
    supervisor.require_no_setup_of_others(None)
    if supervisor.powered:
        raise Interlock(
            "a drive is enabled: network states and objects are changed at rest, with every drive disabled",
            remedy="`canhelm stop`, then `canhelm motor disable`",
        )


def require_reach_allowed(supervisor: Supervisor, node: int) -> None:
    """Raise Interlock where asking a node would hold up those of the vehicle while a drive has power.

    A gateway on a serial line waits for a node that does not answer, and forwards nothing meanwhile.
    """
    strange = node not in supervisor.devices.by_node
    if strange and not supervisor.master.network.synchronous and supervisor.powered:
        raise Interlock(
            f"node {node} is not in the profile: over a serial line a node that does not answer holds up all others",
            remedy="ask it at rest: `canhelm stop`, then `canhelm motor disable`",
        )


def require_write_allowed(supervisor: Supervisor, node: int, index: int) -> None:
    """Raise Interlock where writing an object would get round an interlock.

    Args:
        node: its node; nodes that are no part of the vehicle are free.
        index: the object.
    """
    require_reach_allowed(supervisor, node)
    device = supervisor.devices.by_node.get(node)
    if device is None:
        return
    require_all_disabled(supervisor)
    drive = device.name if device.name in supervisor.devices.drives else ""
    if drive and index == CONTROLWORD:
        commands = f"`canhelm motor enable {drive}`, or disable, quick-stop, reset"
        _refuse(device.who, "is switched by the daemon alone, under a lease", commands)
    if index in LIFE_GUARDING:
        _refuse(device.who, "is guarded as its profile says", "change `network` in the profile")
    brakes = [brake.name for brake in supervisor.devices.brakes.values() if brake.drive == drive]
    if brakes and index in BRAKE_OUTPUTS:
        _refuse(device.who, f"works the {brakes[0]} brake with its outputs", f"`canhelm brake release {brakes[0]}`")


def _refuse(who: str, why: str, remedy: str) -> None:
    raise Interlock(f"{who} {why}: this object is not written from outside", remedy=remedy)
