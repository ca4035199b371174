"""Faults that strike frames on the simulated bus, or requests to a node's SDO server: which, and what they become."""

from __future__ import annotations

import asyncio
import struct
from collections.abc import Callable
from math import inf
from random import Random

from drivers.bus.contract import RTR_FLAG
from drivers.canopen.objects import parse_address
from drivers.simulated.bus import SimulatedBus, SimulatedPort
from profiles.faults import Fault

GENERAL_ERROR = 0x0800_0000
"""SDO abort code of a fault that names none."""
_ABORT = struct.Struct("<B3sI")
_FIRST_PDO, _FIRST_SDO, _BEYOND_SDO = 0x180, 0x580, 0x680
"""Identifiers of the predefined connection set (CiA 301 7.3.5): TPDO1, SDO answers, and behind SDO requests."""
_NODE_MASK = 0x7F
_INITIATING = {0x20: 0xE0, 0x40: 0xE0, 0xA0: 0xE3, 0xC0: 0xE1}
"""Client commands that begin an SDO transfer and name its object, and the bits that tell them (CiA 301 7.2.4.3)."""

Later = Callable[[float, Callable[[], None]], None]


class Choice:
    """Which of the frames or requests that fit are struck.

    Args:
        fault: says so.
        random: of its probability.

    Attributes:
        struck: how many were.
        exhausted: none will be any more.
    """

    def __init__(self, fault: Fault, random: Random) -> None:
        self.struck = 0
        self._fitting = 0
        self._nth = fault.nth
        self._most = inf if fault.times is None else fault.times
        self._probability = fault.probability
        self._random = random

    @property
    def exhausted(self) -> bool:
        """Whether no further one will be struck."""
        return self.struck >= self._most or (self._nth is not None and self._fitting >= self._nth)

    def strikes(self) -> bool:
        """Whether the next one that fits is struck."""
        if self.exhausted:
            return False
        self._fitting += 1
        if self._nth not in (None, self._fitting) or self._random.random() >= self._probability:
            return False
        self.struck += 1
        return True


class FrameFault:
    """A fault that takes frames on their way to everybody.

    Args:
        fault: lose, delay, duplicate, reorder, corrupt, pdo_short, pdo_long or silence.
        node: id of the node that its part has; None without one.
        sender: whose frames only, for silence.
        random: of its choice and of wrong bits.
    """

    def __init__(self, fault: Fault, node: int | None, sender: SimulatedPort | None, random: Random) -> None:
        self.choice = Choice(fault, random)
        self.kind = fault.kind
        self.delay_s = fault.delay_s or 0.0
        self._node = node
        self._sender = sender
        self._can_id = fault.cob_id
        self._object = _multiplexor(fault.object)
        self._random = random
        self._least, self._most = {"corrupt": (1, 8), "pdo_short": (1, 8), "pdo_long": (0, 7)}.get(self.kind, (0, 8))

    def fits(self, can_id: int, data: bytes, sender: SimulatedPort) -> bool:
        """Whether a frame is one of those that the fault is about."""
        number = can_id & 0x7FF
        if self._sender not in (None, sender) or self._can_id not in (None, number):
            return False
        if not self._least <= len(data) <= self._most or not self._is_kind(can_id):
            return False
        if self._node is not None and self._sender is None and not _concerns(self._node, number, data):
            return False
        return self._object is None or (_FIRST_SDO < number < _BEYOND_SDO and data[1:4] == self._object)

    def _is_kind(self, can_id: int) -> bool:
        if self.kind in ("pdo_short", "pdo_long"):
            return _FIRST_PDO < can_id < _FIRST_SDO
        return self.kind != "corrupt" or not can_id & RTR_FLAG

    def arriving(self, data: bytes) -> tuple[bytes, ...]:
        """What arrives at once instead of a frame's data, frame by frame."""
        if self.kind == "duplicate":
            return data, data
        if self.kind == "pdo_short":
            return (data[:-1],)
        if self.kind == "pdo_long":
            return (data + b"\0",)
        return (self._corrupted(data),) if self.kind == "corrupt" else ()

    def _corrupted(self, data: bytes) -> bytes:
        bit = self._random.randrange(8 * len(data))
        return bytes(byte ^ (1 << bit % 8 if index == bit // 8 else 0) for index, byte in enumerate(data))


def _concerns(node: int, number: int, data: bytes) -> bool:
    """Whether a frame is from a node or to it."""
    if number == 0:
        return len(data) == 2 and data[1] == node
    return number & _NODE_MASK == node


def _multiplexor(text: str | None) -> bytes | None:
    """Index and sub-index of an object as SDO frames carry them."""
    address = parse_address(text or "")
    return None if address is None else struct.pack("<HB", *address)


class FrameFaults:
    """Between the bus and everybody on it, as long as a fault wants to see frames.

    Args:
        medium: the bus.
        later: calls back after a time.
        on_frame: called with each frame's number, before it is judged, while :attr:`counting`.

    Attributes:
        counting: a fault waits for a frame.
        frames: counted so far.
    """

    def __init__(self, medium: SimulatedBus, later: Later, on_frame: Callable[[int], None]) -> None:
        self.counting = False
        self.frames = 0
        self._medium = medium
        self._later = later
        self._on_frame = on_frame
        self._acting: list[FrameFault] = []
        self._held: list[Callable[[float], None]] = []

    def add(self, fault: FrameFault) -> None:
        """Let a fault act."""
        self._acting.append(fault)
        self.look()

    def remove(self, fault: FrameFault) -> None:
        """Let it act no more."""
        if fault in self._acting:
            self._acting.remove(fault)
        self.look()

    def look(self) -> None:
        """See every frame while there is a reason to, else none."""
        needed = self.counting or self._acting or self._held
        self._medium.faults = self._take if needed else None

    def _take(self, can_id: int, data: bytes, sender: SimulatedPort, end_s: float) -> bool:
        """Whether a frame arrives as it is; the first fault that strikes it decides."""
        if self.counting:
            self.frames += 1
            self._on_frame(self.frames)
        held, self._held = self._held, []
        striking = next((f for f in self._acting if f.fits(can_id, data, sender) and f.choice.strikes()), None)
        if striking is None and not held:
            return True
        arriving = (data,) if striking is None else striking.arriving(data)
        for altered in arriving:
            self._medium.deliver(can_id, altered, sender, end_s)
        for deliver in held:
            deliver(end_s)
        if striking is not None:
            self._put_off(striking, can_id, data, sender)
            if striking.choice.exhausted:
                self.remove(striking)
        self.look()
        return False

    def _put_off(self, fault: FrameFault, can_id: int, data: bytes, sender: SimulatedPort) -> None:
        """Keep a frame for later, where the fault is of that kind."""

        def deliver(stamp_s: float) -> None:
            self._medium.deliver(can_id, data, sender, stamp_s)

        if fault.kind == "delay":
            self._later(fault.delay_s, lambda: deliver(asyncio.get_running_loop().time()))
        elif fault.kind == "reorder":
            self._held.append(deliver)


class SdoFault:
    """A fault that answers SDO requests in a node's stead.

    Args:
        fault: sdo_abort or sdo_timeout.
        random: of its choice.
    """

    def __init__(self, fault: Fault, random: Random) -> None:
        self.choice = Choice(fault, random)
        self._object = _multiplexor(fault.object)
        self._abort = None if fault.kind == "sdo_timeout" else GENERAL_ERROR if fault.code is None else fault.code

    def strikes(self, request: bytes) -> bool:
        """Whether it strikes a request of 8 bytes."""
        begins = any(request[0] & mask == command for command, mask in _INITIATING.items())
        return begins and self._object in (None, request[1:4]) and self.choice.strikes()

    def answer(self, request: bytes) -> bytes | None:
        """What the node answers to a request that was struck."""
        return None if self._abort is None else _ABORT.pack(0x80, request[1:4], self._abort)


class FaultySdo:
    """Before the SDO server of one node, as long as a fault acts there.

    Args:
        answer: that of the server.
    """

    def __init__(self, answer: Callable[[bytes], bytes | None]) -> None:
        self.acting: list[SdoFault] = []
        self._answer = answer

    def answer(self, request: bytes) -> bytes | None:
        """What is answered to a request; the first fault that strikes it decides."""
        for fault in self.acting:
            if fault.strikes(request):
                return fault.answer(request)
        return self._answer(request)
