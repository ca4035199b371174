"""How the vehicle comes to a stop, which stops stay latched until a person resets them, and how it is known at rest."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine
from typing import Any

from canhelm.errors import CanhelmError, DeviceFault, EmergencyStop, NotReady, Refused
from daemon.runtime.brakes import BrakeKeeper
from daemon.runtime.events import EventLog
from daemon.runtime.motions import Motion
from daemon.runtime.rest import AT_REST_M_S, RestWatch
from daemon.runtime.tasks import TaskSet
from daemon.runtime.vehicle import Vehicle
from drivers.contract import Drive, DriveState, NodeState
from drivers.devices import Devices

MOTION = "motion"
"""Name of the tasks that carry out motions."""
STOP = "stop"
"""Name of the tasks that switch every power stage off."""
OFF = (DriveState.DISABLED, DriveState.FAULT)
OVERRUN_S = 0.5
"""How much longer than its ramp a wheel is waited for, before its drive is switched off all the same."""
SETTLE_S = 0.5
"""How long a stop waits for wheels that have lost their torque; those that roll on are told of by themselves."""
POWERLESS = (*OFF, DriveState.UNKNOWN)
"""As far as anybody knows."""


class Stopping:
    """Quick stop, emergency stop and faults: what they do, and that they are latched.

    Args:
        devices: the profile's drives, encoders and brakes.
        vehicle: for the time that its ramps need.
        motions: those under way; a stop ends them all.
        tasks: where stops run to their end.
        log: hears of each.
        drop_targets: called at each stop, so that no target outlives it.

    Attributes:
        estop_reason: why the emergency stop is latched; empty while it is not.
        cause: the fault that is latched.
        closing: the daemon goes down: nothing begins any more.
        halts: how many stops were commanded so far.
    """

    def __init__(
        self,
        devices: Devices,
        vehicle: Vehicle,
        motions: dict[str, Motion],
        tasks: TaskSet,
        log: EventLog,
        drop_targets: Callable[[], None],
    ) -> None:
        self.estop_reason = ""
        self.cause: DeviceFault | None = None
        self.closing = False
        self.halts = 0
        self.brakes = BrakeKeeper(devices, vehicle.brakes, tasks, self._on_failure)
        self.rest = RestWatch()
        self._devices = devices
        self._drives = tuple(devices.drives.values())
        configs = vehicle.profile.drives
        self._with_contact = [d for d in self._drives if d.name in configs and configs[d.name].emergency_stop]
        self._vehicle = vehicle
        self._motions = motions
        self._tasks = tasks
        self._log = log
        self._drop_targets = drop_targets
        self._latched = 0
        self._cause_s = 0.0
        self._halting = 0

    @property
    def latched(self) -> bool:
        """Whether an emergency stop or a fault waits for a reset."""
        return self.cause is not None or bool(self.estop_reason)

    @property
    def pressed(self) -> str:
        """Which emergency stop contact demands a stop now; empty where none does."""
        return next((reason for drive in self._with_contact if (reason := drive.emergency_stop)), "")

    @property
    def under_way(self) -> bool:
        """Whether a stop was commanded and the vehicle is not known at rest yet."""
        return self._halting > 0

    @property
    def message(self) -> str:
        """What is latched, and how to get on; empty where nothing is."""
        if self.estop_reason and self.pressed:
            return f"emergency stop: {self.pressed}; release it, then `canhelm reset`"
        if self.estop_reason:
            return f"emergency stop: {self.estop_reason}; reset by `canhelm reset`"
        if self.cause is None:
            return ""
        if self._cause_is_gone:
            return f"stopped by a fault that is gone: {self.cause.message}; drives again after `canhelm reset`"
        return f"{self.cause.message}; after the cause is gone: `canhelm reset`"

    @property
    def _cause_is_gone(self) -> bool:
        """Whether the node that was at fault has been read again since and has no fault any more."""
        device = self._devices.by_node.get(self.cause.node or 0) if self.cause else None
        if device is None or device.node_state is not NodeState.READY or device.fault is not None:
            return False
        return device.reading_time_s > self._cause_s

    def require_none(self) -> None:
        """Raise EmergencyStop or NotReady while the vehicle is stopped, or about to be."""
        if self.estop_reason:
            raise EmergencyStop(
                f"the emergency stop is latched: {self.estop_reason}",
                remedy=f"{'release it' if self.pressed else 'make sure that it is safe'}, then `canhelm reset`",
            )
        if self.cause is not None:
            raise NotReady(f"the vehicle is in fault: {self.cause.message}", remedy="`canhelm reset`")
        if self.closing:
            raise NotReady("the daemon is going down", remedy="start it again")
        if self.under_way:
            raise NotReady("the vehicle is stopping", remedy="wait until it is at rest")

    # --- stops -------------------------------------------------------------------------------------------------

    async def stop(self, reason: str) -> None:
        """Quick stop of everything; returns when the vehicle is at rest and the drives are as before the motions."""
        powered = self._any_power
        self._halt(Refused(f"the motion was stopped: {reason}"))
        self._halting += 1
        try:
            await self._insist()
            await self._settled()
            if powered:
                self.rest.begin_anew()  # wheels may settle when their torque goes
                await self.rest.until_rest(SETTLE_S)
            if not self.latched:
                for drive in self._drives:
                    if drive.state is DriveState.QUICK_STOP:
                        await self._try(drive.name, drive.enable())
        finally:
            self._halting -= 1

    def estop(self, reason: str) -> None:
        """Emergency stop: quick stop, then every power stage off; latched until :meth:`reset`."""
        self._latched += 1
        self.estop_reason = self.estop_reason or reason
        self._halt(EmergencyStop(f"emergency stop: {reason}", remedy="`canhelm reset` when it is safe"))
        self._log.add(
            "error", "supervisor", f"emergency stop: {reason}", "make sure that it is safe, then `canhelm reset`"
        )
        self._tasks.spawn(self._stop_and_disable(), STOP)

    def fault(self, error: DeviceFault) -> None:
        """A fault that stops the vehicle: quick stop, brakes, power off; latched until :meth:`reset`."""
        self._latched += 1
        if not self.latched:
            self.cause = error
            self._cause_s = asyncio.get_running_loop().time()
        self._halt(_until_reset(error))
        if not self._log.told(error.message):
            source = f"node {error.node}" if error.node else "supervisor"
            self._log.add("error", source, error.message, error.remedy or "")
        self._tasks.spawn(self._stop_and_disable(), STOP)

    async def close(self) -> None:
        """The last stop: to rest, with every power stage off that has power."""
        self.closing = True
        powered = self._any_power
        self._halt(Refused("the motion was stopped: the daemon is going down"))
        if powered:
            await self._stop_and_disable()
            self.rest.begin_anew()  # wheels may settle when their torque goes
            await self.until_rest()

    async def reset(self) -> None:
        """Clear the latched emergency stop and faults.

        Raises:
            EmergencyStop: a contact is still pressed.
            DeviceFault: a cause is still there.
            Refused: the vehicle was stopped again in the meantime; that stop stays latched.
        """
        count = self._latched
        if self.pressed:
            raise EmergencyStop(self.pressed, remedy="release it, then `canhelm reset`")
        if self.latched:
            await self._settled()
            await self._tasks.wait(STOP)
        for drive in self._drives:
            if drive.node_state is NodeState.READY and drive.state is DriveState.FAULT:
                await drive.reset_fault()
        if count != self._latched:
            raise Refused(f"stopped again during the reset: {self.message}", remedy="`canhelm reset` when it is safe")
        for device in self._devices.all:
            device.fault = None
        if self.latched:
            self._log.add("info", "supervisor", "reset by a person")
        self.cause = None
        self.estop_reason = ""

    def _halt(self, error: CanhelmError) -> None:
        """Command the stop, now: RPDO3 to every drive that has power or is about to, brakes to engage, motions over."""
        self.halts += 1
        for drive in self._drives:
            if drive.node_state is NodeState.READY and drive.state is not DriveState.FAULT:
                drive.quick_stop()
        self.rest.begin_anew()
        self._drop_targets()
        for motion in list(self._motions.values()):
            motion.fail(error)
        self.brakes.on_halt()

    async def _stop_and_disable(self) -> None:
        self._halting += 1
        try:
            await self._insist()
            await self._settled()
            powered = [d for d in self._drives if d.node_state is NodeState.READY and d.state not in POWERLESS]
            await asyncio.gather(*(self._try(drive.name, self.power_off(drive)) for drive in powered))
        finally:
            self._halting -= 1

    async def _insist(self) -> None:
        """See that every drive takes the quick stop; one that needs more than its PDOs for it is a fault."""
        ready = [drive for drive in self._drives if drive.node_state is NodeState.READY]
        answers = await asyncio.gather(*(drive.insist_on_stop() for drive in ready), return_exceptions=True)
        for answer in answers:
            if isinstance(answer, DeviceFault):
                self._on_failure(answer)
            elif isinstance(answer, BaseException) and not isinstance(answer, CanhelmError):
                raise answer

    # --- rest and power ----------------------------------------------------------------------------------------

    @property
    def _any_power(self) -> bool:
        return bool(self._motions) or self.anything_enabled

    @property
    def anything_enabled(self) -> bool:
        """True while any drive has its power stage on."""
        return any(drive.state not in POWERLESS for drive in self._drives)

    @property
    def doubtful(self) -> tuple[Drive, ...]:
        """Drives that are not known to be at rest with their power stage off."""
        return tuple(drive for drive in self._drives if drive.state not in OFF or abs(drive.speed_m_s) > AT_REST_M_S)

    async def power_off(self, drive: Drive) -> None:
        """Engage what holds the axis, then switch the drive off; one that needs more than its PDOs for it is a fault.

        Raises:
            NotReady: the drive is not ready.
            Refused: two stops or others who switch it off cut in.
        """
        await self.brakes.secure(drive.name)
        try:
            try:
                await drive.disable()
            except Refused:  # a stop that cut in has made a quick stop of it
                await drive.disable()
        except DeviceFault as error:
            self._on_failure(error)

    async def _settled(self) -> None:
        await self.until_rest()
        await self._tasks.wait(MOTION)

    async def until_rest(self) -> None:
        """Return when every wheel that can be read has been at rest for some cycles.

        A wheel that does not come to rest within the time that its ramp needs is reported; waiting ends then.
        """
        if not await self.rest.until_rest(self._vehicle.stopping_time_s() + OVERRUN_S):
            self._report_unrest([drive.name for drive in self._drives if abs(drive.speed_m_s) > AT_REST_M_S])

    def _report_unrest(self, moving: list[str]) -> None:
        if moving:
            told = f"not at rest in the time that the ramp needs: {', '.join(moving)}"
            remedy = "is the vehicle on a slope, or a wheel pushed by hand?"
        else:
            told = "slow now, but not seen at rest for long enough in the time that the ramp needs"
            remedy = "were control cycles late, or is the line slow? see `canhelm status`"
        self._log.add("error", "supervisor", told, remedy)

    def _on_failure(self, error: DeviceFault) -> None:
        """A fault, unless one has stopped the vehicle already: that stop goes on."""
        if not self.latched:
            self.fault(error)
        else:
            self._log.add("error", "supervisor", error.message, error.remedy or "")

    async def _try(self, name: str, work: Coroutine[Any, Any, None]) -> None:
        try:
            await work
        except CanhelmError as error:
            self._log.add("error", name, error.message, error.remedy or "")


def _until_reset(error: DeviceFault) -> DeviceFault:
    """A fault as a motion ends by it: its remedy names the reset, too."""
    remedy = "; then ".join(filter(None, (error.remedy, "`canhelm reset`")))
    return DeviceFault(
        error.message, node=error.node, object=error.object, value=error.value, limit=error.limit, remedy=remedy
    )
