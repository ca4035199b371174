"""A simulated robot for demos: its daemon and network in one process, booted, counted, and its truth."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable, Sequence
from contextlib import asynccontextmanager
from pathlib import Path

from canhelm.errors import Timeout
from daemon.app import App
from daemon.runtime.vehicle import VehicleState
from drivers.simulated.body import BodyWorld
from profiles.faults import PlacedFault
from profiles.schema import Profile

BOOT_DEADLINE_S = 20.0
RENEWAL_S = 0.5


class DemoRobot:
    """One simulated robot.

    Args:
        profile: with simulation data.
        seed: of everything random in the simulated network.
        record: folder or file for the candump log, or None.
        tell: called with a sentence at each step of the demo.
        watch: called once a control cycle, for a live view.
        bus: ``simulated``, or ``rs232[@BAUD]`` for the same robot behind the serial line of its first drive.
        faults: that strike it.
    """

    def __init__(
        self,
        profile: Profile,
        seed: int,
        record: Path | None,
        tell: Callable[[str], None],
        watch: Callable[[App], None] | None = None,
        bus: str = "simulated",
        faults: Sequence[PlacedFault] = (),
    ) -> None:
        self.app = app = App(profile, bus, seed=seed, record=record, faults=faults)
        if watch is not None:
            app.supervisor.observers.append(lambda: watch(app))
        self.tell = tell

    @property
    def world(self) -> BodyWorld:
        """The truth."""
        assert self.app.network is not None
        return self.app.network.world

    async def boot(self, what: str, where: str = "on a simulated CANopen bus") -> None:
        """Wait until the vehicle is idle; the bus runs already. Raises Timeout."""
        self.tell(f"booting: {what} {where}")
        loop = asyncio.get_running_loop()
        begin_s, ready = loop.time(), loop.create_future()

        def look() -> None:
            if self.app.supervisor.state is VehicleState.IDLE and not ready.done():
                ready.set_result(None)

        self.app.supervisor.observers.append(look)
        try:
            await asyncio.wait_for(ready, BOOT_DEADLINE_S)
        except TimeoutError:
            raise Timeout(f"the simulated robot did not boot: {self.app.supervisor.message}") from None
        finally:
            self.app.supervisor.observers.remove(look)
        self.tell(f"ready after {loop.time() - begin_s:.2f} s")

    @asynccontextmanager
    async def lease(self, client: str) -> AsyncIterator[str]:
        """A lease that is renewed until the end of the context, as a client does it."""
        service = self.app.service
        lease = service.open_lease(client)
        renewing = asyncio.create_task(self._renew(lease))
        try:
            yield lease
        finally:
            renewing.cancel()
            service.close_lease(lease, f"the {client} is over")

    async def _renew(self, lease: str) -> None:
        while True:
            await asyncio.sleep(RENEWAL_S)
            self.app.service.renew_lease(lease)

    def counts(self) -> tuple[int, int, int, float]:
        """Frames, cycles, late cycles and busy time of the bus so far."""
        medium, counters = self.app.medium, self.app.cycle.counters
        assert medium is not None
        return sum(medium.frames.values()), counters.cycles, counters.late_cycles, medium.busy_s
