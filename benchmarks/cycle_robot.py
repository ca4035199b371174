"""The simulated side of every row: four drives and two encoders by plain structs, over a socket or a virtual bus.

SYNC makes all six send their TPDO; what drives were commanded counts from the next SYNC on, as with real ones.
"""

from __future__ import annotations

import socket
import struct

import can

from drivers.bus.contract import RTR_FLAG

DRIVES = (1, 2, 3, 4)
ENCODERS = (5, 6)
SYNC = 0x080
TPDO_DRIVE, TPDO_ENCODER, RPDO_DRIVE, GUARD = 0x180, 0x280, 0x200, 0x700
STATUS = struct.Struct("<Hih")
"""Statusword, position in qc, current in mA."""
POSITION = struct.Struct("<I")
TARGET = struct.Struct("<Hi")
"""Controlword, target speed in rpm."""
CAN_FRAME = struct.Struct("=IB3x8s")
ENABLED = 0x0137
CENTRE = 2048
"""Position value of an encoder whose pair points forward."""
CURRENT_MA = 800
QC_PER_RPM = 2000 / 60 / 100
"""Counts in a cycle of 10 ms at 1 rpm, of an encoder with 500 pulses."""


class Robot:
    """What the nodes answer; positions go on as the targets say."""

    def __init__(self) -> None:
        self._position_qc = dict.fromkeys(DRIVES, 0.0)
        self._target_rpm = dict.fromkeys(DRIVES, 0)
        self._toggle = dict.fromkeys((*DRIVES, *ENCODERS), 0)

    def readings(self) -> list[tuple[int, bytes]]:
        """The six TPDOs after a SYNC."""
        frames = []
        for node in DRIVES:
            self._position_qc[node] += self._target_rpm[node] * QC_PER_RPM
            data = STATUS.pack(ENABLED, int(self._position_qc[node]), CURRENT_MA)
            frames.append((TPDO_DRIVE + node, data))
        frames += [(TPDO_ENCODER + node, POSITION.pack(CENTRE)) for node in ENCODERS]
        return frames

    def take(self, can_id: int, data: bytes) -> None:
        """A target."""
        _, self._target_rpm[can_id - RPDO_DRIVE] = TARGET.unpack(data)

    def guard_answer(self, node: int) -> bytes:
        """The answer to a guarding request: operational, with the toggle bit."""
        self._toggle[node] ^= 0x80
        return bytes((self._toggle[node] | 5,))


class SocketRobot(Robot):
    """Behind one end of a socket pair, with ``struct can_frame`` on it.

    Args:
        link: its end.
    """

    def __init__(self, link: socket.socket) -> None:
        super().__init__()
        self._link = link

    def answer(self) -> None:
        """Take what has come up to the next SYNC, and answer it."""
        link = self._link
        while True:
            can_id, length, data = CAN_FRAME.unpack(link.recv(CAN_FRAME.size))
            if can_id == SYNC:
                break
            if can_id & RTR_FLAG:
                self._answer_guard(can_id & ~RTR_FLAG)
            else:
                self.take(can_id, data[:length])
        for can_id, data in self.readings():
            link.send(CAN_FRAME.pack(can_id, len(data), data))

    def _answer_guard(self, can_id: int) -> None:
        data = self.guard_answer(can_id - GUARD)
        self._link.send(CAN_FRAME.pack(can_id, len(data), data))


class VirtualRobot(Robot):
    """On a virtual bus of python-can.

    Args:
        channel: of the bus.
    """

    def __init__(self, channel: str) -> None:
        super().__init__()
        self._bus = can.Bus(channel, interface="virtual")

    def answer(self) -> None:
        """Take what has come up to the next SYNC, and answer it."""
        while (message := self._bus.recv()) is not None and message.arbitration_id != SYNC:
            self.take(message.arbitration_id, bytes(message.data))
        for can_id, data in self.readings():
            self._bus.send(can.Message(arbitration_id=can_id, data=data, is_extended_id=False))

    def close(self) -> None:
        """Leave the bus."""
        self._bus.shutdown()
