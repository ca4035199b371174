"""Another node id for an EPOS whose DIP switches are all off: by object 0x2000, kept in its memory."""

from __future__ import annotations

import asyncio

from canhelm.errors import Aborted, NodeAbsent, Refused, Timeout
from drivers.canopen.codes import NmtCommand
from drivers.canopen.master import Master
from drivers.canopen.scan import BusWatch
from drivers.epos.commissioning import SAVE, SAVE_TIMEOUT_S
from drivers.epos.objects import OBJECTS

QUESTIONS = 8
"""How often a drive is asked before, so that a second one with its id shows itself."""
RESTART_S, LOOKS = 0.25, 8
"""Time between two looks for a drive that restarts, and how many."""


async def set_node_id(master: Master, node: int, new: int) -> None:
    """Store a node id in a drive in pre-operational, and restart it (object 0x2000; maxon EPOS Hardware Reference 7.7).

    Raises:
        Refused: two drives have the old id, so both would take the new one; or DIP switches give the drive its id.
        NodeAbsent, Timeout, Aborted: it does not answer, or does not come back.
    """
    await _require_alone(master, node)
    entry, sdo = OBJECTS["node_id_software"], master.sdo(node)
    before = await sdo.read_int(entry)
    await sdo.write(entry, new)
    await sdo.write_raw(OBJECTS["save_all_parameters"], SAVE, SAVE_TIMEOUT_S)
    master.send_nmt(NmtCommand.RESET_NODE, node)
    if await _comes_back(master, node, new) == new:
        return
    await sdo.write(entry, before)
    await sdo.write_raw(OBJECTS["save_all_parameters"], SAVE, SAVE_TIMEOUT_S)
    remedy = f"set them to {new} (switch 1 counts 1, switch 2 counts 2, switch 3 counts 4 ...), switch it off and on"
    raise Refused(f"the DIP switches of node {node} give it its id", node=node, remedy=remedy)


async def _require_alone(master: Master, node: int) -> None:
    sdo = master.sdo(node)
    with BusWatch(master.bus) as watch:
        for _ in range(QUESTIONS):
            await sdo.read_int(OBJECTS["statusword"])
            await master.pacing.give_way()
    if watch.of(node).two_nodes:
        remedy = "take one of them from the bus (its CAN or power plug), then again"
        raise Refused(f"two drives have node id {node}: both would get the new one", node=node, remedy=remedy)


async def _comes_back(master: Master, old: int, new: int) -> int:
    """Under which of its two ids a drive answers after its restart. Raises NodeAbsent."""
    for _ in range(LOOKS):
        await asyncio.sleep(RESTART_S)
        for node in (new, old):
            try:
                await master.sdo(node).read_int(OBJECTS["statusword"])
            except (NodeAbsent, Timeout, Aborted):
                continue
            return node
    raise NodeAbsent(f"node {old} has stored node id {new}, but does not answer", remedy="switch it off and on")
