"""Who is on the bus: every node id asked and watched, so that two nodes with one id show themselves."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from dataclasses import dataclass

from canhelm.errors import Aborted, NodeAbsent, Timeout
from drivers.bus.contract import ID_MASK, RTR_FLAG, Bus
from drivers.canopen.codes import NmtState
from drivers.canopen.master import Master
from drivers.canopen.nmt import ERROR_CONTROL_COB_ID, parse_error_control
from drivers.canopen.sdo import ANSWER_COB_ID, REQUEST_COB_ID
from drivers.canopen.sdo_frames import Address

ASKED_AT_ONCE = 16
"""Nodes that are asked at the same time, so that a scan does not fill the transmit queue."""
TWICE = 2
"""Doubled answers from which two nodes have one id; a single one may be a late answer."""
TOGETHER_S = 0.05
"""Longest time between two answers to one request."""

_FUNCTION, _NODE = 0x780, 0x07F
_ABORT = 0x80
_BLOCK_TRANSFER = (5, 6)
"""Client commands of block transfers, where one request has many answers."""


@dataclass(slots=True)
class Sighting:
    """What was heard of one node id.

    Attributes:
        state: last state in a guarding answer or heartbeat; None where none came.
        boot_ups: boot-up messages.
        doubled: answers that came second to one request.
        differing: those of them that said something else than the first.
    """

    state: int | None = None
    boot_ups: int = 0
    doubled: int = 0
    differing: int = 0

    @property
    def two_nodes(self) -> bool:
        """Whether two nodes have this id."""
        return self.doubled >= TWICE or self.boot_ups >= TWICE


class BusWatch:
    """Watches requests and answers on a bus. Use as ``with BusWatch(bus) as watch``.

    Args:
        bus: the bus; its traffic goes on as it is.

    Attributes:
        sightings: by node id.
    """

    def __init__(self, bus: Bus) -> None:
        self._bus = bus
        self.sightings: dict[int, Sighting] = {}
        self._asked: dict[int, tuple[float, bytes | None]] = {}

    def __enter__(self) -> BusWatch:
        self._bus.taps.append(self.see)
        return self

    def __exit__(self, *_: object) -> None:
        self._bus.taps.remove(self.see)

    def of(self, node: int) -> Sighting:
        """What was heard of a node id."""
        return self.sightings.setdefault(node, Sighting())

    def see(self, can_id: int, data: bytes, timestamp: float) -> None:
        """Take a frame, sent or received."""
        function, node = can_id & _FUNCTION, can_id & _NODE
        if not node:
            return
        if can_id & RTR_FLAG:
            if function == ERROR_CONTROL_COB_ID:
                self._asked[can_id & ID_MASK] = (timestamp, None)
        elif function == REQUEST_COB_ID and data:
            self._see_request(node, data, timestamp)
        elif function == ANSWER_COB_ID:
            self._see_answer(can_id, data, timestamp)
        elif function == ERROR_CONTROL_COB_ID:
            self._see_error_control(can_id, data, timestamp)

    def _see_request(self, node: int, data: bytes, timestamp: float) -> None:
        if data[0] == _ABORT or data[0] >> 5 in _BLOCK_TRANSFER:
            self._asked.pop(ANSWER_COB_ID + node, None)
        else:
            self._asked[ANSWER_COB_ID + node] = (timestamp, None)

    def _see_error_control(self, can_id: int, data: bytes, timestamp: float) -> None:
        parsed = parse_error_control(data)
        if parsed is None:
            return
        sighting = self.of(can_id & _NODE)
        if parsed[1] == NmtState.BOOT_UP:
            sighting.boot_ups += 1
        else:
            sighting.state = parsed[1]
            self._see_answer(can_id, data, timestamp)

    def _see_answer(self, can_id: int, data: bytes, timestamp: float) -> None:
        """The first answer to a request is its answer; another one right after it comes from a second node."""
        asked_s, first = self._asked.get(can_id, (-TOGETHER_S, None))
        if first is None:
            if can_id in self._asked:
                self._asked[can_id] = (timestamp, data)
        elif timestamp - asked_s < TOGETHER_S:
            sighting = self.of(can_id & _NODE)
            sighting.doubled += 1
            sighting.differing += data != first


@dataclass(slots=True)
class FoundNode:
    """One node id that answers, or was heard.

    Attributes:
        name: as in the profile, or empty.
        answers: it answers SDO requests; a stopped node does not.
        numbers: device type, vendor, product code, revision and serial number, as far as the node has them.
        device_name, firmware: what the node says of itself (0x1008, 0x100A), or empty.
        sighting: what was heard of it.
    """

    node: int
    name: str
    answers: bool
    numbers: dict[str, int]
    device_name: str
    firmware: str
    sighting: Sighting


IDENTITY = {
    "device_type": (0x1000, 0),
    "vendor_id": (0x1018, 1),
    "product_code": (0x1018, 2),
    "revision_number": (0x1018, 3),
    "serial_number": (0x1018, 4),
}


class NodeScan:
    """One scan.

    Args:
        master: the master of the bus; its nodes go on as they are.
        timeout_s: how long each node may take to answer.
        at_once: nodes that are asked at the same time; 1 where each silent one holds up the others.
    """

    def __init__(self, master: Master, timeout_s: float = 0.1, at_once: int = ASKED_AT_ONCE) -> None:
        self._master = master
        self._timeout_s = timeout_s
        self._at_once = at_once
        self._watch = BusWatch(master.bus)

    async def run(self, nodes: Sequence[int] = range(1, 128)) -> list[FoundNode]:
        """Ask node ids, describe those that answer, and ask for their states.

        Nodes that keep silent are asked for their state, too: a stopped node answers nothing else. One that would
        watch for the master's guarding from then on is not asked, unless the master guards it anyway.
        """
        with self._watch:
            answering = await self._answering(nodes)
            found = [await self._describe(node) for node in answering]
            await self._ask_states([node for node in nodes if node not in answering or await self._may_guard(node)])
        heard = [node for node in self._watch.sightings if node in nodes and node not in answering]
        found += [FoundNode(node, self._name(node), False, {}, "", "", self._watch.of(node)) for node in heard]
        return sorted(found, key=lambda each: each.node)

    async def _answering(self, nodes: Sequence[int]) -> list[int]:
        answering: list[int] = []
        for start in range(0, len(nodes), self._at_once):
            group = nodes[start : start + self._at_once]
            answers = await asyncio.gather(*(self._answers(node) for node in group))
            answering += [node for node, answered in zip(group, answers, strict=True) if answered]
        return answering

    async def _answers(self, node: int) -> bool:
        try:
            await self._master.sdo(node).read_raw(IDENTITY["device_type"], self._timeout_s)
        except NodeAbsent:
            return False
        except (Aborted, Timeout):
            return True
        return True

    async def _describe(self, node: int) -> FoundNode:
        values = {name: await self._read(node, address) for name, address in IDENTITY.items()}
        numbers = {name: int.from_bytes(raw, "little") for name, raw in values.items() if raw}
        name, firmware = await self._text(node, 0x1008), await self._text(node, 0x100A)
        return FoundNode(node, self._name(node), True, numbers, name, firmware, self._watch.of(node))

    async def _text(self, node: int, index: int) -> str:
        return (await self._read(node, (index, 0))).decode("latin-1").rstrip("\0 ")

    async def _read(self, node: int, address: Address) -> bytes:
        try:
            return await self._master.sdo(node).read_raw(address, self._timeout_s)
        except (Aborted, NodeAbsent, Timeout):
            return b""

    async def _may_guard(self, node: int) -> bool:
        """Whether a guarding request leaves the node as it is: it does not start its life guarding (0x100C, 0x100D)."""
        if self._master.guards(node):
            return True
        return not (any(await self._read(node, (0x100C, 0))) and any(await self._read(node, (0x100D, 0))))

    async def _ask_states(self, nodes: list[int]) -> None:
        for start in range(0, len(nodes), self._at_once):
            deadline_s = asyncio.get_running_loop().time() + self._timeout_s
            for node in nodes[start : start + self._at_once]:
                self._master.bus.send(RTR_FLAG | ERROR_CONTROL_COB_ID + node, b"", deadline_s)
            await asyncio.sleep(self._timeout_s)

    def _name(self, node: int) -> str:
        return self._master.names.get(node, "")
