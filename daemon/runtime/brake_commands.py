"""The ``brake.*`` methods and the interlocks of both kinds of brake."""

from __future__ import annotations

from typing import Any

from canhelm.errors import Interlock, UsageError
from daemon.runtime.handlers import Handler, Params
from daemon.runtime.supervisor import Supervisor
from drivers.contract import Brake, BrakeState, DriveState


class BrakeCommands:
    """Handlers of the ``brake.*`` methods, by name in :attr:`handlers`.

    Args:
        supervisor: what decides.
    """

    def __init__(self, supervisor: Supervisor) -> None:
        self._supervisor = supervisor
        self.handlers: dict[str, Handler] = {
            "brake.engage": self._engage,
            "brake.release": self._release,
            "brake.status": self._status,
        }

    def _brakes(self, params: Params) -> list[Brake]:
        brakes = self._supervisor.devices.brakes
        pair = str(params.get("pair") or "all")
        if pair == "all":
            return list(brakes.values())
        if pair not in brakes:
            have = ", ".join(brakes) or "none"
            raise UsageError(f"no brake {pair} in this profile", value=pair, remedy=f"brakes: {have}, or all")
        return [brakes[pair]]

    async def _engage(self, params: Params, lease: str | None) -> dict[str, Any]:
        if self._supervisor.motions:
            raise Interlock("a motion is running and holds the brakes", remedy="`canhelm stop` first")
        brakes = self._brakes(params)
        for brake in brakes:
            self._supervisor.devices.drives[brake.drive].require_ready()
            await brake.engage()
        return {"brakes": [brake.status() for brake in brakes]}

    async def _release(self, params: Params, lease: str | None) -> dict[str, Any]:
        brakes, force = self._brakes(params), bool(params.get("force", False))
        for brake in brakes:
            self._check_release(brake, len(brakes), force=force)
            self._supervisor.devices.drives[brake.drive].require_ready()
        for brake in brakes:
            self._check_release(brake, len(brakes), force=force)  # something may have begun while another one opened
            await brake.release()
        return {"brakes": [brake.status() for brake in brakes]}

    def _check_release(self, brake: Brake, together: int, *, force: bool) -> None:
        supervisor = self._supervisor
        supervisor.require_ready(())
        if supervisor.motions:
            raise Interlock("a motion is running and holds the brakes", remedy="`canhelm stop` first")
        if brake.kind == "holding":
            if supervisor.devices.drives[brake.drive].state is not DriveState.ENABLED and not force:
                raise Interlock(
                    f"{brake.drive} is disabled and would not hold the axis once the {brake.name} brake is released",
                    remedy="enable the drive first, or release with --force when the axis carries no load",
                )
            return
        others = [other for other in supervisor.devices.brakes.values() if other is not brake]
        others_engaged = all(other.state is BrakeState.ENGAGED for other in others)
        if supervisor.anything_enabled and (together > 1 or not others_engaged):
            raise Interlock(
                f"the {brake.name} steering brake is not released while a drive is enabled and another pair is free",
                remedy="disable the drives, or release one pair with the other engaged",
            )

    async def _status(self, params: Params, lease: str | None) -> dict[str, Any]:
        return {"brakes": [brake.status() for brake in self._brakes(params)]}
