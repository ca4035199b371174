"""The supervisor: what state the vehicle is in, what may move, and what makes everything stop.

One control cycle calls :meth:`Supervisor.step`. Commands come through ``daemon.runtime.commands``.
"""

from __future__ import annotations

import asyncio
import itertools
import logging
from collections.abc import Callable, Coroutine
from typing import Any

from canhelm.errors import CanhelmError, DeviceFault, EmergencyStop, NotReady, Refused
from daemon.loops.measurement import Command, Measurement
from daemon.runtime.brakes import BrakeKeeper
from daemon.runtime.events import EventLog
from daemon.runtime.leases import Leases
from daemon.runtime.motions import Motion
from daemon.runtime.rest import AT_REST_M_S, RestWatch
from daemon.runtime.tasks import TaskSet
from daemon.runtime.vehicle import Vehicle, VehicleState
from daemon.runtime.watch import DeviceWatch
from drivers.canopen.master import Master, NodeEvent
from drivers.contract import Device, Drive, DriveState, NodeState
from drivers.devices import Devices

LOGGER = logging.getLogger("canhelm")
MOTION = "motion"
"""Name of the tasks that carry out motions."""
STOP = "stop"
"""Name of the tasks that switch every power stage off."""
POWERLESS = (DriveState.DISABLED, DriveState.UNKNOWN, DriveState.FAULT)


class Supervisor:
    """Holds the vehicle's state, its motions, leases and interlocks.

    Args:
        devices: the profile's drives, encoders and brakes on their master.
        vehicle: which loops the profile runs.
        period_s: the control cycle's period.
        lease_timeout_s: how long a motion goes on without its holder's renewal.
    """

    def __init__(
        self, master: Master, devices: Devices, vehicle: Vehicle, period_s: float, lease_timeout_s: float = 1.5
    ) -> None:
        self.master = master
        self.devices = devices
        self.vehicle = vehicle
        self.leases = Leases(lease_timeout_s)
        self.log = EventLog()
        self.motions: dict[str, Motion] = {}
        self.active_limits: tuple[str, ...] = ()
        self.measurement: Measurement | None = None
        self.command = vehicle.zero
        self.observers: list[Callable[[], None]] = []
        self._period_s = period_s
        self._numbers = itertools.count(1)
        self._tasks = TaskSet(self._on_task_failure)
        self._rest = RestWatch()
        self._watch = DeviceWatch(devices, period_s)
        self._estop_reason = ""
        self._fault: DeviceFault | None = None
        self._latched = 0
        self._halting = 0
        self._closing = False
        self.brakes = BrakeKeeper(devices, vehicle.brakes, self._tasks, self._on_brake_failure)
        master.on_event = self._on_node_event

    # --- state -------------------------------------------------------------------------------------------------

    @property
    def state(self) -> VehicleState:
        """The vehicle's state."""
        if self._estop_reason:
            return VehicleState.ESTOP
        if self._fault is not None:
            return VehicleState.FAULT
        if self._halting:
            return VehicleState.STOPPING
        if self.powered:
            return VehicleState.ACTIVE
        states = {device.node_state for device in self.devices.by_node.values()}
        if states <= {NodeState.READY}:
            return VehicleState.IDLE
        return VehicleState.BOOTING if states <= {NodeState.READY, NodeState.CONFIGURING} else VehicleState.WAITING

    @property
    def message(self) -> str:
        """One sentence about the state: what is wrong, or what is waited for."""
        if self._estop_reason:
            return f"emergency stop: {self._estop_reason}; reset by `canhelm reset`"
        if self._fault is not None:
            return f"{self._fault.message}; after the cause is gone: `canhelm reset`"
        return "; ".join(device.status_sentence for device in self._not_ready())

    @property
    def anything_enabled(self) -> bool:
        """True while any drive has its power stage on."""
        return any(drive.state not in POWERLESS for drive in self.devices.drives.values())

    def _not_ready(self) -> list[Device]:
        return [device for device in self.devices.by_node.values() if device.node_state is not NodeState.READY]

    # --- motions -----------------------------------------------------------------------------------------------

    def require_ready(self, drives: tuple[str, ...]) -> None:
        """Raise EmergencyStop, NotReady or Refused where these drives may not be moved now."""
        if self._estop_reason:
            raise EmergencyStop(
                f"the emergency stop is latched: {self._estop_reason}",
                remedy="make sure that it is safe, then `canhelm reset`",
            )
        if self._fault is not None:
            raise NotReady(f"the vehicle is in fault: {self._fault.message}", remedy="`canhelm reset`")
        if self._closing:
            raise NotReady("the daemon is going down", remedy="start it again")
        if self._halting:
            raise NotReady("the vehicle is stopping", remedy="wait until it is at rest")
        for name in drives:
            drive = self.devices.drives[name]
            if drive.node_state is not NodeState.READY:
                raise NotReady(drive.status_sentence, node=drive.node, remedy="`canhelm status` shows every node")

    def admit(self, motion: Motion) -> None:
        """Let a motion begin.

        Raises:
            EmergencyStop, NotReady: as :meth:`require_ready`.
            Refused: its drives are busy, or its lease has run out.
            Interlock: a brake stands against it.
        """
        self.require_ready(motion.drives)
        if motion.lease is not None:
            self.leases.client(motion.lease)
        for other in self.motions.values():
            if set(other.drives) & set(motion.drives):
                holder = f"held by {self.leases.client(other.lease)}" if other.lease else "handed to the daemon"
                raise Refused(
                    f"motion {other.identity} ({other.kind}, {holder}) is running",
                    remedy="wait for it, or `canhelm stop`",
                )
        self.brakes.require_released(motion.drives)
        self.vehicle.require_free(motion)
        motion.identity = str(next(self._numbers))
        self.motions[motion.identity] = motion
        self._tasks.spawn(self._carry_out(motion), MOTION)

    async def _carry_out(self, motion: Motion) -> None:
        drives = [self.devices.drives[name] for name in motion.drives]
        enabled_here = [drive for drive in drives if drive.state is not DriveState.ENABLED]
        try:
            await asyncio.gather(*(drive.enable() for drive in enabled_here))
            if not motion.ended.done():
                await motion.start()
                motion.begin(asyncio.get_running_loop().time())
            await asyncio.wait([motion.ended])
        except CanhelmError as error:
            motion.fail(error)
        finally:
            motion.running = False
            motion.fail(Refused("the motion was cut short by a defect of the daemon", remedy="report it with the log"))
            await self._leave_as_found(drives, enabled_here)
            self.motions.pop(motion.identity, None)
            motion.closed.set()

    async def _leave_as_found(self, drives: list[Drive], enabled_here: list[Drive]) -> None:
        await self.until_rest()
        for drive in drives:
            if drive.node_state is not NodeState.READY or drive.state in (DriveState.FAULT, DriveState.UNKNOWN):
                continue
            try:
                if drive in enabled_here or self._fault is not None or self._estop_reason or self._closing:
                    await self.power_off(drive)
                elif drive.state is not DriveState.ENABLED:
                    await drive.enable()
                else:
                    await drive.use_driving_mode()
            except CanhelmError as error:
                self.log.add("error", drive.name, error.message, error.remedy or "")

    # --- stopping ----------------------------------------------------------------------------------------------

    async def stop(self, reason: str) -> None:
        """Quick stop of everything; returns when the vehicle is at rest and the drives are as before the motions."""
        self._halt(Refused(f"the motion was stopped: {reason}"))
        self._halting += 1
        try:
            await self._settled()
            if self._fault is None and not self._estop_reason:
                for drive in self.devices.drives.values():
                    if drive.state is DriveState.QUICK_STOP:
                        await self._try(drive.name, drive.enable())
        finally:
            self._halting -= 1

    def estop(self, reason: str) -> None:
        """Emergency stop: quick stop, then every power stage off; latched until :meth:`reset`."""
        self._latched += 1
        self._estop_reason = self._estop_reason or reason
        self._halt(EmergencyStop(f"emergency stop: {reason}", remedy="`canhelm reset` when it is safe"))
        self.log.add(
            "error", "supervisor", f"emergency stop: {reason}", "make sure that it is safe, then `canhelm reset`"
        )
        self._tasks.spawn(self._stop_and_disable(), STOP)

    def fault(self, error: DeviceFault) -> None:
        """A fault that stops the vehicle: quick stop, brakes, power off; latched until :meth:`reset`."""
        self._latched += 1
        if self._fault is None and not self._estop_reason:
            self._fault = error
        self._halt(error)
        self.log.add("error", f"node {error.node}" if error.node else "supervisor", error.message, error.remedy or "")
        self._tasks.spawn(self._stop_and_disable(), STOP)

    async def reset(self) -> dict[str, Any]:
        """Clear the latched emergency stop and faults.

        Raises:
            DeviceFault: a cause is still there.
            Refused: the vehicle was stopped again in the meantime; that stop stays latched.
        """
        latched = self._latched
        if self._fault is not None or self._estop_reason:
            await self._settled()
            await self._tasks.wait(STOP)
        for drive in self.devices.drives.values():
            if drive.node_state is NodeState.READY and drive.state is DriveState.FAULT:
                await drive.reset_fault()
        if latched != self._latched:
            raise Refused(f"stopped again during the reset: {self.message}", remedy="`canhelm reset` when it is safe")
        for device in self.devices.by_node.values():
            device.fault = None
        if self._fault is not None or self._estop_reason:
            self.log.add("info", "supervisor", "reset by a person")
        self._fault = None
        self._estop_reason = ""
        return {"state": self.state.value, "message": self.message}

    def _halt(self, error: CanhelmError) -> None:
        """Command the stop, now: RPDO3 to every drive that has power or is about to, brakes to engage, motions over."""
        for drive in self.devices.drives.values():
            if drive.node_state is NodeState.READY and drive.state is not DriveState.FAULT:
                drive.quick_stop()
        self._rest.begin_anew()
        self.command = self.vehicle.zero
        for motion in list(self.motions.values()):
            motion.fail(error)
        self.brakes.on_halt()

    async def _stop_and_disable(self) -> None:
        self._halting += 1
        try:
            await self._settled()
            for drive in self.devices.drives.values():
                if drive.node_state is NodeState.READY and drive.state not in POWERLESS:
                    await self._try(drive.name, self.power_off(drive))
        finally:
            self._halting -= 1

    async def power_off(self, drive: Drive) -> None:
        """Engage what holds the axis, then switch the drive off. Raises NotReady or Timeout."""
        await self.brakes.secure(drive.name)
        await drive.disable()

    async def _settled(self) -> None:
        await self.until_rest()
        await self._tasks.wait(MOTION)

    async def until_rest(self) -> None:
        """Return when every wheel that can be read has been at rest for some cycles.

        A wheel that does not come to rest within the time that its ramp needs is reported; waiting ends then.
        """
        if not await self._rest.until_rest(self.vehicle.stopping_time_s() + 1.0):
            moving = [drive.name for drive in self.devices.drives.values() if abs(drive.speed_m_s) > AT_REST_M_S]
            self.log.add(
                "error",
                "supervisor",
                f"not at rest in the time that the ramp needs: {', '.join(moving)}",
                "is the vehicle on a slope, or a wheel pushed by hand?",
            )

    # --- the cycle ---------------------------------------------------------------------------------------------

    def step(self, now_s: float, dt_s: float) -> None:
        """One control step: measure, watch, ask the motions, pass the gate, transmit."""
        measurement = self.measurement = self.vehicle.measure(now_s)
        self._rest.look(measurement.wheel_speed_m_s)
        self._watch_leases(now_s)
        self._watch_devices(now_s)
        wanted = self._ask_motions(measurement, dt_s)
        self.command, self.active_limits = self.vehicle.gate(wanted, measurement, self.command, dt_s)
        if self.command.release_brake:
            self.brakes.follow(self.command.release_brake)
        deadline = now_s + self._period_s
        for drive, speed in zip(self.vehicle.drives, self.command.wheel_speed_m_s, strict=True):
            if drive.node_state is NodeState.READY:
                drive.command_speed(speed)
                drive.transmit(deadline)
        self.vehicle.observe(measurement)
        for observer in self.observers:
            observer()

    def _ask_motions(self, measurement: Measurement, dt_s: float) -> Command:
        command = self.vehicle.zero
        for motion in self.motions.values():
            if not motion.running or motion.ended.done():
                continue
            try:
                asked = motion.step(measurement, dt_s)
            except Exception as error:
                LOGGER.exception("the law of motion %s failed", motion.identity)
                self.fault(DeviceFault(f"the control law failed: {error}", remedy="report it with the log"))
                return self.vehicle.zero
            command = asked if command is self.vehicle.zero else _sum(command, asked)
        return command

    def _watch_leases(self, now_s: float) -> None:
        for lease, client in self.leases.expired(now_s):
            self.release_motions(lease, f"the lease of {client} ran out")

    def _watch_devices(self, now_s: float) -> None:
        if self._fault is None and not self._estop_reason:
            fault = self._watch.look(now_s, powered=self.powered)
            if fault is not None:
                self.fault(fault)

    def _on_node_event(self, event: NodeEvent) -> None:
        self.log.add(event.severity, event.name or f"node {event.node}", event.message, event.remedy)
        fault = self._watch.lost(event)
        if fault is not None and self._fault is None and self.powered:
            self.fault(fault)

    @property
    def powered(self) -> bool:
        """Whether a motion is under way, be it only preparing itself, or any drive has its power stage on."""
        return bool(self.motions) or self.anything_enabled

    # --- leases ------------------------------------------------------------------------------------------------

    def open_lease(self, client: str) -> str:
        """A lease for a client that is about to move something; returns its id."""
        return self.leases.open(client)

    def renew_lease(self, lease: str) -> None:
        """Keep a lease alive. Raises Refused where it has run out."""
        self.leases.renew(lease)

    def close_lease(self, lease: str) -> None:
        """The client is gone: its motions stop."""
        self.release_motions(lease, "its client hung up")
        self.leases.close(lease)

    @property
    def lease_timeout_s(self) -> float:
        """How long a motion goes on without a renewal."""
        return self.leases.timeout_s

    def release_motions(self, lease: str, reason: str) -> None:
        """Stop every motion that a lease holds."""
        for motion in list(self.motions.values()):
            if motion.lease == lease and not motion.stop_reason:
                self.log.add("warning", "supervisor", f"motion {motion.identity} ({motion.kind}) stops: {reason}")
                motion.stop(reason)

    # --- the end -----------------------------------------------------------------------------------------------

    def _on_brake_failure(self, error: DeviceFault) -> None:
        """A fault, unless one has stopped the vehicle already: its stop switches the brakes once more."""
        if self._fault is None and not self._estop_reason:
            self.fault(error)
        else:
            self.log.add("error", "supervisor", error.message, error.remedy or "")

    def _on_task_failure(self, name: str, error: BaseException) -> None:
        self.fault(DeviceFault(f"the daemon's {name} task failed: {error}", remedy="report it with the log"))

    async def _try(self, name: str, work: Coroutine[Any, Any, None]) -> None:
        try:
            await work
        except CanhelmError as error:
            self.log.add("error", name, error.message, error.remedy or "")

    async def close(self) -> None:
        """Bring the vehicle to rest, switch every power stage off, and end all tasks."""
        self._closing = True
        powered = self.powered
        self._halt(Refused("the motion was stopped: the daemon is going down"))
        if powered:
            await self._stop_and_disable()
        await self._tasks.close()


def _sum(one: Command, other: Command) -> Command:
    speeds = tuple(a + b for a, b in zip(one.wheel_speed_m_s, other.wheel_speed_m_s, strict=True))
    return Command(speeds, one.release_brake or other.release_brake)
