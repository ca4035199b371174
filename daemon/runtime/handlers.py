"""What the command modules share: types of handlers, and how a motion is run and held."""

from __future__ import annotations

import re
from collections.abc import Awaitable, Callable
from typing import Any

from canhelm.errors import NodeAbsent, UsageError
from daemon.runtime.motions import Motion
from daemon.runtime.supervisor import Supervisor

HIGHEST_NODE = 127
_NUMBER = re.compile("[0-9]{1,3}|0[xX][0-9a-fA-F]{1,2}")
Params = dict[str, Any]
Handler = Callable[[Params, str | None], Awaitable[dict[str, Any]]]


async def run_motion(
    supervisor: Supervisor, motion: Motion, params: Params, lease: str | None = None
) -> dict[str, Any]:
    """Admit a motion; return its result when it is over, or its id at once where the caller does not wait.

    Args:
        supervisor: that carries it out.
        motion: what is asked for.
        params: that it was asked for with.
        lease: of who asks, be it that the motion is handed to the daemon.
    """
    motion.asked = params
    supervisor.admit(motion, lease)
    if motion.stream is not None or not params.get("wait", True):
        return {"motion": motion.identity}
    return {"motion": motion.identity, **await motion.result()}


def node_number(supervisor: Supervisor, node: int | str) -> int:
    """The node id that a person means by an id or a name. Raises NodeAbsent for what is neither."""
    for number, device in supervisor.devices.by_node.items():
        if device.name == node:
            return number
    if isinstance(node, str):
        number = int(node, 16 if "x" in node.lower() else 10) if _NUMBER.fullmatch(node) else 0
    else:
        number = node
    if 1 <= number <= HIGHEST_NODE:
        return number
    raise NodeAbsent(f"no node {node} in this profile", remedy="`canhelm status` lists the nodes")


def holder(params: Params, lease: str | None, *, endless: bool = False) -> str | None:
    """The lease that holds a motion: the caller's, or none where a finite motion is handed over to the daemon.

    Raises:
        UsageError: a motion without an end cannot be handed over.
    """
    if params.get("wait", True):
        return lease
    if endless:
        raise UsageError(
            "a motion without an end cannot be handed over to the daemon", remedy="give a duration, or wait for it"
        )
    return None
