"""A whole simulated robot for tests: daemon and network in one process, on virtual time, healthy at its end."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

from canhelm.errors import CanhelmError
from daemon.app import App
from daemon.runs.store import RunStore
from drivers.contract import BrakeState
from drivers.simulated.network import SimulatedNetwork
from profiles.loader import load
from profiles.schema import Profile


class Robot:
    """One robot under test, driven as a client drives it.

    Attributes:
        app: its daemon.
        network: its simulated network, with the truth in ``network.world``.
    """

    def __init__(self, app: App) -> None:
        assert app.network is not None
        self.app = app
        self.network: SimulatedNetwork = app.network
        self.lease: str | None = None
        self._renewing: asyncio.Task[None] | None = None

    async def call(self, method: str, /, **params: Any) -> dict[str, Any]:
        """One method of the API, with a lease that is kept alive."""
        if self.lease is None:
            self.lease = self.app.service.open_lease("test")
            self._renewing = asyncio.create_task(self._renew(self.lease))
        return await self.app.service.call(method, params, self.lease)

    def begin(self, method: str, /, **params: Any) -> asyncio.Task[Any]:
        """A command of a client that takes its answer, error or not, for what it is."""

        async def ask() -> dict[str, Any] | CanhelmError:
            try:
                return await self.call(method, **params)
            except CanhelmError as error:
                return error

        return asyncio.create_task(ask())

    async def _renew(self, lease: str) -> None:
        while True:
            await asyncio.sleep(0.5)
            self.app.service.renew_lease(lease)

    async def fall_silent(self) -> None:
        """Renew no more, as a client that hangs or is suspended."""
        await self.hang_up()

    async def hang_up(self) -> None:
        """Stop renewing the lease."""
        if self._renewing is not None:
            self._renewing.cancel()
            await asyncio.wait([self._renewing])
            self._renewing = None

    async def until(self, condition: Callable[[], bool], timeout_s: float = 30.0) -> float:
        """Wait until a condition holds, looked at once a control cycle; returns the time it took [s]."""
        loop = asyncio.get_running_loop()
        begin, reached = loop.time(), loop.create_future()

        def look() -> None:
            if condition() and not reached.done():
                reached.set_result(None)

        self.app.supervisor.observers.append(look)
        try:
            await asyncio.wait_for(reached, timeout_s)
        finally:
            self.app.supervisor.observers.remove(look)
        return loop.time() - begin

    def is_ready(self) -> bool:
        """Whether everything can be commanded."""
        loose = (BrakeState.UNKNOWN, BrakeState.ENGAGING)
        return self.state == "idle" and not any(b.state in loose for b in self.app.devices.brakes.values())

    @property
    def state(self) -> str:
        """The vehicle's state."""
        return self.app.service.state

    @property
    def speed_m_s(self) -> float:
        """True speed of the robot's centre."""
        self.network.world.advance(asyncio.get_running_loop().time())
        vx, vy, _ = self.network.world.velocity
        return float((vx * vx + vy * vy) ** 0.5)

    @property
    def fastest_wheel_m_s(self) -> float:
        """Largest true rim speed of any wheel."""
        now = asyncio.get_running_loop().time()
        self.network.world.advance(now)
        profile = self.app.profile
        return max(
            abs(axis.speed_rad_s) / profile.drives[name].total_ratio * profile.drives[name].wheel_radius_m
            for name, axis in self.network.world.axes.items()
        )


@asynccontextmanager
async def running_robot(
    profile: Profile | None = None,
    *,
    bus: str = "simulated",
    seed: int = 1,
    record: Path | None = None,
    runs: RunStore | None = None,
    built: Profile | None = None,
    powered: bool = True,
    booted: bool = True,
    expect_errors: bool = False,
    socket: Path | None = None,
) -> AsyncIterator[Robot]:
    """A robot that has booted; asserts health at its end unless errors are expected.

    Args:
        bus: the SPEC of the wire.
        booted: wait until it is idle, its steering brakes known to be engaged.
        socket: where clients reach it; the loop has to serve sockets.
        expect_errors: the test breaks something; logged errors and faults are its subject.
    """
    handler = _Collector()
    logging.getLogger().addHandler(handler)
    model = profile or load("max2d").profile
    app = App(model, bus, socket=socket, seed=seed, record=record, powered=powered, runs=runs, built=built)
    robot = Robot(app)
    before = asyncio.all_tasks()
    await app.start()
    try:
        if booted:
            await robot.until(robot.is_ready)
        yield robot
    finally:
        await robot.hang_up()
        await app.close()
        logging.getLogger().removeHandler(handler)
    leaked = asyncio.all_tasks() - before
    assert not leaked, f"tasks left over: {leaked}"
    counters = app.master.counters
    assert app.bus.counters.dropped_full == 0
    assert counters.malformed == 0 or expect_errors, counters
    if not expect_errors:
        assert handler.errors == []
        assert app.bus.counters.dropped_stale == 0
        assert all(device.fault is None for device in app.devices.by_node.values())


class _Collector(logging.Handler):
    def __init__(self) -> None:
        super().__init__(logging.ERROR)
        self.errors: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        self.errors.append(record.getMessage())
