"""Writes objects to a node and proves by reading back that they are there."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

from canhelm.errors import Refused
from drivers.canopen.objects import ObjectDef
from drivers.canopen.pacing import Pacing
from drivers.canopen.sdo import SdoClient

DIFFERS = "switch the device off and on; if it happens again, check its type and firmware"


class Difference(NamedTuple):
    """An object whose value is not the expected one."""

    entry: ObjectDef
    found: int
    expected: int

    def __str__(self) -> str:
        return f"{self.entry.address} ({self.entry.name}) is {_words(self.found)}, expected {_words(self.expected)}"


class Configuration:
    """One attempt to configure a node.

    Args:
        sdo: the node's client.
        who: the node for people.
        pacing: when its transfers may begin.

    Attributes:
        written: last value written to each object.
    """

    def __init__(self, sdo: SdoClient, who: str, pacing: Pacing) -> None:
        self.written: dict[ObjectDef, int] = {}
        self._sdo = sdo
        self._who = who
        self._pacing = pacing

    async def write(self, settings: Iterable[tuple[ObjectDef, int]]) -> None:
        """Write values in their order. Raises NodeAbsent, Timeout or Aborted."""
        for entry, value in settings:
            await self._pacing.give_way()
            await self._sdo.write(entry, value)
            self.written[entry] = value

    async def expect(self, entry: ObjectDef, expected: int, remedy: str, mask: int = -1) -> None:
        """Read one object and compare it under a mask. Raises Refused where it differs."""
        await self._pacing.give_way()
        found = await self._sdo.read_int(entry)
        if found & mask != expected & mask:
            raise Refused(
                f"{self._who}: {Difference(entry, found, expected)}",
                node=self._sdo.node,
                object=entry.address,
                value=found,
                limit=expected,
                remedy=remedy,
            )

    async def differences(self, settings: Iterable[tuple[ObjectDef, int]]) -> list[Difference]:
        """Read objects and tell which differ. Raises NodeAbsent, Timeout, Aborted or DeviceFault."""
        different: list[Difference] = []
        for entry, expected in settings:
            await self._pacing.give_way()
            found = await self._sdo.read_int(entry)
            if found != expected:
                different.append(Difference(entry, found, expected))
        return different

    async def verify(self) -> None:
        """Read everything back that was written. Raises Refused at the first object that differs."""
        for entry, expected in self.written.items():
            await self.expect(entry, expected, DIFFERS)


def _words(value: int) -> str:
    return f"{value} (0x{value:X})" if value > 9 else str(value)
