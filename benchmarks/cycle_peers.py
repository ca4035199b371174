"""The same control cycle with python-can, python-canopen and canopen-asyncio, used as their documents show."""

from __future__ import annotations

import asyncio
import threading
from types import ModuleType
from typing import Any

import can
import canopen
import canopen_asyncio

from benchmarks.cycle_floors import ENABLE_OPERATION, READINGS, TARGET_RPM
from benchmarks.cycle_robot import (
    DRIVES,
    ENCODERS,
    POSITION,
    RPDO_DRIVE,
    STATUS,
    SYNC,
    TARGET,
    TPDO_ENCODER,
    VirtualRobot,
)

ANSWER_WITHIN_S = 5.0
TPDO1, TPDO2, RPDO1 = (0x1800, 0x1A00), (0x1801, 0x1A01), (0x1400, 0x1600)
STATUS_NAMES = ("Statusword", "Position actual value", "Current actual value")
POSITION_NAME = "Position value"


class PythonCan:
    """Messages of python-can and plain structs."""

    name, key = "python-can, virtual bus", "python_can"

    def __init__(self) -> None:
        self._robot = VirtualRobot("bench-python-can")
        self._bus = can.Bus("bench-python-can", interface="virtual")
        self.values: dict[int, tuple[int, ...]] = {}

    def run(self, count: int) -> None:
        """So many cycles."""
        for _ in range(count):
            self._bus.send(can.Message(arbitration_id=SYNC, is_extended_id=False))
            self._robot.answer()
            for _ in range(READINGS):
                message = self._bus.recv(ANSWER_WITHIN_S)
                assert message is not None
                kind = STATUS if message.arbitration_id < TPDO_ENCODER else POSITION
                self.values[message.arbitration_id] = kind.unpack(message.data)
            for node in DRIVES:
                data = TARGET.pack(ENABLE_OPERATION, TARGET_RPM)
                self._bus.send(can.Message(arbitration_id=RPDO_DRIVE + node, data=data, is_extended_id=False))

    def close(self) -> None:
        """Leave the bus."""
        self._bus.shutdown()
        self._robot.close()


class _Canopen:
    """A network of one of the two libraries, which are used alike.

    Args:
        library: ``canopen`` or ``canopen_asyncio``.
        channel: of the virtual bus.
    """

    def __init__(self, library: ModuleType, channel: str) -> None:
        self._library = library
        self.robot = VirtualRobot(channel)
        self.network: Any = library.Network()
        self.network.connect(channel=channel, interface="virtual")
        drives, encoders = self._dictionary(TPDO1, STATUS_NAMES), self._dictionary(TPDO2, (POSITION_NAME,))
        self._drives = [self._add(node, drives) for node in DRIVES]
        self._encoders = [self._add(node, encoders) for node in ENCODERS]
        for node in self._drives:
            self._map(node.tpdo[1], 0x180 + node.id, STATUS_NAMES)
            self._map(node.rpdo[1], RPDO_DRIVE + node.id, ("Controlword", "Target velocity"))
        for node in self._encoders:
            self._map(node.tpdo[2], TPDO_ENCODER + node.id, (POSITION_NAME,))
        self.values: list[int] = []

    def _dictionary(self, tpdo: tuple[int, int], mapped: tuple[str, ...]) -> Any:
        """An object dictionary with the objects of this cycle."""
        od = self._library.objectdictionary
        dictionary = od.ObjectDictionary()
        for index in (*tpdo, *RPDO1):
            record = od.ODRecord(f"PDO {index:X}", index)
            for sub in range(9):
                entry = od.ODVariable(f"Entry {sub}", index, sub)
                entry.data_type = od.UNSIGNED32
                record.add_member(entry)
            dictionary.add_object(record)
        kinds = {
            "Controlword": (0x6040, od.UNSIGNED16),
            "Statusword": (0x6041, od.UNSIGNED16),
            "Position actual value": (0x6064, od.INTEGER32),
            "Current actual value": (0x6078, od.INTEGER16),
            "Target velocity": (0x60FF, od.INTEGER32),
            POSITION_NAME: (0x6004, od.UNSIGNED32),
        }
        for name, (index, kind) in kinds.items():
            variable = od.ODVariable(name, index)
            variable.data_type = kind
            dictionary.add_object(variable)
        return dictionary

    def _add(self, node: int, dictionary: Any) -> Any:
        remote = self._library.RemoteNode(node, dictionary)
        self.network[node] = remote
        return remote

    def _map(self, pdo: Any, cob_id: int, names: tuple[str, ...]) -> None:
        pdo.clear()
        for name in names:
            pdo.add_variable(name)
        pdo.cob_id, pdo.enabled = cob_id, True
        pdo.subscribe()

    def on_reading(self, callback: Any) -> None:
        """Be called with each TPDO, in the library's thread."""
        for node in self._drives:
            node.tpdo[1].add_callback(callback)
        for node in self._encoders:
            node.tpdo[2].add_callback(callback)

    def read(self) -> None:
        """All readings by their names."""
        self.values = [node.tpdo[1][name].raw for node in self._drives for name in STATUS_NAMES]
        self.values += [node.tpdo[2][POSITION_NAME].raw for node in self._encoders]

    def write(self) -> None:
        """All targets by their names."""
        for node in self._drives:
            pdo = node.rpdo[1]
            pdo["Controlword"].raw = ENABLE_OPERATION
            pdo["Target velocity"].raw = TARGET_RPM
            pdo.transmit()

    def close(self) -> None:
        """Leave the bus."""
        self.network.disconnect()
        self.robot.close()


class PythonCanopen:
    """python-canopen, PDOs by name; its thread tells when the sixth reading is there."""

    name, key = "python-canopen, by name", "python_canopen"

    def __init__(self) -> None:
        self._peer = _Canopen(canopen, "bench-canopen")
        self._peer.on_reading(self._on_reading)
        self._missing = READINGS
        self._complete = threading.Event()
        self.close = self._peer.close

    def _on_reading(self, _: object) -> None:
        self._missing -= 1
        if not self._missing:
            self._complete.set()

    def run(self, count: int) -> None:
        """So many cycles."""
        for _ in range(count):
            self._missing = READINGS
            self._complete.clear()
            self._peer.network.sync.transmit()
            self._peer.robot.answer()
            if not self._complete.wait(ANSWER_WITHIN_S):
                raise RuntimeError(f"{self.name}: {self._missing} readings are missing")
            self._peer.read()
            self._peer.write()


class CanopenAsyncio:
    """canopen-asyncio, PDOs by name; its thread tells the loop when the sixth reading is there."""

    name, key = "canopen-asyncio, by name", "canopen_asyncio"

    def __init__(self) -> None:
        self._runner = asyncio.Runner()
        self._loop = self._runner.get_loop()
        self._peer = _Canopen(canopen_asyncio, "bench-canopen-asyncio")
        self._peer.on_reading(self._on_reading)
        self._missing = READINGS
        self._complete = asyncio.Event()

    def _on_reading(self, _: object) -> None:
        self._missing -= 1
        if not self._missing:
            self._loop.call_soon_threadsafe(self._complete.set)

    def run(self, count: int) -> None:
        """So many cycles."""
        self._runner.run(self._cycles(count))

    async def _cycles(self, count: int) -> None:
        for _ in range(count):
            self._missing = READINGS
            self._complete.clear()
            self._peer.network.sync.transmit()
            self._peer.robot.answer()
            async with asyncio.timeout(ANSWER_WITHIN_S):
                await self._complete.wait()
            self._peer.read()
            self._peer.write()

    def close(self) -> None:
        """Leave the bus and close the loop."""
        self._peer.close()
        self._runner.close()
