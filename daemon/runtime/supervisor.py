"""The supervisor: what state the vehicle is in, what may move, and what makes everything stop.

One control cycle calls :meth:`Supervisor.step`. Commands come through ``daemon.runtime.commands``.
"""

from __future__ import annotations

import asyncio
import itertools
import logging
from collections.abc import Awaitable, Callable
from functools import partial
from typing import Any

from canhelm.errors import CanhelmError, DeviceFault, Interlock, Refused
from daemon.loops.measurement import Command, Measurement
from daemon.runtime.events import EventLog
from daemon.runtime.holding import Holding
from daemon.runtime.motions import Motion
from daemon.runtime.plausibility import Plausibility
from daemon.runtime.rolling import RollingWatch
from daemon.runtime.stopping import MOTION, Stopping
from daemon.runtime.tasks import TaskSet
from daemon.runtime.vehicle import Vehicle, VehicleState
from daemon.runtime.watch import DeviceWatch
from drivers.canopen.master import Master, NodeEvent
from drivers.contract import Device, Drive, DriveState, NodeState
from drivers.devices import Devices
from drivers.nxt.brick import Brick

LOGGER = logging.getLogger("canhelm")


class Supervisor:
    """Holds the vehicle's state, its motions, leases and interlocks.

    Args:
        devices: the profile's drives, encoders and brakes on their master.
        vehicle: which loops the profile runs.
        period_s: the control cycle's period.
        lease_timeout_s: how long a motion goes on without its holder's renewal.

    Attributes:
        bus_missing: why the bus could not be opened yet; empty once it is.
        observers: called at the end of each control cycle.
        on_motion: called with each motion that was admitted, before it moves anything.
        remark: what is waited for where the profile has no device.
        setup_lease: the lease of a setup under way, which has the robot to itself; None without one.
        open_lease, renew_lease, close_lease, end_lease, holder, on_lease_end: those of
            :class:`daemon.runtime.holding.Holding`.
        at_end: awaited when the daemon goes down, once the vehicle is at rest and off.
        stop, estop, fault, power_off, until_rest: those of :class:`daemon.runtime.stopping.Stopping`.
    """

    def __init__(
        self, master: Master, devices: Devices, vehicle: Vehicle, period_s: float, lease_timeout_s: float = 1.5
    ) -> None:
        self.master = master
        self.devices = devices
        self.vehicle = vehicle
        self.log = EventLog()
        self.motions: dict[str, Motion] = {}
        self._holding = holding = Holding(self.motions, self.log, lease_timeout_s)
        self.leases, self.on_lease_end = holding.leases, holding.on_end
        self.open_lease, self.renew_lease = holding.open, holding.leases.renew
        self.close_lease, self.end_lease, self.holder = holding.close, holding.end, holding.told
        self.active_limits: tuple[str, ...] = ()
        self.measurement: Measurement | None = None
        self.command = vehicle.zero
        self.bus_missing = ""
        self.remark = ""
        self.setup_lease: str | None = None
        self.at_end: list[Callable[[], Awaitable[object]]] = []
        self.observers: list[Callable[[], None]] = []
        self.on_motion: list[Callable[[Motion], None]] = []
        self._stale_s = master.network.late_after_cycles * period_s
        self._numbers = itertools.count(1)
        self._tasks = TaskSet(self._on_task_failure)
        self.spawn = self._tasks.spawn
        self._watch = DeviceWatch(devices, period_s, master.bus, master.network.late_after_cycles)
        self._plausibility = Plausibility(vehicle)
        self._rolling = RollingWatch(vehicle.drives, self.log)
        self._stopping = stopping = Stopping(devices, vehicle, self.motions, self._tasks, self.log, self._drop_targets)
        self.stop, self.estop, self.fault = stopping.stop, stopping.estop, stopping.fault
        self.power_off, self.until_rest = stopping.power_off, stopping.until_rest
        self.brakes = stopping.brakes
        master.on_event = self._on_node_event
        for name, brick in devices.bricks.items():
            brick.on_change = partial(self._on_brick_change, name, brick)

    # --- state -------------------------------------------------------------------------------------------------

    @property
    def state(self) -> VehicleState:
        """The vehicle's state."""
        if self._stopping.estop_reason:
            return VehicleState.ESTOP
        if self._stopping.cause is not None:
            return VehicleState.FAULT
        if self._stopping.under_way:
            return VehicleState.STOPPING
        if self.powered:
            return VehicleState.ACTIVE
        states = {device.node_state for device in self.devices.all} or {NodeState.ABSENT}
        if states <= {NodeState.READY}:
            return VehicleState.IDLE
        return VehicleState.BOOTING if states <= {NodeState.READY, NodeState.CONFIGURING} else VehicleState.WAITING

    @property
    def message(self) -> str:
        """One sentence about the state: what is wrong now, what is latched, or what is waited for."""
        trouble, latched = self.master.bus.trouble, self._stopping.message
        if latched and trouble is not None and not latched.startswith(trouble.message):
            return f"{trouble}; {latched}"
        return latched or self._bus_trouble or "; ".join(self._waiting()) or self._rolling.sentence

    @property
    def _bus_trouble(self) -> str:
        return self.bus_missing or str(self.master.bus.trouble or "")

    @property
    def sentence(self) -> str:
        """State and message in one short line: of several nodes that are waited for, the first one."""
        waiting = self._waiting()
        if self._stopping.message or self._bus_trouble or not waiting:
            return f"{self.state}: {self.message}" if self.message else str(self.state)
        others = f" (and {len(waiting) - 1} more)" if len(waiting) > 1 else ""
        first = waiting[0] + others
        return first if first.startswith(str(self.state)) else f"{self.state}: {first}"

    def _waiting(self) -> list[str]:
        """What is told of each device that is not ready; motors of one brick have one sentence."""
        told = [device.status_sentence for device in self._not_ready() if device.status_sentence]
        return list(dict.fromkeys(told)) or ([self.remark] if self.remark else [])

    @property
    def anything_enabled(self) -> bool:
        """True while any drive has its power stage on."""
        return self._stopping.anything_enabled

    @property
    def powered(self) -> bool:
        """Whether a motion is under way, be it only preparing itself, or any drive has its power stage on."""
        return bool(self.motions) or self.anything_enabled

    def _not_ready(self) -> list[Device]:
        return [device for device in self.devices.all if device.node_state is not NodeState.READY]

    # --- motions -----------------------------------------------------------------------------------------------

    def require_ready(self, drives: tuple[str, ...]) -> None:
        """Raise EmergencyStop, NodeAbsent or NotReady where these drives may not be moved now."""
        self._stopping.require_none()
        for name in drives:
            self.devices.drives[name].require_ready()

    def require_no_setup_of_others(self, lease: str | None) -> None:
        """Raise Interlock while a setup that is not held by this lease has the robot to itself."""
        if self.setup_lease not in (None, lease):
            raise Interlock(
                "a setup is under way, and has the robot to itself",
                remedy="wait for its end, or end it where it runs; `canhelm stop` works at any time",
            )

    def require_still(self, lease: str | None) -> None:
        """Raise Refused where somebody else than this lease has the robot, or anything moves."""
        self._holding.require_robot(lease)
        for motion in self.motions.values():
            raise self._running(motion)

    def _running(self, motion: Motion) -> Refused:
        what = f"motion {motion.identity} ({motion.kind}, {self._holding.hand(motion)}) is running"
        return Refused(what, remedy="wait for it, `canhelm stop`, or take the robot over with --takeover (lease.take)")

    def admit(self, motion: Motion, lease: str | None = None) -> None:
        """Let a motion begin.

        Args:
            motion: what shall move.
            lease: of who asks for it, be it that the motion is handed to the daemon.

        Raises:
            EmergencyStop, NodeAbsent, NotReady: as :meth:`require_ready`.
            Refused: somebody else has the robot, its drives are busy, or its lease has run out.
            Interlock: a brake stands against it, or somebody's setup.
        """
        self.require_no_setup_of_others(motion.lease)
        self.require_ready(motion.drives)
        if motion.lease is not None:
            self.leases.client(motion.lease)
        self._holding.require_robot(lease)
        for other in self.motions.values():
            if set(other.drives) & set(motion.drives):
                raise self._running(other)
        self.brakes.require_released(motion.drives)
        if set(motion.drives) - {drive.name for drive in self.vehicle.aside}:
            self.vehicle.require_free(motion)
        motion.identity = str(next(self._numbers))
        self.motions[motion.identity] = motion
        LOGGER.info("motion %s (%s) begins, %s", motion.identity, motion.kind, self._holding.hand(motion))
        for told in self.on_motion:
            told(motion)
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
            LOGGER.info("motion %s (%s) is over: %s", motion.identity, motion.kind, motion.ended.exception() or "done")

    async def _leave_as_found(self, drives: list[Drive], enabled_here: list[Drive]) -> None:
        """All at once: a drive that does not hear is not left to push alone for longer than it takes to find out."""
        await self.until_rest()
        await asyncio.gather(*(self._leave(drive, drive in enabled_here) for drive in drives))

    async def _leave(self, drive: Drive, enabled_here: bool) -> None:
        if drive.node_state is not NodeState.READY or drive.state in (DriveState.FAULT, DriveState.UNKNOWN):
            return
        try:
            if enabled_here or self._stopping.latched or self._stopping.closing:
                await self.power_off(drive)
            elif drive.state is not DriveState.ENABLED:
                await drive.enable()
            else:
                await drive.use_driving_mode()
        except CanhelmError as error:
            self.log.add("error", drive.name, error.message, error.remedy or "")

    # --- the cycle ---------------------------------------------------------------------------------------------

    def step(self, now_s: float, dt_s: float) -> None:
        """One control step: measure, watch the devices, ask the motions, pass the gate, transmit.

        What no target has to wait for comes after that. Readings that contradict each other are among it: targets count
        at the next SYNC, and the stop to which they lead is on the wire before.
        """
        vehicle, halts, before = self.vehicle, self._stopping.halts, self.command
        measurement = self.measurement = vehicle.measure(now_s)
        powered = self.powered
        self._holding.watch()
        self._watch_devices(now_s, powered=powered)
        self._stop_for(self._plausibility.jumped(measurement, powered=powered and not self._stopping.latched))
        wanted = self._ask_motions(measurement, dt_s)
        self.command, self.active_limits = vehicle.gate(wanted, measurement, self.command, dt_s)
        self._transmit(self.command, now_s + self._stale_s)
        vehicle.observe(measurement)
        self._watch_readings(measurement, before, dt_s, powered=powered)
        if self.command.release_brake:
            self.brakes.follow(self.command.release_brake)
        self._rolling.look(now_s, powered=powered)
        if halts == self._stopping.halts:  # of a stop that has just been commanded these readings tell nothing
            self._stopping.rest.look((*measurement.wheel_speed_m_s, *[drive.speed_m_s for drive in vehicle.aside]))
        for observer in self.observers:
            observer()

    def _transmit(self, command: Command, deadline_s: float) -> None:
        vehicle, ready = self.vehicle, NodeState.READY
        for drive, speed in zip(vehicle.drives, command.wheel_speed_m_s, strict=True):
            if drive.node_state is ready:
                drive.command_speed(speed)
                drive.transmit(deadline_s)
        for drive in vehicle.aside:
            if drive.node_state is ready:
                drive.transmit(deadline_s)

    def _ask_motions(self, measurement: Measurement, dt_s: float) -> Command:
        command = self.vehicle.zero
        for motion in self.motions.values():
            if not motion.running or motion.ended.done():
                continue
            try:
                asked = motion.step(measurement, dt_s)
            except Exception as error:
                LOGGER.exception("the law of motion %s failed", motion.identity)
                defect = DeviceFault(f"the control law failed: {error}", remedy="report it with the log")
                self.fault(error if isinstance(error, DeviceFault) else defect)
                return self.vehicle.zero
            command = asked if command is self.vehicle.zero else _sum(command, asked)
        return command

    def _watch_devices(self, now_s: float, *, powered: bool) -> None:
        if not self._stopping.estop_reason and (pressed := self._stopping.pressed):
            self.estop(pressed)
        if not self._stopping.latched:
            self._stop_for(self._watch.look(now_s, powered=powered))

    def _stop_for(self, fault: DeviceFault | None) -> None:
        if fault is not None:
            self.fault(fault)

    def _watch_readings(self, measurement: Measurement, before: Command, dt_s: float, *, powered: bool) -> None:
        powered = powered and not self._stopping.latched
        driving = powered and any(motion.kind in self.vehicle.methods for motion in self.motions.values())
        self._stop_for(self._plausibility.look(measurement, before, dt_s, driving=driving))

    def _on_node_event(self, event: NodeEvent) -> None:
        self.log.add(event.severity, event.name or f"node {event.node}", event.message, event.remedy)
        fault = self._watch.lost(event)
        if fault is not None and self._stopping.cause is None and self.powered:
            self.fault(fault)

    def _on_brick_change(self, name: str, brick: Brick, sentence: str) -> None:
        """A brick has come or gone, or its battery is low; what went away in a motion stops the vehicle."""
        gone = brick.node_state is NodeState.ABSENT
        severity = "error" if gone else "warning" if brick.battery_low else "info"
        self.log.add(severity, name, sentence, "it is tried again by itself" if gone else "")
        if gone and self._stopping.cause is None and self.powered:
            self.fault(DeviceFault(sentence, remedy="its motors end their move by themselves, or run out in a second"))

    # --- leases ------------------------------------------------------------------------------------------------

    async def take_lease(self, lease: str) -> str | None:
        """Take the robot over, as :meth:`Holding.take`. Raises Interlock where somebody's setup has it to itself."""
        self.require_no_setup_of_others(lease)
        return await self._holding.take(lease)

    @property
    def lease_timeout_s(self) -> float:
        """How long a motion goes on without a renewal."""
        return self.leases.timeout_s

    # --- the end -----------------------------------------------------------------------------------------------

    async def reset(self) -> dict[str, Any]:
        """Clear the latched emergency stop and faults; the new state. Raises as :meth:`Stopping.reset`."""
        await self._stopping.reset()
        return {"state": self.state.value, "message": self.message}

    def _drop_targets(self) -> None:
        self.command = self.vehicle.zero

    def _on_task_failure(self, name: str, error: BaseException) -> None:
        self.fault(DeviceFault(f"the daemon's {name} task failed: {error}", remedy="report it with the log"))

    async def close(self) -> tuple[Drive, ...]:
        """Bring the vehicle to rest, switch every power stage off, and end all tasks.

        Returns:
            The drives that are not known to be at rest and off.
        """
        await self._stopping.close()
        for finish in self.at_end:
            await finish()
        await self._tasks.close()
        return self._stopping.doubtful


def _sum(one: Command, other: Command) -> Command:
    speeds = tuple(a + b for a, b in zip(one.wheel_speed_m_s, other.wheel_speed_m_s, strict=True))
    return Command(speeds, one.release_brake or other.release_brake)
