"""Paces the configuration of nodes, so that it leaves room on the wire.

Of the frames that wait, the lowest identifier goes first: SDO before guarding and boot-up messages, low node ids before
high ones. Many nodes that are configured as fast as they answer fill the wire with SDO; then guarded nodes miss their
guarding, and those with high ids their time-out.
"""

from __future__ import annotations

import asyncio

NODES_AT_ONCE = 4
"""Where PDOs leave little of the wire, so many wait for each other, and none as long as its time-out."""
PACE_BITS = 340
"""Bit times from one transfer to the next: its two frames take up to 270, so a fifth of the wire stays free."""


class Pacing:
    """When the transfers may begin that configure the nodes of one bus.

    Args:
        bit_rate: bit/s.

    Attributes:
        turns: each node holds one while it is configured.
    """

    def __init__(self, bit_rate: int) -> None:
        self.turns = asyncio.Semaphore(NODES_AT_ONCE)
        self._pace_s = PACE_BITS / bit_rate
        self._free_s = 0.0
        self._guarding: set[int] = set()
        self._guarded = asyncio.Event()
        self._guarded.set()

    def guard_asked(self, node: int) -> None:
        """A guard request goes to a node; no transfer begins before :meth:`guard_over`."""
        self._guarding.add(node)
        self._guarded.clear()

    def guard_over(self, node: int) -> None:
        """The node has answered, or no answer is awaited any more."""
        self._guarding.discard(node)
        if not self._guarding:
            self._guarded.set()

    async def give_way(self) -> None:
        """Return when the next transfer may begin."""
        now = asyncio.get_running_loop().time()
        begin_s = max(now, self._free_s)
        self._free_s = begin_s + self._pace_s
        await asyncio.sleep(begin_s - now)
        await self._guarded.wait()
