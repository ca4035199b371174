"""How often the SocketCAN back end asks its socket for frames, on a socket pair in the place of the kernel's CAN."""

from __future__ import annotations

import asyncio
import socket
import struct
import time
from collections.abc import AsyncIterator
from typing import Any

import pytest

from drivers.bus.socketcan import SocketCanBus
from drivers.bus.socketcan_frames import SO_TIMESTAMPNS, make_frame

pytestmark = pytest.mark.real_time

SLEEPS = 10
"""Turns of the event loop in which a burst has to be taken."""


class CountingEnd(socket.socket):
    """One end of a socket pair, which counts how often it is asked for a frame, and takes no option of CAN's.

    Attributes:
        asked: how often.
        age_s: how long its frames have waited, by the time stamps that it adds.
    """

    def __init__(self, end: socket.socket) -> None:
        super().__init__(end.family, end.type, fileno=end.detach())
        self.asked = 0
        self.age_s = 0.0

    def bind(self, address: Any) -> None:
        """Nothing: it is bound to the other end."""

    def setsockopt(self, level: int, option: int, value: Any) -> None:  # type: ignore[override]
        """Nothing but for the socket itself."""
        if level == socket.SOL_SOCKET:
            super().setsockopt(level, option, value)

    def recvmsg(self, *arguments: int) -> Any:
        """As ever, with a time stamp."""
        self.asked += 1
        packet, _, flags, address = super().recvmsg(*arguments)
        seconds, rest_s = divmod(time.time() - self.age_s, 1.0)
        stamp = struct.pack("@ll", int(seconds), int(rest_s * 1e9))
        return packet, [(socket.SOL_SOCKET, SO_TIMESTAMPNS, stamp)], flags, address


class Line:
    """A bus, the socket that it reads, and the end at which its peer sends; what came, by its identifiers."""

    def __init__(self) -> None:
        near, self.far = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self.near = CountingEnd(near)
        self.bus = SocketCanBus("none0", 1_000_000, lambda: self.near)
        self.came: list[int] = []
        self.bus.receiver = lambda can_id, data, stamp: self.came.append(can_id)

    async def hear(self, *can_ids: int) -> None:
        """Frames come together, and the event loop gets some turns."""
        for can_id in can_ids:
            self.far.send(make_frame(can_id, b""))
        for _ in range(SLEEPS):
            await asyncio.sleep(0)


@pytest.fixture
async def line() -> AsyncIterator[Line]:
    line = Line()
    await line.bus.open()
    yield line
    await line.bus.close()
    line.far.close()


async def test_of_frames_that_come_alone_only_every_second_costs_a_refusal(line: Line) -> None:
    await line.hear(0x181)
    line.near.asked = 0
    for _ in range(20):
        await line.hear(0x181)
    assert len(line.came) == 21
    assert line.near.asked == 30


async def test_a_burst_after_frames_that_came_alone_is_taken_in_a_few_turns_and_in_its_order(line: Line) -> None:
    await line.hear(0x181)
    await line.hear(0x181)
    burst = range(0x100, 0x164)
    await line.hear(*burst)
    assert line.came[2:] == list(burst)


def stand_still(seconds: float) -> None:
    """Keep this process from its event loop."""
    time.sleep(seconds)


async def test_what_waited_while_the_process_stood_still_is_heard_before_any_timer_of_the_pause(line: Line) -> None:
    await line.hear(0x181)
    await line.hear(0x181)
    heard_at_time_out: list[int] = []
    asyncio.get_running_loop().call_later(0.005, lambda: heard_at_time_out.append(len(line.came) - 2))
    line.near.age_s = 0.1
    for can_id in range(0x100, 0x164):
        line.far.send(make_frame(can_id, b""))
    stand_still(0.01)
    await line.hear()
    assert heard_at_time_out == [100]
