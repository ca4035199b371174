"""Gathers the frames of a bus for all who record them: each frame is packed once, however many they are."""

from __future__ import annotations

from collections.abc import Callable

from drivers.bus.candump import pack_frame
from drivers.bus.contract import Bus

WAITING_BYTES = 10_000
"""Of packed frames that may wait until somebody asks; so many wait for nobody."""

TakeFrames = Callable[[bytearray], None]
"""Takes frames packed by :func:`drivers.bus.candump.pack_frame`, in the order of the wire; changes nothing in them."""


class Gathering:
    """Listens to a bus while somebody records it.

    Args:
        bus: the interface.
    """

    def __init__(self, bus: Bus) -> None:
        self.bus = bus
        self._frames = bytearray()
        self._takers: list[TakeFrames] = []

    def join(self, taker: TakeFrames) -> None:
        """Give every frame from now on to one more."""
        self.hand_out()
        if not self._takers:
            self.bus.taps.append(self._on_frame)
        self._takers.append(taker)

    def leave(self, taker: TakeFrames) -> None:
        """Give what is left to one of them, and then nothing more."""
        self.hand_out()
        self._takers.remove(taker)
        if not self._takers:
            self.bus.taps.remove(self._on_frame)

    def hand_out(self) -> None:
        """Give the frames since the last time to all."""
        if self._frames:
            frames, self._frames = self._frames, bytearray()
            for taker in self._takers:
                taker(frames)

    def _on_frame(self, can_id: int, data: bytes, timestamp_s: float) -> None:
        self._frames += pack_frame(timestamp_s, can_id, len(data), data)
        if len(self._frames) > WAITING_BYTES:
            self.hand_out()
