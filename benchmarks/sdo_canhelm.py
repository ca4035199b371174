"""canhelm's SDO upload: its own back end, master and client, over a socket pair."""

from __future__ import annotations

import asyncio

import msgspec

from benchmarks.cycle_link import Link, make_pair
from benchmarks.sdo_floors import NODE, VALUE, StructServer
from drivers.bus.socketcan import SocketCanBus
from drivers.canopen.master import Master
from drivers.epos.objects import OBJECTS
from profiles.loader import load

STATUSWORD = OBJECTS["statusword"]
PATIENCE_S = 10.0
"""A machine that stands still for a while is no node that does not answer."""


class SdoCanhelm:
    """The statusword as a number."""

    name, key = "canhelm", "canhelm"

    def __init__(self) -> None:
        self.runner = asyncio.Runner()
        end, self._far = make_pair()
        network = msgspec.structs.replace(load("max2d").profile.network, sdo_timeout_s=PATIENCE_S)
        self._master = Master(SocketCanBus("bench1", network.bit_rate, lambda: Link(end, self._far)), network)
        self.client = self._master.sdo(NODE)
        self.runner.run(self._master.start())
        self.runner.get_loop().add_reader(self._far, StructServer(self._far).answer)

    def run(self, count: int) -> None:
        """So many uploads."""
        self.runner.run(self._uploads(count))

    async def _uploads(self, count: int) -> None:
        for _ in range(count):
            assert await self.client.read_int(STATUSWORD) == VALUE

    def close(self) -> None:
        """Close bus, loop and both ends."""
        self.runner.get_loop().remove_reader(self._far)
        self.runner.run(self._master.close())
        self.runner.close()
        self._far.close()
