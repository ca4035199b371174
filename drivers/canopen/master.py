"""The CANopen master: one dispatcher, one SDO queue a node, NMT, SYNC and guarding, on the running asyncio loop."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from dataclasses import dataclass

from canhelm.errors import UsageError
from drivers.bus.contract import Bus, FrameHandler
from drivers.canopen.codes import NmtCommand
from drivers.canopen.counters import CanopenCounters
from drivers.canopen.guarding import REPEAT_AFTER, Guard
from drivers.canopen.lss import ANSWER_COB_ID as LSS_ANSWER_COB_ID
from drivers.canopen.lss import LssMaster
from drivers.canopen.nmt import NMT_COB_ID, SYNC_COB_ID, make_nmt
from drivers.canopen.pacing import Pacing
from drivers.canopen.sdo import ANSWER_COB_ID, SdoClient
from profiles.schema import Network

SEGMENT_BITS = 300
"""Time for each segment of a block transfer, in bit times: a frame of 8 bytes, and as long again for others."""


@dataclass(frozen=True, slots=True)
class NodeEvent:
    """Something happened to a node.

    Attributes:
        kind: ``boot_up``, ``ready``, ``lost``, ``rebooted``, ``refused``, ``emcy``, ``waiting`` or ``toggle``.
        severity: ``info``, ``warning`` or ``error``.
        message: what happened, one sentence.
        remedy: what to do; empty where there is nothing to do.
    """

    time_s: float
    node: int
    name: str
    kind: str
    severity: str
    message: str
    remedy: str = ""


class Master:
    """Owns one bus.

    Args:
        bus: the interface; its receiver becomes this master's dispatcher.
        network: timing.

    Attributes:
        counters: what was dropped.
        pacing: when transfers may begin that configure nodes.
        lss: sets node ids and bit rates of devices.
        names: how people call the nodes, by node id.
        on_event: told of everything that happens to a node.
    """

    def __init__(self, bus: Bus, network: Network) -> None:
        self.bus = bus
        self.network = network
        self.counters = CanopenCounters()
        self.pacing = Pacing(bus.bit_rate)
        self.names: dict[int, str] = {}
        self.on_event: Callable[[NodeEvent], None] | None = None
        self._period_s = 1.0 / network.cycle_hz
        self._handlers: dict[int, FrameHandler] = {}
        self._clients: dict[int, SdoClient] = {}
        self._guards: dict[int, Guard] = {}
        self._commanded: dict[int, Callable[[NmtCommand], None]] = {}
        self.lss = LssMaster(bus.send, network.sdo_timeout_s, self.counters)
        self.subscribe(LSS_ANSWER_COB_ID, self.lss.receive)
        bus.receiver = self._receive
        bus.on_silent = self._on_silent

    async def start(self) -> None:
        """Open the bus on the running loop. Raises BusOff where it is down or missing."""
        await self.bus.open()

    async def close(self) -> None:
        """Give up running transfers and close the bus."""
        for client in self._clients.values():
            client.give_up("was not waited for: the master is closing")
        await self.bus.close()

    def _receive(self, can_id: int, data: bytes, timestamp: float) -> None:
        handler = self._handlers.get(can_id)
        if handler is None:
            self.counters.unknown += 1
        else:
            handler(can_id, data, timestamp)

    def subscribe(self, can_id: int, handler: FrameHandler) -> None:
        """Hand every frame with this identifier to a handler, in place of the one before."""
        self._handlers[can_id] = handler
        self.bus.needs(self._handlers.keys())

    def who(self, node: int) -> str:
        """A node for people: ``node 3 (front_left)``."""
        name = self.names.get(node)
        return f"node {node} ({name})" if name else f"node {node}"

    def tell(self, node: int, kind: str, severity: str, message: str, remedy: str = "") -> None:
        """Pass an event about a node on; arguments as in :class:`NodeEvent`."""
        if self.on_event is not None:
            now = asyncio.get_running_loop().time()
            self.on_event(NodeEvent(now, node, self.names.get(node, ""), kind, severity, message, remedy))

    # --- services ------------------------------------------------------------------------------------------------

    def sdo(self, node: int) -> SdoClient:
        """The SDO client of a node; there is one a node. Raises UsageError for a node id outside 1 to 127."""
        if not 1 <= node <= 127:
            raise UsageError(f"{node} is no node id", node=node, limit="1 to 127", remedy="give a node id of 1 to 127")
        client = self._clients.get(node)
        if client is None:
            name, timeout_s = self.names.get(node, ""), self.network.sdo_timeout_s
            client = SdoClient(node, name, self.bus.send, timeout_s, self.counters, SEGMENT_BITS / self.bus.bit_rate)
            self._clients[node] = client
            self.subscribe(ANSWER_COB_ID + node, client.receive)
        return client

    def sync(self) -> None:
        """SYNC now; worthless when it cannot go out within this cycle."""
        self.bus.send(SYNC_COB_ID, b"", asyncio.get_running_loop().time() + self._period_s)

    def nmt(self, command: NmtCommand, node: int) -> None:
        """A person's NMT command.

        Nodes of the profile are started by their boot-up sequence only, after they were configured: at factory settings
        all drives listen to the same COB-IDs. Node 0 means all: a start then starts those of the profile, every other
        command goes out as one frame to all.
        """
        concerned = [self._commanded[n] for n in sorted(self._commanded) if node in (0, n)]
        if command is not NmtCommand.START or not concerned:
            self.send_nmt(command, node)
        for commanded in concerned:
            commanded(command)

    def send_nmt(self, command: NmtCommand, node: int) -> None:
        """One NMT frame, without more ado."""
        deadline = asyncio.get_running_loop().time() + self.network.sdo_timeout_s
        self.bus.send(NMT_COB_ID, make_nmt(command, node), deadline)

    def on_command(self, node: int, commanded: Callable[[NmtCommand], None]) -> None:
        """Call back when a person commands a node by :meth:`nmt`."""
        self._commanded[node] = commanded

    # --- guarding ------------------------------------------------------------------------------------------------

    def guard(self, node: int, on_lost: Callable[[float], None]) -> Guard:
        """The guard of a node, not armed yet; ``on_lost`` as in :class:`Guard`."""
        guard_time_s, patience_s = self.network.guard_time_ms / 1e3, self.network.patience_s
        guard = Guard(node, guard_time_s, self._send_guard_request, on_lost, self.pacing, patience_s)
        self._guards[node] = guard
        return guard

    def guards(self, node: int) -> bool:
        """Whether a node is guarded now."""
        return node in self._guards and self._guards[node].armed

    def _send_guard_request(self, can_id: int) -> None:
        deadline = asyncio.get_running_loop().time() + REPEAT_AFTER * self.network.guard_time_ms / 1e3
        self.bus.send(can_id, b"", deadline)

    def _on_silent(self, node: int) -> None:
        if node in self._guards:
            self._guards[node].lose(asyncio.get_running_loop().time())

    def guard_due(self, now_s: float) -> None:
        """Send the guard requests that are due and notice lost nodes; called by good control cycles only."""
        for guard in self._guards.values():
            guard.due(now_s)
