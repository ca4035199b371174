"""The ``setup.*`` methods: a commissioning has the robot to itself, and the daemon puts back what it lowers."""

from __future__ import annotations

import asyncio
from typing import Any

from canhelm.errors import CanhelmError, NodeAbsent, Refused
from daemon.runtime.handlers import Handler, Params
from daemon.runtime.interlocks import require_all_disabled
from daemon.runtime.supervisor import Supervisor
from drivers.canopen.objects import ObjectDef
from drivers.contract import DriveState
from drivers.epos.drive import EposDrive
from drivers.epos.objects import OBJECTS

LIMITS = (OBJECTS["continuous_current_limit"], OBJECTS["output_current_limit"])


class SetupCommands:
    """Handlers of ``setup.*``, by name in :attr:`handlers`.

    The lowered limits belong to the daemon: they come back when the lease of the setup is over, however its client
    went, and when the daemon goes down. A drive that cannot be reached gets its profile's limits at its next boot-up.

    Args:
        supervisor: what decides.
    """

    def __init__(self, supervisor: Supervisor) -> None:
        self._supervisor = supervisor
        self._lowered: dict[tuple[EposDrive, ObjectDef], int] = {}
        self._writing = asyncio.Lock()
        supervisor.on_lease_end.append(self._on_lease_end)
        supervisor.at_end.append(self._finish)
        self.handlers: dict[str, Handler] = {
            "setup.begin": self._begin,
            "setup.lower": self._lower,
            "setup.restore": self._restore,
            "setup.end": self._end,
        }

    async def _begin(self, params: Params, lease: str | None) -> dict[str, Any]:
        if lease is None or lease != self._supervisor.setup_lease:
            require_all_disabled(self._supervisor)
        self._supervisor.setup_lease = lease
        return {"holder": self._supervisor.leases.client(str(lease))}

    def _require_holder(self, lease: str | None) -> None:
        if lease is None or lease != self._supervisor.setup_lease:
            raise Refused("this setup is over: its lease ran out, or was never begun", remedy="begin it again")

    def _drive(self, node: int | str) -> EposDrive:
        for drive in self._supervisor.devices.drives.values():
            if isinstance(drive, EposDrive) and node in (drive.name, drive.node, str(drive.node)):
                return drive
        raise NodeAbsent(f"no EPOS {node} in this profile", remedy="`canhelm status` lists the nodes")

    async def _lower(self, params: Params, lease: str | None) -> dict[str, Any]:
        drive, current_ma = self._drive(params["node"]), int(params["current_ma"])
        async with self._writing:
            self._require_holder(lease)
            drive.require_ready()
            lowered: dict[str, int] = {}
            for limit in LIMITS:
                old = await drive.sdo.read_int(limit)
                if old > current_ma:
                    self._lowered.setdefault((drive, limit), old)
                    await drive.sdo.write(limit, current_ma)
                    lowered[limit.name] = old
        return {"node": drive.node, "lowered": lowered}

    async def _restore(self, params: Params, lease: str | None) -> dict[str, Any]:
        self._require_holder(lease)
        return {"trouble": await self._put_back()}

    async def _end(self, params: Params, lease: str | None) -> dict[str, Any]:
        self._require_holder(lease)
        return {"trouble": await self._finish()}

    async def _finish(self) -> list[str]:
        """The setup is over, and nothing is lowered any more; what went wrong with that."""
        trouble = await self._put_back()
        self._supervisor.setup_lease = None
        return trouble

    async def _put_back(self) -> list[str]:
        """Every limit as it was; a sentence for each that could not be written."""
        trouble = []
        async with self._writing:
            for (drive, limit), old in list(self._lowered.items()):
                try:
                    await drive.sdo.write(limit, old)
                except CanhelmError as error:
                    trouble.append(f"{drive.name} keeps its lower {limit.name} until it is started anew: {error}")
                    self._supervisor.log.add("error", drive.name, trouble[-1], "switch it off and on")
                del self._lowered[drive, limit]
        return trouble

    def _on_lease_end(self, lease: str) -> None:
        if lease == self._supervisor.setup_lease:
            self._supervisor.spawn(self._break_off(), "end of a setup")

    async def _break_off(self) -> None:
        """The setup's client is gone: everything to rest and off, brakes engaged, limits as before."""
        supervisor = self._supervisor
        drives = {drive for drive, _ in self._lowered}
        try:
            await supervisor.stop("the client of the setup is gone")
            for drive in drives:
                if drive.state is DriveState.ENABLED:
                    await supervisor.power_off(drive)
            for brake in supervisor.devices.brakes.values():
                await brake.engage()
        except CanhelmError as error:
            supervisor.log.add("error", "supervisor", error.message, error.remedy or "")
        finally:
            trouble = await self._finish()
        told = "; ".join(trouble) or "the current limits are as before"
        supervisor.log.add("warning", "supervisor", f"the setup was broken off, its client is gone: {told}")
