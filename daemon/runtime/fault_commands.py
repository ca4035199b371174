"""The methods that put faults into a simulated network, list them, and take them away."""

from __future__ import annotations

from typing import Any

import msgspec

from canhelm.errors import Refused, UsageError
from daemon.runtime.handlers import Handler, Params
from daemon.runtime.supervisor import Supervisor
from drivers.simulated.faults import Faults
from profiles.faults import Fault, objections, wanted
from profiles.provenance import short


class FaultCommands:
    """Handlers, by name in :attr:`handlers`.

    Args:
        supervisor: for the profile, and the names of nodes.
        faults: of the simulated network; None where it is real.
    """

    def __init__(self, supervisor: Supervisor, faults: Faults | None) -> None:
        self._supervisor = supervisor
        self._faults = faults
        self.handlers: dict[str, Handler] = {
            "simulation.fault": self._fault,
            "simulation.faults": self._list,
            "simulation.clear_faults": self._clear,
        }

    def _simulated(self) -> Faults:
        if self._faults is None:
            raise Refused("this robot is real: its faults come by themselves", remedy="`canhelm run --simulate`")
        return self._faults

    async def _fault(self, params: Params, lease: str | None) -> dict[str, Any]:
        faults = self._simulated()
        given = {key: value for key, value in params.items() if value is not None}
        if "part" in given:
            given["part"] = self._name(given["part"])
        try:
            fault = msgspec.convert(given, Fault)
        except msgspec.ValidationError as error:
            field = str(error).partition(" - at `$.")[2].strip("`")
            remedy = f"give {wanted(field)}"
            raise UsageError(
                f"{field} is {short(str(given[field]))}", object=field, value=given[field], remedy=remedy
            ) from None
        for objection in objections(fault, self._supervisor.vehicle.profile):
            what = f"{fault.kind}: {objection.field} {objection.what}"
            raise UsageError(what, object=objection.field, remedy=objection.remedy)
        return faults.add(fault)

    def _name(self, part: int | str) -> str:
        """A part as the profile calls it, where it is given by its node id."""
        for node, device in self._supervisor.devices.by_node.items():
            if str(node) == str(part):
                return device.name
        return str(part)

    async def _list(self, params: Params, lease: str | None) -> dict[str, Any]:
        return {"faults": self._simulated().told()}

    async def _clear(self, params: Params, lease: str | None) -> dict[str, Any]:
        return {"cleared": self._simulated().clear(params.get("fault"))}
