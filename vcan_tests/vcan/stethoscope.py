"""Listens to drives whose master has died: asks for their velocities, so that candump's log tells when each stood."""

from __future__ import annotations

import select
import socket
import struct
from collections.abc import Sequence
from contextlib import ExitStack
from math import tau

from drivers.bus.broadcast_manager import RepeatedFrame
from profiles.loader import load
from vcan_tests.kernel.slcan_adapter import CAN_FRAME
from vcan_tests.vcan.witness import Frame

DRIVES = dict(enumerate(load("max2d").profile.drives.values(), start=1))
LIFE_GUARDING = 0x8130
AT_REST_M_S = 0.01
PERIOD_S = 0.01
ANSWER_S = 5.0

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


def read(node: int, address: Address, interface: str = "vcan0") -> int:
    """The value of an object, signed, its unused bytes zero; not beside a daemon that reads, too."""
    with socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW) as asking:
        asking.setsockopt(socket.SOL_CAN_RAW, socket.CAN_RAW_FILTER, struct.pack("=II", 0x580 + node, 0x7FF))
        asking.settimeout(ANSWER_S)
        asking.bind((interface,))
        asking.send(CAN_FRAME.pack(0x600 + node, 8, _REQUEST.pack(_READ, *address)))
        _, *answered, value = _ANSWER.unpack(CAN_FRAME.unpack(asking.recv(CAN_FRAME.size))[2])
    assert tuple(answered) == address
    return int(value)


def listen(for_s: float, interface: str = "vcan0") -> None:
    """Let the kernel ask all drives for their velocities every 10 ms, for a while."""
    with ExitStack() as stack:
        for node in DRIVES:
            request = _REQUEST.pack(_READ, *VELOCITY)
            asking = RepeatedFrame(interface, 0x600 + node, request, PERIOD_S, round(for_s / PERIOD_S))
            stack.callback(asking.close)
            assert asking.start()
        select.select([], [], [], for_s)


def speed_m_s(node: int, velocity_rpm: int) -> float:
    """Speed of a drive's wheel at its rim."""
    drive = DRIVES[node]
    return abs(velocity_rpm) / 60.0 * tau * drive.wheel_radius_m / drive.total_ratio


def stop_s(speed_m_s: float, life_time_s: float) -> float:
    """Time that drives take to stand when their master has died: life time and quick-stop ramp."""
    return life_time_s + speed_m_s / min(drive.quick_stop_m_s2 for drive in DRIVES.values())


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


def life_time_s(frames: Sequence[Frame], node: int, missed_s: float) -> float:
    """Time from a drive's last guarding answer to its emergency message [s]: its life time, and what its twin is late.

    Args:
        frames: of the whole time.
        node: the drive.
        missed_s: when it sent the message.
    """
    return missed_s - max(
        frame.time_s for frame in frames if frame.can_id == 0x700 + node and frame.data and frame.time_s < missed_s
    )


def emergencies_after(frames: Sequence[Frame], node: int, since_s: float) -> list[tuple[int, float]]:
    """Codes of a node's emergency messages from then on, and the time from then to each [s]."""
    return [
        (int.from_bytes(frame.data[:2], "little"), frame.time_s - since_s)
        for frame in frames
        if frame.can_id == 0x080 + node and frame.time_s >= since_s
    ]
