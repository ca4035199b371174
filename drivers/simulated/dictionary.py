"""The values behind a simulated node's object dictionary: typed access by SDO rules, hooks, non-volatile memory."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from math import inf

from drivers.canopen.objects import Access, DataType, ObjectDef, ObjectTable

Value = int | str | bytes
Address = tuple[int, int]


class SdoAbort(Exception):
    """An access that the node refuses.

    Args:
        code: SDO abort code (CiA 301 7.2.4.3.17).
    """

    def __init__(self, code: int) -> None:
        super().__init__(f"0x{code:08X}")
        self.code = code


WRITE_ONLY = 0x0601_0001
READ_ONLY = 0x0601_0002
ACCESS_UNSUPPORTED = 0x0601_0000
NO_OBJECT = 0x0602_0000
NOT_MAPPABLE = 0x0604_0041
MAPPING_TOO_LONG = 0x0604_0042
WRONG_LENGTH = 0x0607_0010
TOO_LONG = 0x0607_0012
TOO_SHORT = 0x0607_0013
NO_SUB_INDEX = 0x0609_0011
OUT_OF_RANGE = 0x0609_0030
TOO_HIGH = 0x0609_0031
TOO_LOW = 0x0609_0032
CANNOT_STORE = 0x0800_0020
WRONG_STATE = 0x0800_0022

SAVE = int.from_bytes(b"save", "little")
"""Signature to write to 0x1010."""
LOAD = int.from_bytes(b"load", "little")
"""Signature to write to 0x1011."""

_EMPTY: dict[DataType, Value] = {DataType.VISIBLE_STRING: "", DataType.DOMAIN: b""}


class SimulatedDictionary:
    """The object dictionary of one simulated node.

    Entries of the table that belong to later firmware do not exist here.

    Args:
        table: the device's objects.
        node_id: added to the defaults that depend on it.
        factory: values by name in place of the table's defaults.
        volatile: names of writable objects that saving leaves out (commands and set values).
        kept: names of read-only objects that saving includes.

    Attributes:
        values: present value by (index, sub-index); live values stand in ``readers`` instead.
        readers: functions that compute the value of an object when it is read.
        checks: functions that look at a value before it is stored; they raise SdoAbort.
        actions: functions called with a value after it was stored.
    """

    def __init__(
        self,
        table: ObjectTable,
        node_id: int,
        factory: dict[str, Value],
        volatile: Iterable[str] = (),
        kept: Iterable[str] = (),
    ) -> None:
        self.table = table
        self._factory_by_name = factory
        self.objects = {(o.index, o.sub): o for o in table.objects if o.firmware == "2011h"}
        self._indices = {index for index, _ in self.objects}
        self.take_node_id(node_id)
        writable = {address for address, entry in self.objects.items() if entry.access is Access.RW}
        self._parameters = writable - {self.address(n) for n in volatile} | {self.address(n) for n in kept}
        self._stored: dict[Address, Value] = {}
        self.values = dict(self._factory)
        self.readers: dict[Address, Callable[[], Value]] = {}
        self.checks: dict[Address, Callable[[int], None]] = {}
        self.actions: dict[Address, Callable[[int], None]] = {}

    def take_node_id(self, node_id: int) -> None:
        """Change the node id; the defaults that depend on it count from the next restart on."""
        self.node_id = node_id
        self._factory = {address: self._default(entry) for address, entry in self.objects.items()}

    def _default(self, entry: ObjectDef) -> Value:
        value = self._factory_by_name.get(entry.name, entry.default)
        if value is None:
            return _EMPTY.get(entry.type, 0)
        return value + self.node_id if entry.plus_node_id and isinstance(value, int) else value

    def address(self, name: str) -> Address:
        """Index and sub-index of an object by its name."""
        entry = self.table[name]
        return entry.index, entry.sub

    def number(self, name: str) -> int:
        """The stored value of a numeric object."""
        entry = self.table[name]
        return int(self.values[entry.index, entry.sub])

    def kept_number(self, name: str) -> int:
        """What the next restart finds in a numeric object."""
        address = self.address(name)
        return int(self._stored.get(address, self._factory[address]))

    def find(self, index: int, sub: int) -> ObjectDef:
        """The entry at an address. Raises SdoAbort for an unknown index or sub-index."""
        entry = self.objects.get((index, sub))
        if entry is None:
            raise SdoAbort(NO_SUB_INDEX if index in self._indices else NO_OBJECT)
        return entry

    def read(self, index: int, sub: int) -> bytes:
        """Little-endian bytes of an object as an SDO client gets them. Raises SdoAbort."""
        entry = self.find(index, sub)
        if entry.access is Access.WO:
            raise SdoAbort(WRITE_ONLY)
        return entry.type.pack(self.getter((index, sub))())

    def write(self, index: int, sub: int, data: bytes) -> None:
        """Store what an SDO client wrote, and let it act. Raises SdoAbort."""
        entry = self.find(index, sub)
        if entry.access in (Access.RO, Access.CONST):
            raise SdoAbort(READ_ONLY)
        if entry.type.bits and len(data) * 8 != entry.type.bits:
            raise SdoAbort(TOO_LONG if len(data) * 8 > entry.type.bits else TOO_SHORT)
        value = entry.type.unpack(data)
        if isinstance(value, int):
            self.set_number((index, sub), value)
        else:
            self.values[index, sub] = value

    def set_number(self, address: Address, value: int) -> None:
        """Check, store and let act one number. Raises SdoAbort."""
        self.setter(address)(value)

    def setter(self, address: Address) -> Callable[[int], None]:
        """A function that does to one number what :meth:`set_number` does."""
        entry, values = self.objects[address], self.values
        low = -inf if entry.low is None else entry.low
        high = inf if entry.high is None else entry.high
        check, action = self.checks.get(address), self.actions.get(address)

        def set_value(value: int) -> None:
            if not low <= value <= high:
                raise SdoAbort(TOO_HIGH if value > high else TOO_LOW)
            if check is not None:
                check(value)
            values[address] = value
            if action is not None:
                action(value)

        return set_value

    def getter(self, address: Address) -> Callable[[], Value]:
        """A function that reads an object's present value."""
        reader = self.readers.get(address)
        return reader if reader is not None else lambda: self.values[address]

    def save(self) -> None:
        """Copy all parameters to the non-volatile memory."""
        self._stored = {address: self.values[address] for address in self._parameters}

    def commission(self, values: dict[str, Value]) -> None:
        """Put values by name into the non-volatile memory, as somebody who set the device up left them."""
        self._stored |= {self.address(name): value for name, value in values.items()}

    def forget(self) -> None:
        """Empty the non-volatile memory: the next restart finds the factory values."""
        self._stored = {}

    def restart(self, *, communication_only: bool = False) -> None:
        """Take the values that power-up finds: the stored ones, else the factory's. No action runs."""
        fresh = {**self._factory, **self._stored}
        if communication_only:
            fresh = {address: value for address, value in fresh.items() if address[0] < 0x2000}
        self.values.update(fresh)
