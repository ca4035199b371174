"""Reads a bus log by the ``canopen`` library alone: what it cannot account for is told."""

from __future__ import annotations

import struct
from collections import defaultdict
from typing import Any

import can
import canopen

from drivers.encoder.objects import OBJECTS as ENCODER
from drivers.epos.objects import OBJECTS as EPOS
from vcan_tests.peer import peer_dictionary

DRIVES = (1, 2, 3, 4)
ENCODERS = (5, 6)
_DOWNLOAD_SIZES = {0x2F: 1, 0x2B: 2, 0x27: 3, 0x23: 4}


class LogReader:
    """Takes frames in their order.

    Attributes:
        frames: frames taken.
        unaccounted: frames that no service of ``canopen`` explains.
        positions_qc: positions of each drive from its TPDO1.
        largest_target_rpm: largest magnitude of a target velocity in any RPDO1.
    """

    def __init__(self) -> None:
        self.frames = 0
        self.unaccounted: list[str] = []
        self.positions_qc: defaultdict[int, list[int]] = defaultdict(list)
        self.largest_target_rpm = 0
        self._network = canopen.Network()
        self._nodes = {
            node: canopen.RemoteNode(node, peer_dictionary(ENCODER if node in ENCODERS else EPOS))
            for node in DRIVES + ENCODERS
        }
        for node in self._nodes.values():
            self._network.add_node(node)
        self._pdo_of_cob_id: dict[int, canopen.pdo.base.PdoMap] = {}
        for encoder in ENCODERS:
            for number, base in ((1, 0x180), (2, 0x280)):
                pdo = self._nodes[encoder].tpdo[number]
                pdo.add_variable(0x6004)
                self._name(pdo, base + encoder)

    def _name(self, pdo: Any, cob_id: int) -> None:
        pdo.cob_id = cob_id
        self._pdo_of_cob_id[cob_id] = pdo

    def take(self, message: can.Message) -> None:
        """One frame."""
        self.frames += 1
        cob_id, data = message.arbitration_id, bytes(message.data)
        if not self._explained(cob_id, data, message):
            self.unaccounted.append(f"{message.timestamp:.6f} {cob_id:03X}#{data.hex()}")

    def tpdo_values(self, node: int) -> dict[str, int]:
        """The last values of a drive's TPDO1, by name."""
        return {variable.name.rpartition(".")[2]: variable.raw for variable in self._nodes[node].tpdo[1]}

    def _explained(self, cob_id: int, data: bytes, message: can.Message) -> bool:
        if message.is_remote_frame:
            return cob_id & 0x780 == 0x700 and cob_id & 0x7F in self._nodes
        if cob_id == 0x000:
            return len(data) == 2 and data[0] in canopen.nmt.COMMAND_TO_STATE
        if cob_id == 0x080:
            return data == b""
        pdo = self._pdo_of_cob_id.get(cob_id)
        if pdo is not None:
            return self._take_pdo(cob_id, pdo, data, message.timestamp)
        node, service = cob_id & 0x7F, cob_id & 0x780
        if node not in self._nodes:
            return False
        if service == 0x600:
            self._learn(node, data)
            return len(data) == 8
        if service == 0x700:
            return len(data) == 1 and data[0] & 0x7F in canopen.nmt.NMT_STATES
        return service in (0x580, 0x080) and len(data) == 8

    def _take_pdo(self, cob_id: int, pdo: Any, data: bytes, timestamp: float) -> bool:
        if len(data) * 8 != sum(variable.length for variable in pdo):
            return False
        pdo.on_message(cob_id, bytearray(data), timestamp)
        values = {variable.name.rpartition(".")[2]: variable.raw for variable in pdo}
        if "position_actual_value" in values:
            self.positions_qc[cob_id & 0x7F].append(values["position_actual_value"])
        if "target_velocity" in values:
            self.largest_target_rpm = max(self.largest_target_rpm, abs(values["target_velocity"]))
        return True

    def _learn(self, node: int, data: bytes) -> None:
        """Take PDO parameters from an expedited download of the master."""
        size = _DOWNLOAD_SIZES.get(data[0])
        index, sub = struct.unpack_from("<HB", data, 1)
        if size is None or not 0x1400 <= index < 0x1C00:
            return
        value = int.from_bytes(data[4 : 4 + size], "little")
        pdos = self._nodes[node].rpdo if index < 0x1800 else self._nodes[node].tpdo
        pdo = pdos[(index & 0x1FF) + 1]
        if index & 0x200 and sub == 0:
            if value == 0:
                pdo.clear()
        elif index & 0x200:
            pdo.add_variable(value >> 16, value >> 8 & 0xFF, value & 0xFF)
        elif sub == 1:
            self._name(pdo, value & 0x7FF)
