"""A host on the serial line of a simulated EPOS that knows the handshake and nothing else."""

from __future__ import annotations

import asyncio

from drivers.epos.serial_answers import Answer, parse_answer
from drivers.epos.serial_frames import FAILED, OKAY, UNANSWERED, Frame, frame_size, make_read_object, parse_frame
from drivers.simulated.bus import SimulatedBus
from drivers.simulated.network import SimulatedNetwork
from drivers.simulated.serial import EposTiming, SimulatedSerial
from drivers.simulated.serial_wire import QUIET, SerialNoise
from profiles.loader import load
from vcan_tests.drivers.epos_bench import RawMaster

PROFILE = load("max2d").profile
BOOTED_S = 0.2
USUAL = EposTiming()
OK, FAIL = bytes((OKAY,)), bytes((FAILED,))
STATUSWORD = make_read_object(1, 0x6041, 0)
ENCODER_POSITION = make_read_object(5, 0x6004, 0)


class Silence(Exception):
    """The drive says nothing."""


class SerialBench:
    """The network of the MAX2D with a host on the serial line of node 1.

    Attributes:
        bus: a participant that hears all frames on the CAN bus.
        heard: bytes that the host has got and not taken yet.
        last_s: time at which the last byte came.
    """

    def __init__(
        self, baud: int = 115200, timing: EposTiming = USUAL, noise: SerialNoise = QUIET, seed: int = 1
    ) -> None:
        medium = SimulatedBus()
        self.network = SimulatedNetwork(PROFILE, medium, seed=1)
        self.bus = RawMaster(medium)
        self.node = self.network.node(1)
        self.serial = SimulatedSerial(self.node, baud, timing, noise, seed)
        self.serial.cable.host = self._hear
        self.heard = bytearray()
        self.last_s = 0.0
        self._more = asyncio.Event()

    @classmethod
    async def booted(
        cls, baud: int = 115200, timing: EposTiming = USUAL, noise: SerialNoise = QUIET, seed: int = 1
    ) -> SerialBench:
        """A bench whose network has power and has booted."""
        bench = cls(baud, timing, noise, seed)
        bench.network.power_on()
        await asyncio.sleep(BOOTED_S)
        bench.bus.heard.clear()
        return bench

    def _hear(self, data: bytes, end_s: float) -> None:
        self.heard += data
        self.last_s = end_s
        self._more.set()

    def write(self, data: bytes) -> None:
        """Write bytes without waiting for anything."""
        self.serial.cable.write(data)

    async def take(self, count: int, limit_s: float = 1.0) -> bytes:
        """The next ``count`` bytes. Raises Silence where they do not come."""
        while len(self.heard) < count:
            self._more.clear()
            try:
                await asyncio.wait_for(self._more.wait(), limit_s)
            except TimeoutError:
                raise Silence(bytes(self.heard).hex()) from None
        taken = bytes(self.heard[:count])
        del self.heard[:count]
        return taken

    async def request(self, frame: bytes) -> bytes:
        """Send a request; the acknowledges of operation code and frame."""
        self.write(frame[:1])
        ready = await self.take(1)
        if ready == FAIL:
            return ready
        self.write(frame[1:])
        return ready + await self.take(1)

    async def exchange(self, frame: bytes) -> bytes:
        """Send a request that must go well; the bytes of the answer, nothing for a request without one."""
        assert await self.request(frame) == OK + OK
        if frame[0] in UNANSWERED:
            return b""
        assert await self.take(1) == b"\0"
        self.write(OK)
        length = await self.take(1)
        rest = await self.take(frame_size(length[0]) - 2)
        self.write(OK)
        await asyncio.sleep(0.001)
        return b"\0" + length + rest

    async def ask(self, frame: bytes) -> Answer:
        """Send a request that must go well; what its answer says."""
        raw = await self.exchange(frame)
        checked = parse_frame(raw)
        assert isinstance(checked, Frame)
        answer = parse_answer(frame, checked)
        assert isinstance(answer, Answer)
        return answer
