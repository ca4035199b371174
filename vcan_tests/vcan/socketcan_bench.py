"""SocketCAN back ends on the kernel's interfaces, a witness of their frames, and what a test does to either."""

from __future__ import annotations

import asyncio
import contextlib
import subprocess
import time
from collections.abc import AsyncIterator, Callable

from drivers.bus.socketcan import SocketCanBus

BIT_RATE = 1_000_000
PERIOD_S = 0.01


@contextlib.asynccontextmanager
async def opened(channel: str = "vcan0") -> AsyncIterator[SocketCanBus]:
    bus = SocketCanBus(channel, BIT_RATE)
    await bus.open()
    try:
        yield bus
    finally:
        await bus.close()


class Witness:
    """Sees everything on an interface, with the kernel's times."""

    def __init__(self, bus: SocketCanBus) -> None:
        self.frames: list[tuple[int, bytes]] = []
        self.stamps: list[float] = []
        bus.taps.append(self._see)

    def _see(self, can_id: int, data: bytes, stamp: float) -> None:
        self.frames.append((can_id, data))
        self.stamps.append(stamp)

    @property
    def ids(self) -> list[int]:
        """Identifiers in the order of the wire."""
        return [can_id for can_id, _ in self.frames]


def ip(*arguments: str) -> None:
    subprocess.run(["ip", *arguments], check=True)


def stand_still(seconds: float) -> None:
    """Keep this process busy, its loop included."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        pass


async def until(condition: Callable[[], object], within_s: float = 10.0) -> None:
    """Wait for what comes from other processes and from the kernel."""
    for _ in range(round(within_s / 0.005)):
        if condition():
            return
        await asyncio.sleep(0.005)
    raise AssertionError("nothing came of it")
