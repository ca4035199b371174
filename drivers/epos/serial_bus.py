"""A CAN bus behind the RS-232 port of one EPOS: what the master sends is carried over by requests to that drive.

The gateway hands on SDO transfers, NMT commands and single CAN frames, and asks other nodes by remote frames; it does
not hand on PDOs, SYNC or emergency messages that come by themselves (maxon EPOS Communication Guide 8). So here SYNC
begins a round of reading, and what was read goes up as the frame that the node would have sent:

- every other drive is asked for its TPDO1 by a remote frame, and takes its targets as RPDO frames;
- the gateway itself, which no frame reaches, is read and written by objects;
- an encoder is read by its position value;
- a drive that reports a fault is asked for its last error, which goes up as an emergency message.

A node that does not answer is left out until an SDO transfer reaches it again, because each request to it keeps the
line for the gateway's own time-out.
"""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable, Mapping
from typing import Any

from canhelm.errors import BusOff, CanhelmError
from drivers.bus.contract import ID_MASK, RTR_FLAG, Bus
from drivers.canopen.codes import NmtCommand, NmtState
from drivers.canopen.objects import ObjectTable
from drivers.epos.objects import OBJECTS as EPOS
from drivers.epos.serial_answers import Answer
from drivers.epos.serial_conversation import Transport
from drivers.epos.serial_frames import (
    make_read_object,
    make_request_can_frame,
    make_send_can_frame,
    make_send_nmt,
    make_write_object,
)
from drivers.epos.serial_handshake import Exchange
from drivers.epos.serial_line import SerialLine
from drivers.epos.serial_reading import OnData, Readings
from drivers.epos.serial_sdo import SILENT, SdoBridge

RECONNECT_S = 1.0
MEMORY_S = 1.0
"""A node that has answered within this time counts as alive while it cannot be asked."""
_STATES = {
    NmtCommand.START: NmtState.OPERATIONAL,
    NmtCommand.STOP: NmtState.STOPPED,
    NmtCommand.ENTER_PRE_OPERATIONAL: NmtState.PRE_OPERATIONAL,
    NmtCommand.RESET_NODE: NmtState.BOOT_UP,
    NmtCommand.RESET_COMMUNICATION: NmtState.BOOT_UP,
}


class SerialGatewayBus(Bus):
    """The bus behind one drive.

    Args:
        name: the device (``/dev/ttyS0``).
        connect: makes the transport, on the running loop; it calls its argument with the reason when the device
            vanishes. Raises BusOff where the device is missing.
        baud: bit/s of the line.
        make_exchange: from the baud rate, how one request and its answer go over the line.
        bit_rate: bit/s of the CAN bus behind it.
        gateway: node id of the drive on the line.
        encoders: object dictionaries of the encoders by node id; all other nodes are drives.
        inputs: drives whose digital inputs are read in each cycle.
        facts: what was planned for the line, for ``status``.

    Attributes:
        line: the serial line, once opened.
        silent: nodes that did not answer and are left out.
        on_idle: called when everything cyclic that was sent is done.
    """

    def __init__(
        self,
        name: str,
        connect: Callable[[Callable[[str], None]], Transport],
        baud: int,
        make_exchange: Callable[[int], Exchange],
        bit_rate: int,
        gateway: int,
        encoders: Mapping[int, ObjectTable],
        inputs: frozenset[int],
        facts: Mapping[str, Any],
    ) -> None:
        super().__init__(name, bit_rate)
        self.baud = baud
        self.gateway = gateway
        self.silent: set[int] = set()
        self.line: SerialLine | None = None
        self.on_idle: Callable[[], None] | None = None
        self._under_way = 0
        self._connect = connect
        self._make_exchange = make_exchange
        self._encoders = encoders
        self._facts = facts
        self._bridges: dict[int, SdoBridge] = {}
        self._long_transfers = asyncio.Lock()
        self._readings = Readings(gateway, encoders, inputs, self._submit, self._receive)
        self._toggles: dict[int, int] = {}
        self._spoke_s: dict[int, float] = {}
        self._guarded_s: dict[int, float] = {}
        self._guarding: set[int] = set()
        self._probed: set[int] = set()
        self._reconnecting: asyncio.TimerHandle | None = None

    @property
    def trouble(self) -> BusOff | None:
        """Why the line does not work, with what mends it; None while it does."""
        return self.line.trouble if self.line is not None else None

    async def open(self) -> None:
        """Open the line. Raises BusOff where its device is missing."""
        if self.line is None:
            exchange = self._make_exchange(self.baud)
            self.line = SerialLine(self._connect(self._on_lost), self.baud, self.name, exchange)

    def _on_lost(self, reason: str) -> None:
        """The device has vanished: everything fails until it is back, which is tried once a second."""
        if self.line is not None:
            self.line.lose(reason)
            self._reconnecting = asyncio.get_running_loop().call_later(RECONNECT_S, self._reconnect)

    def _reconnect(self) -> None:
        assert self.line is not None
        try:
            self.line.attach(self._connect(self._on_lost))
        except BusOff:
            self._reconnecting = asyncio.get_running_loop().call_later(RECONNECT_S, self._reconnect)

    async def node_on_line(self) -> int:
        """Node id of the drive on the line. Raises Timeout or BusOff."""
        assert self.line is not None
        answer = await self.line.request(make_read_object(0, EPOS["cob_id_emcy"].index, 0))
        return int.from_bytes(answer.data, "little") & 0x7F

    async def close(self) -> None:
        """End what is under way and close the line."""
        for bridge in self._bridges.values():
            bridge.close()
        if self._reconnecting is not None:
            self._reconnecting.cancel()
        if self.line is not None and self.line.down is None:
            self.line.lose("closed")

    def details(self) -> dict[str, Any]:
        """What the line does, for ``status``; shares are 0 to 1."""
        if self.line is None:
            return {}
        counters = self.line.counters
        return {
            "baud": self.baud,
            "line_utilisation": round(self.line.utilisation(), 3),
            "own_idle_share": round(self.line.own_idle_share(), 3),
            "exchanges": counters.exchanges,
            "resyncs": counters.resyncs,
            "line_retries": self.line.retries,
            "silent_nodes": sorted(self.silent & self._readings.states.keys()),
            "line_down": str(self.line.trouble) if self.line.trouble else None,
            **self._facts,
        }

    def load(self) -> float:
        """Share of the last second that the serial line was busy."""
        return self.line.load() if self.line is not None else 0.0

    # --- what the master sends -----------------------------------------------------------------------------------

    def send(self, can_id: int, data: bytes = b"", deadline_s: float = math.inf) -> None:
        """Carry one frame of the master over the line."""
        self.counters.sent += 1
        self._tap(can_id, data)
        function, node = can_id & 0x780, can_id & 0x7F
        if can_id & RTR_FLAG:
            self._ask_state(node, deadline_s)
        elif function == 0x600:
            if node in self.silent or node not in self._spoke_s:
                self._guard_before_waiting()
                self._probed.add(node)
            self._bridge(node).take(data, deadline_s)
        elif can_id == 0x000:
            self._command(NmtCommand(data[0]), data[1])
        elif can_id == 0x080:
            busy = {node for node, bridge in self._bridges.items() if bridge.transferring}
            self._readings.begin_round(self.silent | busy)
        elif node == self.gateway:
            self.write(EPOS["controlword"].index, 0, data[:2], deadline_s)
        else:
            self._submit(make_send_can_frame(can_id, data), node, deadline_s, urgent=True)

    def write(
        self,
        index: int,
        sub: int,
        value: bytes,
        deadline_s: float,
        *,
        on_written: Callable[[], None] | None = None,
    ) -> None:
        """Write an object of the gateway drive itself; ``on_written`` is called when it has taken it."""
        self._submit(
            make_write_object(self.gateway, index, sub, value),
            self.gateway,
            deadline_s,
            (lambda _: on_written()) if on_written is not None else None,
            urgent=True,
        )

    def _command(self, command: NmtCommand, node: int) -> None:
        self._readings.command(node, _STATES[command])
        self._submit(make_send_nmt(node, command), node, math.inf)

    def _bridge(self, node: int) -> SdoBridge:
        bridge = self._bridges.get(node)
        if bridge is None:
            assert self.line is not None
            table = self._encoders.get(node, EPOS)

            def answer(data: bytes) -> None:
                self._heard(node)
                self._receive(0x580 + node, data)

            bridge = self._bridges[node] = SdoBridge(
                node, self.line, table, self._long_transfers, answer, self._on_failure
            )
        return bridge

    # --- guarding ------------------------------------------------------------------------------------------------

    def _ask_state(self, node: int, deadline_s: float) -> None:
        """Guard a node.

        The gateway cannot be guarded: that it has just answered stands for it. The same holds for the others while the
        line is kept by a request to a node that may be dead; they are asked right after it.
        """
        if node == self.gateway:
            self._answer_from_memory(node)
        elif node not in self.silent:
            self._guarded_s[node] = asyncio.get_running_loop().time()
            if self._probed:
                self._answer_from_memory(node)
                self._guard(node, math.inf)
            else:
                self._guard(node, deadline_s)

    def _guard(self, node: int, deadline_s: float) -> None:
        """Send one guard request, unless one waits already."""
        if node in self._guarding:
            return
        self._guarding.add(node)
        request = make_request_can_frame(0x700 + node, 1)
        self._submit(
            request,
            node,
            deadline_s,
            lambda data: self._state_of(node, data[0] & 0x7F),
            then=lambda: self._guarding.discard(node),
            urgent=True,
        )

    def _guard_before_waiting(self) -> None:
        """A node that may be dead keeps the line: those that are guarded are asked once more before."""
        recently_s = asyncio.get_running_loop().time() - MEMORY_S
        for node, asked_s in self._guarded_s.items():
            if asked_s > recently_s and node not in self.silent:
                self._guard(node, math.inf)

    def _answer_from_memory(self, node: int) -> None:
        loop = asyncio.get_running_loop()
        if loop.time() - self._spoke_s.get(node, -math.inf) < MEMORY_S:
            loop.call_soon(self._state_of, node, self._readings.states.get(node, NmtState.PRE_OPERATIONAL))

    def _state_of(self, node: int, state: int) -> None:
        """Hand a node's state up; the toggle bit is of this bus, because not every answer came from the node."""
        toggle = self._toggles[node] = self._toggles.get(node, 0) ^ 0x80
        self._receive(0x700 + node, bytes((toggle | state,)))

    # --- the line ------------------------------------------------------------------------------------------------

    def _submit(
        self,
        request: bytes,
        node: int,
        deadline_s: float,
        take: OnData | None = None,
        *,
        then: Callable[[], None] | None = None,
        urgent: bool = False,
    ) -> None:
        assert self.line is not None

        self._under_way += 1

        def done(result: Answer | CanhelmError) -> None:
            self._under_way -= 1
            if isinstance(result, Answer) and not result.error:
                self._spoke_s[node] = asyncio.get_running_loop().time()
                if take is not None:
                    take(result.data)
            elif isinstance(result, Answer) and result.error in SILENT:
                self._on_failure(node, True)
                if self.on_silent is not None:
                    self.on_silent(node)
            elif not isinstance(result, BusOff):
                self.counters.dropped_stale += 1
            if then is not None:
                then()
            if not self._under_way and self.on_idle is not None:
                self.on_idle()

        self.line.submit(request, done, deadline_s, urgent)

    def _heard(self, node: int) -> None:
        self._spoke_s[node] = asyncio.get_running_loop().time()
        self.silent.discard(node)
        self._probed.discard(node)

    def _on_failure(self, node: int, silent: bool) -> None:
        """A transfer failed: because the node is silent, or because the line failed, which says nothing of the node."""
        self._probed.discard(node)
        if silent and node != self.gateway:
            self.silent.add(node)

    def _receive(self, can_id: int, data: bytes) -> None:
        self.counters.received += 1
        self._tap(can_id, data)
        if self.receiver is not None:
            self.receiver(can_id, data, asyncio.get_running_loop().time())

    def _tap(self, can_id: int, data: bytes) -> None:
        if self.taps:
            now = asyncio.get_running_loop().time()
            for tap in self.taps:
                tap(can_id & (ID_MASK | RTR_FLAG), data, now)
