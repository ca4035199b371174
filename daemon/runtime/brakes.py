"""Brakes as the supervisor switches them: steering brakes follow the law, holding brakes guard their axes."""

from __future__ import annotations

from collections.abc import Awaitable, Callable

from canhelm.errors import CanhelmError, DeviceFault, Interlock, Refused
from daemon.runtime.tasks import TaskSet
from drivers.contract import Brake, BrakeState, DriveState, NodeState
from drivers.devices import Devices

RELEASED = (BrakeState.RELEASING, BrakeState.RELEASED)
ENGAGED = (BrakeState.ENGAGING, BrakeState.ENGAGED)


class BrakeKeeper:
    """Switches brakes; one that does not obey is a fault, but not one that was to open and engages for a stop.

    Args:
        devices: all devices.
        steering: the vehicle's steering brakes, in the order of its loops.
        tasks: where switching runs.
        on_failure: called with the fault when a brake does not switch.
    """

    def __init__(
        self,
        devices: Devices,
        steering: tuple[Brake, ...],
        tasks: TaskSet,
        on_failure: Callable[[DeviceFault], None],
    ) -> None:
        self._devices = devices
        self._steering = steering
        self._holding = tuple(brake for brake in devices.brakes.values() if brake.kind == "holding")
        self._tasks = tasks
        self._on_failure = on_failure

    def follow(self, release: tuple[bool, ...]) -> None:
        """Make the steering brakes follow what the law asks for; one whose drive is gone cannot be switched."""
        ready = NodeState.READY
        for brake, wanted in zip(self._steering, release, strict=True):
            if self._devices.drives[brake.drive].node_state is not ready:
                continue
            if wanted and brake.state not in RELEASED:
                self._tasks.spawn(self._switch(brake, brake.release), "brake")
            elif not wanted and brake.state not in ENGAGED:
                self._tasks.spawn(self._switch(brake, brake.engage), "brake")

    def on_halt(self) -> None:
        """A stop was commanded: lock the headings now, and hold the axes whose drives have no torque any more.

        The holding brakes of drives that still ramp down engage at rest, by :meth:`secure`.
        """
        self.follow((False,) * len(self._steering))
        for brake in self._holding:
            if self._devices.drives[brake.drive].state is DriveState.FAULT:
                self._tasks.spawn(self._switch(brake, brake.engage), "brake")

    def require_released(self, drives: tuple[str, ...]) -> None:
        """Raise Interlock where a holding brake would have to be moved against."""
        for brake in self._holding:
            if brake.drive in drives and brake.state is not BrakeState.RELEASED:
                raise Interlock(
                    f"the {brake.name} brake holds {brake.drive}: nothing moves against it",
                    remedy=f"`canhelm motor enable {brake.drive}`, then `canhelm brake release {brake.name}`",
                )

    async def secure(self, drive: str) -> None:
        """Engage the holding brakes of an axis, before its drive is switched off."""
        for brake in self._holding:
            if brake.drive == drive:
                await self._switch(brake, brake.engage)

    async def _switch(self, brake: Brake, switch: Callable[[], Awaitable[None]]) -> None:
        try:
            await switch()
        except CanhelmError as error:
            if switch == brake.release and isinstance(error, Refused) and brake.state in ENGAGED:
                return
            self._on_failure(
                DeviceFault(
                    f"the {brake.name} brake did not switch: {error.message}", node=error.node, remedy=error.remedy
                )
            )
