"""The same upload with python-canopen and canopen-asyncio: a remote node asks a local one over a virtual bus."""

from __future__ import annotations

import asyncio
from types import ModuleType
from typing import Any

import canopen
import canopen_asyncio

from benchmarks.sdo_floors import INDEX, NODE, VALUE

NAME = "Statusword"


class _Pair:
    """A client and a server of one library, each with a network of its own.

    Args:
        library: ``canopen`` or ``canopen_asyncio``.
        channel: of the virtual bus.
    """

    def __init__(self, library: ModuleType, channel: str) -> None:
        self._library = library
        self._networks: list[Any] = [library.Network(), library.Network()]
        for network in self._networks:
            network.connect(channel=channel, interface="virtual")
        self.remote = library.RemoteNode(NODE, self._dictionary())
        local = library.LocalNode(NODE, self._dictionary())
        self._networks[0][NODE], self._networks[1][NODE] = self.remote, local
        local.set_data(INDEX, 0, VALUE.to_bytes(2, "little"))

    def _dictionary(self) -> Any:
        od = self._library.objectdictionary
        dictionary = od.ObjectDictionary()
        variable = od.ODVariable(NAME, INDEX)
        variable.data_type = od.UNSIGNED16
        dictionary.add_object(variable)
        return dictionary

    def close(self) -> None:
        """Leave the bus."""
        for network in self._networks:
            network.disconnect()


class SdoPythonCanopen:
    """python-canopen, by name."""

    name, key = "python-canopen, by name", "python_canopen"

    def __init__(self) -> None:
        self._pair = _Pair(canopen, "bench-sdo-canopen")
        self.close = self._pair.close

    def run(self, count: int) -> None:
        """So many uploads."""
        for _ in range(count):
            assert self._pair.remote.sdo[NAME].raw == VALUE


class SdoCanopenAsyncio:
    """canopen-asyncio, by name."""

    name, key = "canopen-asyncio, by name", "canopen_asyncio"

    def __init__(self) -> None:
        self._runner = asyncio.Runner()
        self._pair = _Pair(canopen_asyncio, "bench-sdo-canopen-asyncio")

    def run(self, count: int) -> None:
        """So many uploads."""
        self._runner.run(self._uploads(count))

    async def _uploads(self, count: int) -> None:
        for _ in range(count):
            assert await self._pair.remote.sdo[NAME].aget_raw() == VALUE

    def close(self) -> None:
        """Leave the bus and close the loop."""
        self._pair.close()
        self._runner.close()
