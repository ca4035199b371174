"""The life of one robot's daemon: up, through reloads of its profile, to its orderly end."""

from __future__ import annotations

import asyncio
import logging
import signal
from collections.abc import Awaitable, Callable
from pathlib import Path

from canhelm.errors import CanhelmError, Refused
from daemon.app import App
from daemon.runtime.clock import outside_s
from daemon.runtime.notify import ServiceManager
from daemon.runtime.stopping import OFF
from daemon.runtime.vehicle import VehicleState
from drivers.contract import Drive, NodeState
from profiles.kept import keep
from profiles.schema import Profile

LOGGER = logging.getLogger("canhelm")
AT_REST = (VehicleState.WAITING, VehicleState.BOOTING, VehicleState.IDLE)
"""States in which no drive has power and no stop is latched: only then a profile may be exchanged."""


class Life:
    """Runs one daemon after the other, each with a profile of its own, until a signal ends it.

    Args:
        make_app: makes the daemon for a profile. Raises CanhelmError where the profile does not fit the bus.
        load: reads and checks the profile anew. Raises ConfigError.
        manager: who started this process.
        folder: where the profile is kept with which a daemon runs; None for nowhere.

    Attributes:
        app: the daemon that runs now.
    """

    app: App

    def __init__(
        self,
        make_app: Callable[[Profile], App],
        load: Callable[[], Awaitable[Profile]],
        manager: ServiceManager,
        folder: Path | None = None,
    ) -> None:
        self._make_app = make_app
        self._load = load
        self._manager = manager
        self._folder = folder
        self._turn = asyncio.Event()
        self._ending = False
        self._successor: App | None = None
        self._reload: asyncio.Task[None] | None = None

    async def run(self, profile: Profile) -> str:
        """Run until a signal ends it, then go down in order; a second signal does not cut that short.

        Args:
            profile: the robot, to begin with.

        Returns:
            One sentence on how the vehicle was left.
        """
        doubtful: tuple[Drive, ...] = ()
        self._successor = self._make_app(profile)
        while self._successor is not None and not self._ending:
            self.app, self._successor = self._successor, None
            self._turn.clear()
            doubtful = await self._run_app(self.app)
        self._manager.close()
        if self.app.supervisor.bus_missing:
            return f"ended before {self.app.spec} could be opened: no drive was commanded"
        return _farewell(doubtful)

    def end(self) -> None:
        """Go down in order."""
        self._ending = True
        self._manager.stopping("stopping: bringing the vehicle to rest")
        self._turn.set()

    def hang_up(self) -> None:
        """SIGHUP: the terminal is gone, or the service manager asks for a reload; while one runs it means the same."""
        if not self._manager.present:
            self.end()
        elif self._reload is None or self._reload.done():
            self._reload = asyncio.get_running_loop().create_task(self.reload(), name="reload")

    async def reload(self) -> None:
        """Read the profile anew; go on with it where it has no mistake and nothing moves, else as before."""
        self._manager.reloading()
        self._manager.remark = ""
        try:
            self._require_rest()
            profile = await self._load()
            self._require_rest()
            self._successor = self._make_app(profile)
        except CanhelmError as error:
            LOGGER.error("reload refused: %s", error)
            self._manager.remark = f"reload refused: {error}"
        else:
            LOGGER.info("the profile is taken over: the daemon begins anew")
            self._turn.set()
        finally:
            if self._successor is None:
                self._manager.ready()

    def take_over(self, profile: Profile) -> App:
        """Go on with another profile, at rest: the daemon that begins anew with it. Raises as its maker does."""
        self._successor = self._make_app(profile)
        self._turn.set()
        return self._successor

    def _require_rest(self) -> None:
        state = self.app.supervisor.state
        if self._ending:
            raise Refused("the daemon is going down", remedy="start it again")
        if state not in AT_REST:
            raise Refused(
                f"the vehicle's state is {state}", remedy="at rest, switched off and without a fault it works"
            )

    def take_signals(self) -> None:
        """From now on SIGTERM and SIGINT end it, and SIGHUP is :meth:`hang_up`."""
        loop = asyncio.get_running_loop()
        reactions = {signal.SIGTERM: self.end, signal.SIGINT: self.end, signal.SIGHUP: self.hang_up}
        for number, react in reactions.items():
            if signal.getsignal(number) is not signal.SIG_IGN:  # nohup ignores the hang-up of a terminal
                loop.add_signal_handler(number, react)

    async def _run_app(self, app: App) -> tuple[Drive, ...]:
        manager = self._manager
        manager.sentence = lambda: app.service.sentence
        app.cycle.on_good = lambda _: manager.good_cycle(outside_s())
        self._keep(app.profile)
        try:
            await app.start()
            LOGGER.info("robot %s on %s, socket %s", app.profile.name, app.spec, app.server and app.server.path)
            manager.ready()
            await self._turn.wait()
            if self._ending:
                LOGGER.info("going down: stopping the vehicle")
        finally:
            doubtful = await app.close()
        return doubtful

    def _keep(self, profile: Profile) -> None:
        try:
            if self._folder is not None:
                keep(profile, self._folder)
        except OSError as error:
            LOGGER.warning("the profile can't be kept, so a clean-up will read its file: %s", error)


def _farewell(doubtful: tuple[Drive, ...]) -> str:
    if not doubtful:
        return "the vehicle is at rest and its drives are off"
    doubts = ", ".join(map(_doubt, doubtful))
    return f"ended, but {doubts}: make sure yourself that the vehicle is at rest and its drives are off"


def _doubt(drive: Drive) -> str:
    """Why a drive is not known to be at rest and off."""
    who = f"node {drive.node} ({drive.name})" if drive.node else drive.name
    if drive.node_state is not NodeState.READY:
        return f"{who} {'does not answer' if drive.node_state is NodeState.ABSENT else 'is not ready'}"
    if drive.state not in OFF:
        return f"{who} was not seen switched off"
    return f"the wheel of {who} still turns at {drive.speed_m_s:.2f} m/s"
