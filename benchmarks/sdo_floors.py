"""What an expedited SDO upload costs at least: structs over a socket pair, and a future with a time-out on asyncio."""

from __future__ import annotations

import asyncio
import socket
import struct

from benchmarks.cycle_link import make_pair
from benchmarks.cycle_robot import CAN_FRAME

NODE = 1
REQUEST_ID, ANSWER_ID = 0x600 + NODE, 0x580 + NODE
INDEX, VALUE = 0x6041, 0x0137
"""The statusword, 16 bits."""
TIMEOUT_S = 0.5
_TRANSFER = struct.Struct("<BHBI")
_UPLOAD, _ANSWER = 0x40, 0x4B


class StructServer:
    """Answers each upload with the same value.

    Args:
        link: its end of a socket pair.
    """

    def __init__(self, link: socket.socket) -> None:
        self._link = link

    def answer(self) -> None:
        """Take one request and answer it."""
        _, _, request = CAN_FRAME.unpack(self._link.recv(CAN_FRAME.size))
        _, index, sub, _ = _TRANSFER.unpack(request)
        self._link.send(CAN_FRAME.pack(ANSWER_ID, 8, _TRANSFER.pack(_ANSWER, index, sub, VALUE)))


def make_request() -> bytes:
    """The frame that asks for the statusword."""
    return CAN_FRAME.pack(REQUEST_ID, 8, _TRANSFER.pack(_UPLOAD, INDEX, 0, 0))


def value_of(packet: bytes) -> int:
    """What an answer says; raises ValueError where it answers something else."""
    can_id, _, data = CAN_FRAME.unpack(packet)
    command, index, _, value = _TRANSFER.unpack(data)
    if (can_id, command, index) != (ANSWER_ID, _ANSWER, INDEX):
        raise ValueError(f"no answer: {packet.hex()}")
    return int(value)


class SdoFloor:
    """One thread, blocking calls."""

    name, key = "floor: structs, one thread", "floor"

    def __init__(self) -> None:
        self._link, self._far = make_pair()
        self._server = StructServer(self._far)

    def run(self, count: int) -> None:
        """So many uploads."""
        for _ in range(count):
            self._link.send(make_request())
            self._server.answer()
            value_of(self._link.recv(CAN_FRAME.size))

    def close(self) -> None:
        """Close both ends."""
        self._link.close()
        self._far.close()


class SdoAsyncioFloor(SdoFloor):
    """A future with a time-out, and two ``add_reader``."""

    name, key = "asyncio floor: future, time-out, two add_reader", "asyncio_floor"

    def __init__(self) -> None:
        super().__init__()
        self._runner = asyncio.Runner()
        self._loop = self._runner.get_loop()
        self._loop.add_reader(self._link, self._on_readable)
        self._loop.add_reader(self._far, self._server.answer)
        self._waiter: asyncio.Future[int] | None = None

    def _on_readable(self) -> None:
        value = value_of(self._link.recv(CAN_FRAME.size))
        if self._waiter is not None and not self._waiter.done():
            self._waiter.set_result(value)

    async def _upload(self) -> int:
        waiter = self._waiter = self._loop.create_future()
        timer = self._loop.call_later(TIMEOUT_S, waiter.cancel)
        self._link.send(make_request())
        try:
            value: int = await waiter
            return value
        finally:
            timer.cancel()

    async def _uploads(self, count: int) -> None:
        for _ in range(count):
            await self._upload()

    def run(self, count: int) -> None:
        """So many uploads."""
        self._runner.run(self._uploads(count))

    def close(self) -> None:
        """Close the loop, too."""
        self._loop.remove_reader(self._link)
        self._loop.remove_reader(self._far)
        self._runner.close()
        super().close()
