"""What a person does to a simulated robot in the workshop: lift it, turn its wheels by hand, look at it."""

from __future__ import annotations

from typing import Any, Protocol

from canhelm.errors import Refused, UsageError
from daemon.runtime.handlers import Handler, Params


class Workshop(Protocol):
    """A person beside a simulated robot."""

    @property
    def parts(self) -> tuple[str, ...]:
        """Names of what can be turned by hand."""

    def lift(self, lifted: bool) -> None:
        """Put the robot onto blocks, or down again."""

    async def turn(self, name: str, angle_deg: float) -> float:
        """Turn a wheel or push a pair by hand, to the end; by how much it has given way [degrees]."""

    def look(self) -> dict[str, Any]:
        """What can be seen of it."""


class WorkshopCommands:
    """Handlers, by name in :attr:`handlers`.

    Args:
        workshop: where the simulated robot stands; None where the robot is real.
    """

    def __init__(self, workshop: Workshop | None) -> None:
        self._workshop = workshop
        self.handlers: dict[str, Handler] = {
            "simulation.lift": self._lift,
            "simulation.hand": self._hand,
            "simulation.look": self._look,
        }

    def _simulated(self) -> Workshop:
        if self._workshop is None:
            raise Refused("this robot is real: lift it, turn its wheels and look at it yourself")
        return self._workshop

    async def _lift(self, params: Params, lease: str | None) -> dict[str, Any]:
        lifted = bool(params["lifted"])
        self._simulated().lift(lifted)
        return {"lifted": lifted}

    async def _hand(self, params: Params, lease: str | None) -> dict[str, Any]:
        workshop, name = self._simulated(), str(params["name"])
        if name not in workshop.parts:
            have = ", ".join(dict.fromkeys(workshop.parts))
            raise UsageError(f"there is no {name} to turn", value=name, remedy=f"give one of {have}")
        return {"name": name, "turned_deg": round(await workshop.turn(name, float(params["angle_deg"])), 1)}

    async def _look(self, params: Params, lease: str | None) -> dict[str, Any]:
        return self._simulated().look()
