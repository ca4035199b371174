"""The PDOs of a simulated node: configured through its dictionary, compiled to one struct each (CiA 301 7.2.2)."""

from __future__ import annotations

import struct
from collections.abc import Callable

from drivers.simulated.dictionary import (
    ACCESS_UNSUPPORTED,
    MAPPING_TOO_LONG,
    NOT_MAPPABLE,
    OUT_OF_RANGE,
    WRONG_STATE,
    Address,
    SdoAbort,
    SimulatedDictionary,
)

INVALID = 0x8000_0000
"""Bit 31 of a COB-ID: the PDO does not exist."""
_NO_RTR = 0x4000_0000
_FIRST_ID, _LAST_ID = 0x181, 0x57F
"""Identifiers that the predefined connection set leaves to PDOs."""
_PDO_BITS = 64


class Pdo:
    """What both directions have in common.

    Args:
        dictionary: the node's objects.
        communication: index of the communication parameters (0x1400.., 0x1800..).
        mapping: index of the mapping (0x1600.., 0x1A00..).
        types: transmission types that the node supports.
        may_remap: tells whether the node is in a state that allows a new mapping.

    Attributes:
        can_id: its identifier; None where the PDO is switched off.
        transmission_type: 1 on SYNC, 254 and 255 as the direction says.
    """

    direction = ""

    def __init__(
        self,
        dictionary: SimulatedDictionary,
        communication: int,
        mapping: int,
        types: frozenset[int],
        may_remap: Callable[[], bool],
    ) -> None:
        self.dictionary = dictionary
        self.can_id: int | None = None
        self.transmission_type = 255
        self._communication = communication
        self._mapping = mapping
        self._types = types
        self._may_remap = may_remap
        self._entries = [sub for index, sub in dictionary.objects if index == mapping and sub > 0]
        self._layout = struct.Struct("")
        self._guard_configuration()

    def _guard_configuration(self) -> None:
        checks = self.dictionary.checks
        checks[self._communication, 1] = _check_can_id
        checks[self._communication, 2] = self._check_type
        checks[self._mapping, 0] = self._check_count
        for sub in self._entries:
            checks[self._mapping, sub] = self._check_entry

    @property
    def configuration(self) -> list[Address]:
        """Addresses of the objects that change this PDO."""
        return [(self._communication, 1), (self._communication, 2), (self._mapping, 0)]

    def compile(self) -> list[Address]:
        """Take over the configuration; returns the addresses of the mapped objects in their order."""
        values, objects = self.dictionary.values, self.dictionary.objects
        cob_id = int(values[self._communication, 1])
        self.can_id = None if cob_id & INVALID else cob_id & 0x7FF
        self.transmission_type = int(values[self._communication, 2])
        mapped = [_address(int(values[self._mapping, sub])) for sub in self._entries[: self._count()]]
        self._layout = struct.Struct("<" + "".join(objects[address].type.code for address in mapped))
        return mapped

    def _count(self) -> int:
        return int(self.dictionary.values[self._mapping, 0])

    def _check_type(self, value: int) -> None:
        if value not in self._types:
            raise SdoAbort(OUT_OF_RANGE)

    def _check_entry(self, value: int) -> None:
        if not self._may_remap():
            raise SdoAbort(WRONG_STATE)
        if self._count():
            raise SdoAbort(ACCESS_UNSUPPORTED)
        if value and not self._mappable(value):
            raise SdoAbort(NOT_MAPPABLE)

    def _check_count(self, value: int) -> None:
        if not self._may_remap():
            raise SdoAbort(WRONG_STATE)
        mapped = [int(self.dictionary.values[self._mapping, sub]) for sub in self._entries[:value]]
        if not all(mapped):
            raise SdoAbort(NOT_MAPPABLE)
        if value > len(self._entries) or sum(entry & 0xFF for entry in mapped) > _PDO_BITS:
            raise SdoAbort(MAPPING_TOO_LONG)

    def _mappable(self, value: int) -> bool:
        entry = self.dictionary.objects.get(_address(value))
        return entry is not None and entry.pdo == self.direction and entry.mapping == value


class ReceivePdo(Pdo):
    """A PDO that the node receives; type 1 waits for the next SYNC, others act at once."""

    direction = "rx"

    def __init__(
        self, dictionary: SimulatedDictionary, communication: int, mapping: int, may_remap: Callable[[], bool]
    ) -> None:
        self._setters: list[Callable[[int], None]] = []
        self._pending: bytes | None = None
        super().__init__(dictionary, communication, mapping, frozenset((1, 255)), may_remap)

    def compile(self) -> list[Address]:
        """Take over the configuration; what was latched is dropped."""
        mapped = super().compile()
        self._setters = [self.dictionary.setter(address) for address in mapped]
        self._pending = None
        return mapped

    def accepts(self, data: bytes) -> bool:
        """Whether a frame has the mapped length."""
        return len(data) == self._layout.size

    def latch(self, data: bytes) -> None:
        """Keep the data until the next SYNC; newer data takes the place of older."""
        self._pending = data

    def apply_latched(self) -> None:
        """Let the latched data act, once."""
        if self._pending is not None:
            data, self._pending = self._pending, None
            self.apply(data)

    def apply(self, data: bytes) -> None:
        """Write the mapped objects. Raises SdoAbort at the first value that the device refuses."""
        for set_value, value in zip(self._setters, self._layout.unpack(data), strict=True):
            set_value(value)


class TransmitPdo(Pdo):
    """A PDO that the node sends: after SYNC (type 1), on a remote frame, or from a timer (an encoder's 254, 255)."""

    direction = "tx"

    def __init__(
        self,
        dictionary: SimulatedDictionary,
        communication: int,
        mapping: int,
        may_remap: Callable[[], bool],
        types: frozenset[int] = frozenset((1, 255)),
    ) -> None:
        self._getters: list[Callable[[], object]] = []
        super().__init__(dictionary, communication, mapping, types, may_remap)

    def compile(self) -> list[Address]:
        """Take over the configuration."""
        mapped = super().compile()
        self._getters = [self.dictionary.getter(address) for address in mapped]
        return mapped

    def sample(self) -> bytes:
        """The data of this moment."""
        return self._layout.pack(*[get() for get in self._getters])


def _address(mapping: int) -> Address:
    return mapping >> 16, mapping >> 8 & 0xFF


def _check_can_id(value: int) -> None:
    if value & ~(INVALID | _NO_RTR | 0x7FF) or not _FIRST_ID <= value & 0x7FF <= _LAST_ID:
        raise SdoAbort(OUT_OF_RANGE)
