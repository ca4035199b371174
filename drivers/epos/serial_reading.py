"""What is read from the nodes in each round over a serial line, handed up as the frames that they would have sent."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from functools import partial
from typing import Protocol

from drivers.canopen.codes import NmtState
from drivers.canopen.objects import ObjectDef, ObjectTable
from drivers.epos.codec import TPDO1
from drivers.epos.objects import OBJECTS as EPOS
from drivers.epos.serial_frames import make_read_object, make_request_can_frame

FAULT_BIT = 0x0008
CURRENT_EVERY = 8
"""Rounds between two readings of the gateway's own current."""
REGISTER_EVERY = 6
"""Rounds between two looks at the error register of an encoder, one encoder after the other."""
NO_ERROR = b"\0" * 8

OnData = Callable[[bytes], None]


class Submit(Protocol):
    """Sends one request to a node: the request, the node, a deadline, who takes the data, what comes in any case."""

    def __call__(
        self,
        request: bytes,
        node: int,
        deadline_s: float,
        take: OnData | None = None,
        *,
        then: Callable[[], None] | None = None,
    ) -> None: ...


class Readings:
    """Reads all nodes that run.

    Drives are read by their TPDO1, the gateway by objects. Emergency messages are not forwarded by a gateway: a drive
    that has just gone into fault is asked for the error that it recorded, an encoder now and then for its error
    register, and what they say goes up as the message it would have been.

    Args:
        gateway: node id of the drive on the line.
        encoders: object dictionaries of the encoders by node id.
        inputs: drives whose digital inputs are read as well.
        submit: sends a request.
        receive: takes each frame, COB-ID and data.

    Attributes:
        states: NMT state of each node as commanded.
    """

    def __init__(
        self,
        gateway: int,
        encoders: Mapping[int, ObjectTable],
        inputs: frozenset[int],
        submit: Submit,
        receive: Callable[[int, bytes], None],
    ) -> None:
        self.states: dict[int, NmtState] = {}
        self._gateway = gateway
        self._encoders = encoders
        self._inputs = inputs
        self._submit = submit
        self._receive = receive
        self._asked: set[int] = set()
        self._faulty: set[int] = set()
        self._rounds = 0
        self._statusword = b"\0\0"
        self._current = b"\0\0"

    def command(self, node: int, state: NmtState) -> None:
        """A node (0: every one that is known) was commanded to a state."""
        for each in [node] if node else list(self.states):
            self.states[each] = state
            self._faulty.discard(each)

    def begin_round(self, left_out: set[int]) -> None:
        """Ask every other node that runs, unless it is being asked already; a late reading is still a reading."""
        self._rounds += 1
        for node, state in self.states.items():
            if state is not NmtState.OPERATIONAL or node in left_out or node in self._asked:
                continue
            if node in self._inputs:
                self._read_inputs(node)
            if node == self._gateway:
                self._read_gateway()
            elif node in self._encoders:
                self._read_encoder(node, self._encoders[node])
            else:
                self._ask(node, make_request_can_frame(0x180 + node, TPDO1.size), partial(self._hand_up_drive, node))

    def _ask(self, node: int, request: bytes, take: OnData) -> None:
        self._asked.add(node)
        self._submit(request, node, math.inf, take, then=lambda: self._asked.discard(node))

    def _read(self, node: int, entry: ObjectDef, take: OnData, then: Callable[[], None] | None = None) -> None:
        self._submit(make_read_object(node, entry.index, entry.sub), node, math.inf, take, then=then)

    def _read_inputs(self, node: int) -> None:
        """Its digital inputs, handed up as a TPDO2 without the analog ones."""

        def take(data: bytes) -> None:
            self._receive(0x280 + node, b"\0\0\0\0" + data[:2])

        self._read(node, EPOS["digital_input_functions_state"], take)

    # --- the gateway ---------------------------------------------------------------------------------------------

    def _read_gateway(self) -> None:
        node = self._gateway

        def status(data: bytes) -> None:
            self._statusword = data[:2]

        def current(data: bytes) -> None:
            self._current = data[:2]

        def position(data: bytes) -> None:
            self._hand_up_drive(node, self._statusword + data + self._current)

        self._asked.add(node)
        self._read(node, EPOS["statusword"], status)
        if self._rounds % CURRENT_EVERY == 0:
            self._read(node, EPOS["current_actual_value"], current)
        self._read(node, EPOS["position_actual_value"], position, lambda: self._asked.discard(node))

    # --- drives --------------------------------------------------------------------------------------------------

    def _hand_up_drive(self, node: int, tpdo1: bytes) -> None:
        """Hand a drive's reading up; when it has just gone into fault, after the error that it recorded."""
        if not tpdo1[0] & FAULT_BIT:
            self._faulty.discard(node)
        if not tpdo1[0] & FAULT_BIT or node in self._faulty:
            self._receive(0x180 + node, tpdo1)
            return
        self._faulty.add(node)
        self._read_last_error(node, EPOS, lambda: self._receive(0x180 + node, tpdo1))

    def _read_last_error(self, node: int, table: ObjectTable, then: Callable[[], None] | None = None) -> None:
        def take(data: bytes) -> None:
            self._receive(0x080 + node, data[:2] + b"\0" * 6)

        self._read(node, table["error_history_entry_1"], take, then)

    # --- encoders ------------------------------------------------------------------------------------------------

    def _read_encoder(self, node: int, table: ObjectTable) -> None:
        position = table["position_value"]
        request = make_read_object(node, position.index, position.sub)
        self._ask(node, request, lambda data: self._receive(0x280 + node, data))
        turn, encoders = divmod(self._rounds, REGISTER_EVERY), sorted(self._encoders)
        if turn[1] == 0 and encoders[turn[0] % len(encoders)] == node:
            self._read(node, table["error_register"], lambda data: self._on_register(node, table, data[0]))

    def _on_register(self, node: int, table: ObjectTable, register: int) -> None:
        if register and node not in self._faulty:
            self._faulty.add(node)
            self._read_last_error(node, table)
        elif not register and node in self._faulty:
            self._faulty.discard(node)
            self._receive(0x080 + node, NO_ERROR)
