"""The bus of a robot that has nothing on CAN."""

from __future__ import annotations

import math

from drivers.bus.contract import Bus


class NoBus(Bus):
    """Nobody is on it; what is sent is gone.

    Args:
        bit_rate: of the profile, for what reckons with it.
    """

    def __init__(self, bit_rate: int) -> None:
        super().__init__("none", bit_rate)

    async def open(self) -> None:
        """Nothing to open."""

    def send(self, can_id: int, data: bytes = b"", deadline_s: float = math.inf) -> None:
        """Nobody hears it."""

    def load(self) -> float:
        """Always 0."""
        return 0.0

    async def close(self) -> None:
        """Nothing to close."""
