"""The CAN side of a simulated EPOS that is a gateway: SDO requests and remote frames, one outstanding at a time.

Source: maxon EPOS Communication Guide, chapter 8; CiA 301 7.2.4. The time-out is not published.
"""

from __future__ import annotations

import asyncio
import struct
from collections.abc import Callable

from drivers.bus.contract import ID_MASK, RTR_FLAG
from drivers.simulated.node import SimulatedNode
from drivers.simulated.sdo_server import SdoServer

SDO_TIMEOUT = 0x0504_0000
_SDO_ANSWER, _SDO_REQUEST = 0x580, 0x600
_SEGMENT_SERVICES = (0, 3)
_ABORT = struct.Struct("<B3sI")

Answered = Callable[[bytes | None, float], None]
"""Takes the data of the answer, None after the time-out, and the time at which it came."""


class Forwarding:
    """Asks nodes on behalf of the serial line; the gateway's own objects are asked without a frame.

    Args:
        node: the gateway.
        timeout_s: longest time to wait for an answer.
    """

    def __init__(self, node: SimulatedNode, timeout_s: float) -> None:
        self._node = node
        self._timeout_s = timeout_s
        self._server = SdoServer(node.dictionary)
        self._awaited = -1
        self._multiplexer: bytes | None = None
        self._answered: Answered | None = None
        self._timer: asyncio.TimerHandle | None = None

    def ask(self, node_id: int, request: bytes, answered: Answered, at_s: float) -> None:
        """Send one SDO request of 8 bytes to a node, 0 for the gateway itself, and hand over the answer."""
        if node_id in (0, self._node.node_id):
            self._node.before_access(at_s)
            answered(self._server.answer(request), at_s)
            return
        self._multiplexer = None if request[0] >> 5 in _SEGMENT_SERVICES else request[1:4]
        self._wait(_SDO_ANSWER + node_id, answered)
        self._node.port.send(_SDO_REQUEST + node_id, request)

    def abort(self, node_id: int, multiplexer: bytes, code: int) -> None:
        """Tell a node that a transfer is over."""
        message = _ABORT.pack(0x80, multiplexer, code)
        if node_id in (0, self._node.node_id):
            self._server.answer(message)
        else:
            self._node.port.send(_SDO_REQUEST + node_id, message)

    def request_frame(self, can_id: int, answered: Answered) -> None:
        """Send a remote frame and wait for the data frame with its identifier."""
        self._multiplexer = None
        self._wait(can_id, answered)
        self._node.port.send(can_id | RTR_FLAG)

    def send_frame(self, can_id: int, data: bytes) -> None:
        """Send a data frame."""
        self._node.port.send(can_id & ID_MASK, data)

    def forget(self) -> None:
        """Wait no more."""
        self._end()
        self._server.reset()

    def _wait(self, can_id: int, answered: Answered) -> None:
        self._awaited = can_id
        self._answered = answered
        self._node.port.taps.append(self._hear)
        self._timer = asyncio.get_running_loop().call_later(self._timeout_s, self._on_timeout)

    def _hear(self, can_id: int, data: bytes, end_s: float) -> None:
        if can_id != self._awaited or self._multiplexer not in (None, data[1:4]):
            return
        answered = self._end()
        if answered is not None:
            answered(data, end_s)

    def _on_timeout(self) -> None:
        answered = self._end()
        if answered is not None:
            answered(None, asyncio.get_running_loop().time())

    def _end(self) -> Answered | None:
        answered, self._answered = self._answered, None
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
            self._node.port.taps.remove(self._hear)
        return answered
