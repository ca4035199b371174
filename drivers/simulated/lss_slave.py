"""The LSS slave of a simulated device (CiA 305): selection by identity, node id, bit rate, store, fast scan."""

from __future__ import annotations

import struct
from collections.abc import Callable

UNCONFIGURED = 0xFF
_CONFIRM = 0x80
_OK, _OUT_OF_RANGE = 0, 1
_BIT_RATES = {0: 1_000_000, 1: 800_000, 2: 500_000, 3: 250_000, 4: 125_000, 6: 50_000, 7: 20_000, 8: 10_000}
"""Bit rates that the device supports, by their index in bit timing table 0."""

_NUMBER = struct.Struct("<BI3x")
_FAST_SCAN = struct.Struct("<BIBBB")


class LssSlave:
    """What one device does with LSS requests.

    Args:
        identity: vendor, product code, revision and serial number.
        node_id: the node id that it has stored; 255 for none.
        on_waiting: called when it goes back from configuration to waiting.

    Attributes:
        node_id: the node id in force.
        pending: the node id from the next reset of communication on.
        stored: the node id from the next power-up on.
        pending_bit_rate: bit rate that was set [bit/s]; None where none was.
        stored_bit_rate: the one that was stored.
        bit_rate: the one in force since the last power-up; None: as the bus has it.
        configuring: whether it is in configuration.
    """

    def __init__(self, identity: tuple[int, int, int, int], node_id: int, on_waiting: Callable[[], None]) -> None:
        self.identity = identity
        self.node_id = self.pending = self.stored = node_id
        self.bit_rate: int | None = None
        self.pending_bit_rate: int | None = None
        self.stored_bit_rate: int | None = None
        self.configuring = False
        self._on_waiting = on_waiting
        self._matched = 0
        self._scanned = 0
        self._services: dict[int, Callable[[bytes], tuple[int, ...] | None]] = {
            0x11: self._set_node_id,
            0x13: self._set_bit_timing,
            0x17: self._store,
            **{0x5A + part: self._inquiry(part) for part in range(4)},
            0x5E: lambda _: (self.node_id,),
        }

    def power_up(self) -> None:
        """Begin with what is stored."""
        self.pending, self.bit_rate = self.stored, self.stored_bit_rate
        self.reset_communication()

    def reset_communication(self) -> None:
        """The pending node id is in force; waiting, and nothing matched."""
        self.node_id = self.pending
        self.configuring = False
        self._matched = self._scanned = 0

    def answer(self, request: bytes) -> bytes | None:
        """The answer to one request, None where there is none."""
        if len(request) != 8:
            return None
        command = request[0]
        if command == 0x04:
            self._switch(request[1] == 1)
        elif 0x40 <= command <= 0x43:
            return self._select(command - 0x40, request)
        elif command == 0x51:
            return self._fast_scan(request)
        elif self.configuring and command in self._services:
            answer = self._services[command](request)
            return None if answer is None else bytes((command, *answer)).ljust(8, b"\0")
        return None

    def _switch(self, configuring: bool) -> None:
        was, self.configuring = self.configuring, configuring
        if was and not configuring:
            self._on_waiting()

    def _select(self, part: int, request: bytes) -> bytes | None:
        """The four numbers have to come in their order; anything between them does no harm."""
        _, number = _NUMBER.unpack(request)
        if part == 0:
            self._matched = 0
        self._matched = part + 1 if part == self._matched and number == self.identity[part] else 0
        if self._matched < 4:
            return None
        self._matched = 0
        self.configuring = True
        return b"\x44".ljust(8, b"\0")

    def _fast_scan(self, request: bytes) -> bytes | None:
        """Only devices without a node id take part, and only while they wait."""
        if self.node_id != UNCONFIGURED or self.configuring:
            return None
        _, number, bit, part, following = _FAST_SCAN.unpack(request)
        if bit == _CONFIRM:
            self._scanned = 0
            return b"\x4f".ljust(8, b"\0")
        if part != self._scanned or bit > 31 or following > 3 or number >> bit != self.identity[part] >> bit:
            return None
        self._scanned = following
        self.configuring = bit == 0 and following < part
        return b"\x4f".ljust(8, b"\0")

    def _inquiry(self, part: int) -> Callable[[bytes], tuple[int, ...]]:
        return lambda _: tuple(self.identity[part].to_bytes(4, "little"))

    def _set_node_id(self, request: bytes) -> tuple[int, ...]:
        if not (1 <= request[1] <= 127 or request[1] == UNCONFIGURED):
            return (_OUT_OF_RANGE,)
        self.pending = request[1]
        return (_OK,)

    def _set_bit_timing(self, request: bytes) -> tuple[int, ...]:
        if request[1] != 0 or request[2] not in _BIT_RATES:
            return (_OUT_OF_RANGE,)
        self.pending_bit_rate = _BIT_RATES[request[2]]
        return (_OK,)

    def _store(self, _: bytes) -> tuple[int, ...]:
        self.stored, self.stored_bit_rate = self.pending, self.pending_bit_rate
        return (_OK,)
