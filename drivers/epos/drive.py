"""One EPOS 24/5 with its wheel: cyclic readings and targets, device control, faults."""

from __future__ import annotations

import asyncio
import contextlib
import itertools
import math
from collections.abc import Callable
from typing import Any

from canhelm.errors import CanhelmError, DeviceFault, NotReady, Refused, Timeout
from drivers.canopen.device import CanopenDevice, Step
from drivers.canopen.master import Master
from drivers.canopen.objects import ObjectDef
from drivers.canopen.pdo import rpdo_cob_id, tpdo_cob_id
from drivers.contract import DriveState, Fault, NodeState
from drivers.epos import device_control, moves
from drivers.epos.codec import DRIVING_MODES, RPDO1, TPDO1, TPDO1_BYTES, TPDO2, make_rpdo3
from drivers.epos.configure import EposSetup, emergency_words
from drivers.epos.device_control import drive_state, is_powered
from drivers.epos.emergency_stop_input import EmergencyStopInput
from drivers.epos.objects import OBJECTS
from drivers.epos.outputs import OutputBits
from drivers.epos.state_machine import Command, Mode, State
from drivers.epos.transitions import StatuswordWaiters, Turns
from drivers.epos.travel import Travel
from drivers.epos.units import WheelUnits
from profiles.schema import DriveConfig

SENSOR_ERROR = 0x7320
"""Also sent when a setting of the sensor is changed (Firmware Specification 14.1.46): no fault while one configures."""
INSIST_CYCLES = 5
"""Cycles in which a drive has to show that it takes a quick stop, or that it is off."""
_unpack_tpdo1, _pack_rpdo1 = TPDO1.unpack, RPDO1.pack
_UNKNOWN, _ENABLED, _READY = DriveState.UNKNOWN, DriveState.ENABLED, NodeState.READY
"""For what is done each cycle: in Python 3.11 to look up a member of an enum takes 0.1 us."""


class EposDrive(CanopenDevice):
    """One drive; fulfils ``drivers.contract.Drive``.

    Controlword and target speed go out together in RPDO1 each cycle, so both are commanded by storing them; a non-zero
    target is sent only while the drive reports Operation Enabled in its driving mode.

    Args:
        master: the master of its bus.
        name: its name in the profile.
        config: its part of the profile.

    Attributes:
        speed_m_s: rim speed over the last two intervals between readings: position difference by time difference.
        current_a: motor current, with the sign it has at the motor; :meth:`set_current` likewise.
        statusword: last one received.
        analog_mv: voltages at its analog inputs, where its profile asks for them.
        analog_time_s: loop time of their last reading.
        outputs: its digital outputs.
        waiters: everybody who waits for a statusword of it.
        turns: its transitions; a stop ends the one under way.
        on_ready_change: called with True when it has become ready, False when it was lost.
    """

    kind = "epos24_5"

    def __init__(self, master: Master, name: str, config: DriveConfig) -> None:
        super().__init__(master, name, config.node)
        self.config = config
        self.state = DriveState.UNKNOWN
        self.position_m = self.speed_m_s = self.current_a = self.target_speed_m_s = 0.0
        self.statusword = 0
        self.analog_mv = (0.0, 0.0)
        self.analog_time_s = -math.inf
        self.mode = self.driving_mode = DRIVING_MODES[config.mode]
        self.outputs = OutputBits(self.sdo)
        self.on_ready_change: list[Callable[[bool], None]] = []
        self._units = WheelUnits.of(config)
        self._rpm_per_m_s, self._top_speed_m_s = self._units.rpm_per_m_s, config.max_speed_m_s
        self._travel = Travel(self._units, config.max_speed_m_s)
        self._setup: EposSetup | None = None
        self._was_ready = False
        self._target_rpm = 0
        self._controlword = int(Command.DISABLE_VOLTAGE)
        self._rpdo1, self._rpdo3 = rpdo_cob_id(1, config.node), rpdo_cob_id(3, config.node)
        self._send = master.bus.send
        self._period_s = 1.0 / master.network.cycle_hz
        self._stale_s = master.network.late_after_cycles * self._period_s
        self.turns = Turns(self.who, config.node)
        self.waiters = StatuswordWaiters(self.who, config.node)
        self._insisting = asyncio.Lock()
        master.subscribe(tpdo_cob_id(1, config.node), self._on_tpdo1)
        self._reads_analog = config.analog_inputs
        self._stop_input = EmergencyStopInput(config.emergency_stop, self.who) if config.emergency_stop else None
        if config.tells_inputs:
            master.subscribe(tpdo_cob_id(2, config.node), self._on_tpdo2)

    # --- cyclic --------------------------------------------------------------------------------------------------

    def _on_tpdo1(self, can_id: int, data: bytes, timestamp: float) -> None:
        if len(data) != TPDO1_BYTES:
            self.master.counters.malformed += 1
            return
        statusword, raw_qc, current_ma = _unpack_tpdo1(data)
        travel = self._travel
        travel.take(raw_qc, timestamp)
        self.reading_time_s = timestamp
        self.position_m, self.speed_m_s = travel.position_m, travel.speed_m_s
        self.current_a = current_ma * 1e-3
        if statusword != self.statusword or self.state is _UNKNOWN:
            self._on_statusword(statusword)
        if self.waiters:
            self.waiters.take(statusword)
        if self.on_reading is not None and not self._reads_analog:
            self.on_reading(self.node)

    def _on_tpdo2(self, can_id: int, data: bytes, timestamp: float) -> None:
        """Comes after TPDO1 of the same SYNC, because its identifier is larger, and completes the reading."""
        if len(data) != TPDO2.size:
            self.master.counters.malformed += 1
            return
        x_mv, y_mv, inputs = TPDO2.unpack(data)
        self.analog_mv = (x_mv, y_mv)
        self.analog_time_s = timestamp
        if self._stop_input is not None:
            self._stop_input.take(inputs, timestamp)
        if self.on_reading is not None and self._reads_analog:
            self.on_reading(self.node)

    @property
    def emergency_stop(self) -> str:
        """Why it demands an emergency stop; empty where it does not."""
        if self._stop_input is None or self.node_state is not NodeState.READY:
            return ""
        return self._stop_input.reason(self.reading_time_s)

    def command_speed(self, speed_m_s: float) -> None:
        """Take a target speed at the rim for the next :meth:`transmit`; zero unless enabled in the driving mode."""
        if self.state is not _ENABLED or self.mode is not self.driving_mode or speed_m_s != speed_m_s:
            speed_m_s = 0.0
        elif abs(speed_m_s) > self._top_speed_m_s:
            speed_m_s = math.copysign(self._top_speed_m_s, speed_m_s)
        self.target_speed_m_s = speed_m_s
        self._target_rpm = round(speed_m_s * self._rpm_per_m_s)

    def transmit(self, deadline_s: float) -> None:
        """Send controlword and target of this cycle."""
        if self.node_state is _READY:
            self._send(self._rpdo1, _pack_rpdo1(self._controlword, self._target_rpm), deadline_s)

    def _command(self, controlword: int) -> None:
        """Send a controlword now; it counts at the next SYNC and is repeated by each cycle."""
        self._controlword = controlword
        self.transmit(asyncio.get_running_loop().time() + self._stale_s)

    def _command_unless_stopped(self, controlword: int) -> None:
        self.turns.require_unstopped()
        self._command(controlword)

    def _drop_target(self) -> None:
        self.target_speed_m_s = 0.0
        self._target_rpm = 0

    # --- states --------------------------------------------------------------------------------------------------

    def _on_statusword(self, statusword: int) -> None:
        self.statusword = statusword
        before, self.state = self.state, drive_state(statusword)
        if self.state is before:
            return
        if self.state is DriveState.FAULT:
            self._stand_down()
            if self.fault is None:
                message = f"{self.who} is in fault (statusword 0x{statusword:04X})"
                self.fault = self.make_fault(0, message, "read its error history 0x1003/1, then reset the fault")
        elif before is DriveState.ENABLED and self._controlword & 0xF == Command.ENABLE_OPERATION:
            self._stand_down()
            message = f"{self.who} left operation enabled by itself (statusword 0x{statusword:04X})"
            self.fault = self.make_fault(0, message, "check its digital inputs and its supply, then reset")

    def _stand_down(self) -> None:
        """From now on command nothing that could move the drive."""
        self._drop_target()
        self._controlword = int(Command.DISABLE_VOLTAGE)

    def _interrupt(self, error: CanhelmError) -> None:
        """End every transition that is on its way."""
        self.turns.stop()
        self.waiters.interrupt(error)

    # --- commands ------------------------------------------------------------------------------------------------

    async def enable(self) -> None:
        """Write a zero target, take the drive to Operation Enabled in its driving mode; returns when it is there.

        Raises:
            NotReady: the node is not configured, started and guarded.
            DeviceFault: it is in fault, or the mode was not taken.
            Timeout: it did not get there; the message says where it stands and which bit is missing.
            Refused: a stop came in between.
        """
        self.require_ready()
        if self.state is DriveState.FAULT:
            raise self.device_fault()
        async with self.turns.take():
            try:
                await self.enter_mode(self.driving_mode)
                await device_control.walk_to(self, State.OPERATION_ENABLED, self._command)
            except (CanhelmError, asyncio.CancelledError):
                if not self.turns.stopped and self.node_state is NodeState.READY:
                    self._command(Command.DISABLE_VOLTAGE)
                raise

    async def disable(self) -> None:
        """Switch the power stage off and return when it is off; the axis then coasts.

        Raises:
            NotReady: the node is not ready.
            DeviceFault: it did not follow its PDOs, and was switched off by other means.
        """
        self.require_ready()
        async with self._insisting:  # a quick stop that is not proven yet goes first: who is silent runs on meanwhile
            self._interrupt(Refused(f"{self.who} was disabled in the meantime", node=self.node))
        self._drop_target()
        self._command(Command.DISABLE_VOLTAGE)
        if is_powered(self.statusword):
            readings = itertools.count()
            with contextlib.suppress(Timeout):
                await self.waiters.reach(
                    lambda word: not is_powered(word) or next(readings) == INSIST_CYCLES, "power stage off"
                )
            if is_powered(self.statusword):
                await device_control.switch_off_otherwise(self)

    def quick_stop(self) -> None:
        """Command the quick stop by RPDO3 and RPDO1; a drive that is off is just kept from being enabled."""
        self._interrupt(Refused(f"{self.who} was stopped in the meantime", node=self.node, remedy="enable it again"))
        self._drop_target()
        self._controlword = int(Command.QUICK_STOP)
        if self.node_state is NodeState.READY and self.state is not DriveState.DISABLED:
            self._send_quick_stop()

    def _send_quick_stop(self) -> None:
        soon_s = asyncio.get_running_loop().time() + self._stale_s
        self._send(self._rpdo3, make_rpdo3(Command.QUICK_STOP, self.mode), soon_s)
        self._send(self._rpdo1, _pack_rpdo1(Command.QUICK_STOP, 0), soon_s)

    async def insist_on_stop(self) -> None:
        """See :func:`drivers.epos.device_control.insist_on_stop`."""
        async with self._insisting:
            await device_control.insist_on_stop(self, INSIST_CYCLES * self._stale_s)

    async def reset_fault(self) -> None:
        """Clear a fault by a rising edge of the fault reset bit.

        Raises:
            NotReady: the node is not ready.
            DeviceFault: the drive stays in fault: the cause is still there.
        """
        self.require_ready()
        async with self.turns.take():
            if self.state is DriveState.FAULT:
                await device_control.reset_fault(self, self._command)
        self.fault = None

    def device_fault(self) -> DeviceFault:
        """The drive's fault as an error."""
        fault = self.fault or self.make_fault(0, f"{self.who} is in fault", "reset the fault")
        remedy = fault.remedy or "reset the fault"
        return DeviceFault(fault.message, node=self.node, value=fault.code or None, remedy=remedy)

    # --- modes ---------------------------------------------------------------------------------------------------

    async def enter_mode(self, mode: Mode) -> None:
        """See :func:`drivers.epos.device_control.enter_mode`."""
        self._drop_target()
        await device_control.enter_mode(self, mode, self._command)
        self.mode = mode

    async def write(self, *settings: tuple[Any, int]) -> None:
        """Write objects in their order. Raises NodeAbsent, Timeout or Aborted."""
        for entry, value in settings:
            await self.sdo.write(entry, value)

    def require_enabled(self) -> None:
        """Raise NotReady unless the drive is in Operation Enabled."""
        self.require_ready()
        if self.state is not DriveState.ENABLED:
            raise NotReady(f"{self.who} is {self.state}", node=self.node, remedy=f"`canhelm motor enable {self.name}`")

    async def use_driving_mode(self) -> None:
        """Back to the mode of the profile, with a zero target. Raises NotReady, DeviceFault, NodeAbsent or Aborted."""
        self.require_ready()
        self._drop_target()
        if self.mode is not self.driving_mode:
            async with self.turns.take():
                await self.enter_mode(self.driving_mode)

    async def set_current(self, current_a: float) -> None:
        """See :func:`drivers.epos.moves.set_current`."""
        async with self.turns.take():
            await moves.set_current(self, current_a)

    async def move_to(self, position_qc: int, *, relative: bool, speed_rpm: float) -> None:
        """See :func:`drivers.epos.moves.move_to`."""
        async with self.turns.take():
            await moves.move_to(self, position_qc, relative, speed_rpm, self._command_unless_stopped)

    async def home(self, method: int) -> None:
        """See :func:`drivers.epos.moves.home`."""
        async with self.turns.take():
            await moves.home(self, method, self._command_unless_stopped)

    @property
    def at_target(self) -> bool:
        """True when the last move or homing reached its target."""
        return moves.at_target(self.mode, self.statusword)

    def rpm_from_speed(self, speed_m_s: float) -> float:
        """Motor speed in rpm for a rim speed."""
        return speed_m_s * self._units.rpm_per_m_s

    def speed_from_rpm(self, speed_rpm: float) -> float:
        """Rim speed for a motor speed in rpm."""
        return speed_rpm / self._units.rpm_per_m_s

    # --- boot-up -------------------------------------------------------------------------------------------------

    def boot_steps(self) -> tuple[Step, ...]:
        """Configuration in pre-operational; see :class:`drivers.epos.configure.EposSetup`."""
        self._setup = self._make_setup()
        return self._setup.steps()

    def urgent_steps(self) -> tuple[Step, ...]:
        """One that was ready may still turn, and has no life guarding where its communication was reset."""
        was_ready, self._was_ready = self._was_ready, False
        return (self._make_setup().stop_step(),) if was_ready else ()

    def _make_setup(self) -> EposSetup:
        return EposSetup(self.config, self.master, self.sdo, self.who, self.outputs, self._stop_input)

    @property
    def confirmed(self) -> dict[ObjectDef, int]:
        """What its last configuration has read back; empty unless it is ready."""
        return self._setup.confirmed if self._setup and self.node_state is NodeState.READY else {}

    def start_steps(self) -> tuple[Step, ...]:
        """Its first reading proves that PDO mapping and SYNC work."""
        self.reading_time_s = -math.inf
        self._travel.begin_anew()
        if self._stop_input:
            self._stop_input.begin_anew(asyncio.get_running_loop().time())
        return (Step("waiting for its first reading (TPDO1 after SYNC)", self._first_reading),)

    async def _first_reading(self) -> None:
        await self.waiters.reach(lambda _: True, "its first reading")

    def on_ready(self) -> None:
        """Configured: in its driving mode, disabled, all targets zero; a fault is gone unless it still shows it."""
        self._was_ready = True
        self.mode = self.driving_mode
        self._stand_down()
        if self.state is not DriveState.FAULT:
            self.fault = None
        for changed in self.on_ready_change:
            changed(True)

    def on_lost(self, fault: Fault) -> None:
        """Nothing is known of it any more, and nothing is commanded but a last quick stop, which it may still hear."""
        if self.state not in (DriveState.DISABLED, DriveState.FAULT, DriveState.UNKNOWN):
            self._send_quick_stop()
        self._stand_down()
        self.state = DriveState.UNKNOWN
        self.speed_m_s = self.current_a = 0.0
        self._interrupt(NotReady(fault.message, node=self.node, remedy=fault.remedy))
        for changed in self.on_ready_change:
            changed(False)

    def on_emcy(self, code: int, register: int, vendor: bytes) -> Fault | None:
        """An emergency: the drive reacts by itself; here it is put into words."""
        if code == 0:
            return None
        meaning, cure = emergency_words(code)
        fault = self.make_fault(code, f"{self.who} reports {meaning}", cure)
        if code != SENSOR_ERROR or not self.configuring.locked():
            self.fault = fault
        return fault

    async def before_close(self) -> None:
        """End life guarding of a drive that is off, so that it does not report its master lost."""
        if self.state is DriveState.DISABLED:
            await self.write((OBJECTS["life_time_factor"], 0))

    def status(self) -> dict[str, Any]:
        """Everything about the drive; speeds also at the motor. Adding 0.0 turns -0.0 into 0.0."""
        return super().status() | {
            "state": str(self.state),
            "mode": self.mode.words,
            "statusword": f"0x{self.statusword:04X}",
            "velocity_rpm": round(self.rpm_from_speed(self.speed_m_s), 1) + 0.0,
            "speed_m_s": round(self.speed_m_s, 4) + 0.0,
            "target_speed_m_s": round(self.target_speed_m_s, 4) + 0.0,
            "position_m": round(self.position_m, 5) + 0.0,
            "current_a": round(self.current_a, 3) + 0.0,
        }
