"""What a control cycle costs at least: plain structs over a socket pair, in a loop of its own and on asyncio."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

from benchmarks.cycle_link import make_pair
from benchmarks.cycle_robot import (
    CAN_FRAME,
    DRIVES,
    ENCODERS,
    POSITION,
    RPDO_DRIVE,
    STATUS,
    SYNC,
    TARGET,
    TPDO_ENCODER,
    SocketRobot,
)

PERIOD_S = 0.01
READINGS = len(DRIVES) + len(ENCODERS)
ENABLE_OPERATION = 0x0F
TARGET_RPM = 1000


class PeriodLoop(asyncio.SelectorEventLoop):
    """An event loop whose clock goes on by one period a cycle, and not in between.

    So cycles follow each other as fast as they can, and what is due ten times a second comes each tenth cycle.
    """

    def __init__(self) -> None:
        self.now_s = 1000.0
        super().__init__()

    def time(self) -> float:
        """Seconds; a whole number of periods."""
        return self.now_s


class LoopedCycles:
    """Control cycles on an event loop, one after the other.

    Args:
        tick: begins one: sends SYNC and has it answered.

    Attributes:
        loop: on which they run.
    """

    def __init__(self, tick: Callable[[], None]) -> None:
        self.loop = PeriodLoop()
        self._tick = tick
        self._left = 0

    def run(self, count: int) -> None:
        """So many cycles."""
        self._left = count
        self.loop.call_soon(self._begin)
        self.loop.run_forever()

    def _begin(self) -> None:
        self.loop.now_s += PERIOD_S
        self._tick()

    def ended(self) -> None:
        """A cycle is over."""
        self._left -= 1
        if self._left:
            self.loop.call_soon(self._begin)
        else:
            self.loop.stop()


class _Structs:
    """A master that knows six identifiers and two structs."""

    def __init__(self) -> None:
        self._link, far = make_pair()
        self._robot = SocketRobot(far)
        self._far = far
        self.values: dict[int, tuple[int, ...]] = {}

    def _begin(self) -> None:
        self._link.send(CAN_FRAME.pack(SYNC, 0, b""))
        self._robot.answer()

    def _take(self, packet: bytes) -> None:
        can_id, length, data = CAN_FRAME.unpack(packet)
        kind = STATUS if can_id < TPDO_ENCODER else POSITION
        self.values[can_id] = kind.unpack(data[:length])

    def _end(self) -> None:
        for node in DRIVES:
            data = TARGET.pack(ENABLE_OPERATION, TARGET_RPM)
            self._link.send(CAN_FRAME.pack(RPDO_DRIVE + node, len(data), data))

    def close(self) -> None:
        """Close both ends."""
        self._link.close()
        self._far.close()


class Floor(_Structs):
    """One thread, blocking calls."""

    name, key = "floor: structs, one thread", "floor"

    def run(self, count: int) -> None:
        """So many cycles."""
        link = self._link
        for _ in range(count):
            self._begin()
            for _ in range(READINGS):
                self._take(link.recv(CAN_FRAME.size))
            self._end()


class AsyncioFloor(_Structs):
    """The same on asyncio's event loop, woken by ``add_reader``."""

    name, key = "asyncio floor: the same on add_reader", "asyncio_floor"

    def __init__(self) -> None:
        super().__init__()
        self._link.setblocking(False)
        self._cycles = LoopedCycles(self._begin)
        self._cycles.loop.add_reader(self._link, self._on_readable)
        self._missing = READINGS
        self.run = self._cycles.run

    def _on_readable(self) -> None:
        try:
            while True:
                self._take(self._link.recv(CAN_FRAME.size))
                self._missing -= 1
                if not self._missing:
                    self._end_cycle()
        except BlockingIOError:
            return

    def _end_cycle(self) -> None:
        self._missing = READINGS
        self._end()
        self._cycles.ended()

    def close(self) -> None:
        """Close the loop, too."""
        self._cycles.loop.remove_reader(self._link)
        self._cycles.loop.close()
        super().close()
