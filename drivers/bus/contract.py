"""What every CAN back end offers: the bus contract.

A frame on the hot path is no object: it is ``(can_id, data, timestamp_s)``. ``can_id`` is the 11-bit identifier with
the flags of SocketCAN above it (:data:`RTR_FLAG` for a remote frame, whose ``data`` is empty). Timestamps are seconds
on the running loop's clock (``loop.time()``).
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Collection
from dataclasses import dataclass
from typing import Any

from canhelm.errors import BusOff

RTR_FLAG = 0x4000_0000
ID_MASK = 0x7FF

FrameHandler = Callable[[int, bytes, float], None]


@dataclass(slots=True)
class BusCounters:
    """What went over one interface since it was opened."""

    received: int = 0
    sent: int = 0
    dropped_stale: int = 0
    """Frames whose deadline had passed before they reached the wire: dropped, never sent late."""
    dropped_full: int = 0
    """Frames refused because the transmit queue was full."""
    error_frames: int = 0
    """Error frames seen: disturbances, bad wiring, or a node with another bit rate."""


class Bus(ABC):
    """One CAN interface.

    Attributes:
        name: the interface's name as it stands in logs (``vcan0``).
        bit_rate: bit/s.
        receiver: called with every frame that another participant sent; set by the one owner of the interface.
        on_silent: told of a node whose silence is certain, because who forwards to it waited for it in vain.
        taps: called with every frame, received or sent by this interface, in wire order (recorder, monitor).
        counters: what went over the interface.
        down: why the interface does not work at the moment; None while it does.
    """

    def __init__(self, name: str, bit_rate: int) -> None:
        self.name = name
        self.bit_rate = bit_rate
        self.receiver: FrameHandler | None = None
        self.on_silent: Callable[[int], None] | None = None
        self.taps: list[FrameHandler] = []
        self.counters = BusCounters()
        self.down: str | None = None

    @property
    def trouble(self) -> BusOff | None:
        """Why the interface does not work, with what mends it; None while it does."""
        return BusOff(f"{self.name} does not work: {self.down}", remedy=self.remedy()) if self.down else None

    def remedy(self) -> str:
        """What mends an interface that is down."""
        return ""

    @abstractmethod
    async def open(self) -> None:
        """Open the interface on the running loop. Raises BusOff where it is down or missing."""

    @abstractmethod
    def send(self, can_id: int, data: bytes = b"", deadline_s: float = math.inf) -> None:
        """Queue one frame for sending; returns at once and never blocks.

        Args:
            can_id: 11-bit identifier, with :data:`RTR_FLAG` for a remote frame.
            data: 0 to 8 bytes.
            deadline_s: loop time after which the frame is worthless: it is then dropped and counted.
        """

    def needs(self, can_ids: Collection[int]) -> None:
        """Tell which identifiers the receiver needs, so that a back end which can keeps others away from it.

        Args:
            can_ids: 11-bit identifiers of data and remote frames alike. It is looked into later, too, so it may grow;
                call this again when it has.
        """

    @abstractmethod
    def load(self) -> float:
        """Share of the last second that the wire was busy, 0 to 1."""

    def details(self) -> dict[str, Any]:
        """What else there is to tell of the interface, for ``status``; keys carry units."""
        return {}

    @abstractmethod
    async def close(self) -> None:
        """Close the interface; what is still queued is dropped."""
