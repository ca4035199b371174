"""Frames that an interface has no room for."""

from __future__ import annotations

import asyncio
import math

from drivers.bus.contract import RTR_FLAG, BusCounters
from drivers.bus.transmit_queue import QUEUE_DEPTH, RETRY_S, TransmitQueue


class Interface:
    """Takes frames while it has room; ``breaks`` makes it vanish with the next one."""

    def __init__(self) -> None:
        self.counters = BusCounters()
        self.queue = TransmitQueue(self._take, self.counters)
        self.queue.open()
        self.room = math.inf
        self.breaks = False
        self.sent: list[int] = []
        self.data: list[bytes] = []

    def _take(self, can_id: int, data: bytes) -> bool:
        if self.breaks:
            self.queue.close()
            return False
        if self.room < 1:
            return False
        self.room -= 1
        self.sent.append(can_id)
        self.data.append(data)
        return True

    def send(self, *can_ids: int, deadline_s: float = math.inf) -> None:
        for can_id in can_ids:
            self.queue.send(can_id, b"", deadline_s)


async def test_a_frame_that_fits_goes_out_at_once() -> None:
    interface = Interface()
    interface.send(0x201)
    assert interface.sent == [0x201]


async def test_frames_wait_for_room_most_urgent_first_and_data_before_remote() -> None:
    interface = Interface()
    interface.room = 0
    interface.send(0x203, 0x201 | RTR_FLAG, 0x201, 0x202)
    interface.room = 3
    await asyncio.sleep(1.5 * RETRY_S)
    assert interface.sent == [0x201, 0x201 | RTR_FLAG, 0x202]


async def test_frames_of_one_identifier_keep_their_order() -> None:
    interface = Interface()
    interface.room = 0
    for number in range(3):
        interface.queue.send(0x201, bytes([number]), math.inf)
    interface.room = 3
    await asyncio.sleep(1.5 * RETRY_S)
    assert interface.data == [b"\0", b"\1", b"\2"]


async def test_a_frame_whose_deadline_passes_is_dropped_and_counted() -> None:
    interface = Interface()
    interface.room = 0
    interface.send(0x201, deadline_s=asyncio.get_running_loop().time() + 2.5 * RETRY_S)
    interface.send(0x202)
    await asyncio.sleep(3.5 * RETRY_S)
    interface.room = math.inf
    await asyncio.sleep(RETRY_S)
    assert (interface.sent, interface.counters.dropped_stale) == ([0x202], 1)


async def test_a_full_queue_refuses_more() -> None:
    interface = Interface()
    interface.room = 0
    interface.send(*[0x201] * (QUEUE_DEPTH + 3))
    assert interface.counters.dropped_full == 3


async def test_stale_frames_make_room_in_a_full_queue() -> None:
    interface = Interface()
    interface.room = 0
    interface.send(*[0x201] * QUEUE_DEPTH, deadline_s=asyncio.get_running_loop().time() - 1.0)
    interface.send(0x202)
    assert (interface.counters.dropped_stale, interface.counters.dropped_full) == (QUEUE_DEPTH, 0)


async def test_an_interface_that_vanishes_takes_along_what_waits_and_what_comes() -> None:
    interface = Interface()
    interface.room = 0
    interface.send(0x201, 0x202)
    interface.breaks = True
    await asyncio.sleep(1.5 * RETRY_S)
    interface.send(0x203)
    assert (interface.sent, interface.counters.dropped_stale) == ([], 3)


async def test_a_frame_during_which_the_interface_vanishes_is_counted() -> None:
    interface = Interface()
    interface.breaks = True
    interface.send(0x201)
    assert interface.counters.dropped_stale == 1
