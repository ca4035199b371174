"""A Bluetooth connection to the simulated brick inside this process."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

from canhelm.errors import BusOff
from drivers.simulated.nxt import SimulatedNxt
from drivers.simulated.serial_wire import SerialCable


class LinkEnd:
    """The host's end of one connection.

    Attributes:
        host: takes what the brick sends.
    """

    def __init__(self, cable: SerialCable) -> None:
        self._cable: SerialCable | None = cable

    @property
    def host(self) -> Callable[[bytes, float], None] | None:
        """Takes what the brick sends."""
        return None if self._cable is None else self._cable.host

    @host.setter
    def host(self, host: Callable[[bytes, float], None] | None) -> None:
        if self._cable is not None:
            self._cable.host = host

    def write(self, data: bytes) -> None:
        """Send bytes; closed, they are lost."""
        if self._cable is not None:
            self._cable.write(data)

    def close(self) -> None:
        """End the connection; what is under way to either side is lost."""
        if self._cable is not None:
            self._cable.host = None
            self._cable.to_host.clear()
            self._cable.to_device.clear()
            self._cable = None


class SimulatedLink:
    """Makes connections to one brick, and breaks them.

    Args:
        brick: the brick.

    Attributes:
        reachable: set it to False to let nobody connect.
    """

    def __init__(self, brick: SimulatedNxt) -> None:
        self.reachable = True
        self._brick = brick
        self._end: LinkEnd | None = None
        self._on_lost: Callable[[str], None] | None = None

    def connect(self, on_lost: Callable[[str], None]) -> LinkEnd:
        """A new connection. Raises BusOff where the brick is not reachable."""
        if not self.reachable:
            raise BusOff("no brick in reach", remedy="switch the brick on")
        self._end, self._on_lost = LinkEnd(self._brick.cable), on_lost
        return self._end

    def drop(self, reason: str = "out of reach") -> None:
        """Break the connection; the motors do what they were told last."""
        if self._end is not None and self._on_lost is not None:
            self._end.close()
            asyncio.get_running_loop().call_soon(self._on_lost, reason)
            self._end = None
