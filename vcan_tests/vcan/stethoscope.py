"""Listens to drives whose master has died: asks for their velocities, so that candump's log tells when each stood."""

from __future__ import annotations

import select
import socket
import struct
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from math import tau

from profiles.loader import load
from vcan_tests.kernel.slcan_adapter import CAN_FRAME
from vcan_tests.vcan.witness import Frame

DRIVES = dict(enumerate(load("max2d").profile.drives.values(), start=1))
AT_REST_M_S = 0.01
SETTLED_S = 0.3
"""Time at rest after which a drive is believed."""
PERIOD_S = 0.01
ANSWER_S = 1.0
PATIENCE_S = 10.0

Address = tuple[int, int]
"""Index and subindex of an object."""
VELOCITY: Address = (0x606C, 0)
STATUSWORD: Address = (0x6041, 0)
OUTPUTS: Address = (0x2078, 1)
BRAKE_ENGAGED = 1 << 12
"""In the outputs of a drive with a brake; set, the pin is high and its coil without current."""
_READ = 0x40
_REQUEST = struct.Struct("<BHB4x")
_ANSWER = struct.Struct("<BHBi")


class Stethoscope:
    """A raw socket that reads objects, one at a time; not beside a daemon or command that reads, too."""

    def __init__(self, interface: str) -> None:
        self._socket = socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
        self._socket.setsockopt(socket.SOL_CAN_RAW, socket.CAN_RAW_FILTER, struct.pack("=II", 0x580, 0x780))
        self._socket.settimeout(ANSWER_S)
        self._socket.bind((interface,))

    def close(self) -> None:
        """Ask no more."""
        self._socket.close()

    def read(self, node: int, address: Address) -> int:
        """The value of an object, signed, its unused bytes zero."""
        self._socket.send(CAN_FRAME.pack(0x600 + node, 8, _REQUEST.pack(_READ, *address)))
        while True:
            can_id, _, data = CAN_FRAME.unpack(self._socket.recv(CAN_FRAME.size))
            _, *answered, value = _ANSWER.unpack(data)
            if (can_id, *answered) == (0x580 + node, *address):
                return int(value)

    def listen_until_rest(self) -> None:
        """Read the velocities of all drives again and again until all have been at rest for a while."""
        moved_s = begin_s = time.monotonic()
        while time.monotonic() < moved_s + SETTLED_S:
            if any(speed_m_s(node, self.read(node, VELOCITY)) >= AT_REST_M_S for node in DRIVES):
                moved_s = time.monotonic()
            assert moved_s < begin_s + PATIENCE_S, "they do not stop"
            select.select([], [], [], PERIOD_S)


@contextmanager
def stethoscope(interface: str = "vcan0") -> Iterator[Stethoscope]:
    """One to read with while the ``with`` block lasts."""
    made = Stethoscope(interface)
    try:
        yield made
    finally:
        made.close()


def speed_m_s(node: int, velocity_rpm: int) -> float:
    """Speed of a drive's wheel at its rim."""
    drive = DRIVES[node]
    return abs(velocity_rpm) / 60.0 * tau * drive.wheel_radius_m / drive.total_ratio


def at_rest_after(frames: Sequence[Frame], node: int, since_s: float) -> float:
    """Time from then to the first reading of a drive's velocity from which on it stood [s]."""
    index, sub = VELOCITY
    standing_since_s: float | None = None
    for frame in frames:
        if frame.can_id != 0x580 + node or frame.time_s < since_s or frame.data[1:4] != struct.pack("<HB", index, sub):
            continue
        if speed_m_s(node, _ANSWER.unpack(frame.data)[3]) >= AT_REST_M_S:
            standing_since_s = None
        elif standing_since_s is None:
            standing_since_s = frame.time_s
    assert standing_since_s is not None, f"node {node} never stood"
    return standing_since_s - since_s


def emergencies_after(frames: Sequence[Frame], node: int, since_s: float) -> list[tuple[int, float]]:
    """Codes of a node's emergency messages from then on, and the time from then to each [s]."""
    return [
        (int.from_bytes(frame.data[:2], "little"), frame.time_s - since_s)
        for frame in frames
        if frame.can_id == 0x080 + node and frame.time_s >= since_s
    ]
