"""The EPOS 24/5 on the simulated network, firmware 2011h, with its oddities.

Oddities that matter to a master: factory COB-IDs of the PDOs are those of node 1 whatever the node id; TPDOs of type
255 are sent on remote frames only; set values outlive a disable and act as soon as the drive is enabled; there is no
heartbeat; the position counter starts at 0 at each restart.

Source: maxon EPOS Firmware Specification, Communication Guide, Hardware Reference. Not modelled: modes -4, -5 and -6
(writing them to 0x6060 is refused), the data recorder, bit-rate changes (stored only).
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable

from drivers.epos.codes import EMERGENCIES
from drivers.epos.objects import OBJECTS
from drivers.epos.state_machine import Mode, State
from drivers.epos.value_tables import HOMING_METHODS, MOTOR_TYPES
from drivers.simulated.bus import SimulatedPort
from drivers.simulated.dictionary import LOAD, OUT_OF_RANGE, READ_ONLY, SdoAbort, SimulatedDictionary, Value
from drivers.simulated.epos_homing import Homing
from drivers.simulated.epos_io import NEGATIVE_LIMIT, DigitalInputs, DigitalOutputs
from drivers.simulated.epos_measurements import Measurements
from drivers.simulated.epos_motion import Motion
from drivers.simulated.epos_settings import FACTORY, PARAMETERS, VOLATILE, Settings, commissioned
from drivers.simulated.epos_state import DeviceControl
from drivers.simulated.node import SimulatedNode, signature_check
from drivers.simulated.world import Axis, World
from profiles.schema import DriveConfig

_MODES = frozenset(
    (
        Mode.HOMING,
        Mode.PROFILE_VELOCITY,
        Mode.PROFILE_POSITION,
        Mode.POSITION,
        Mode.VELOCITY,
        Mode.CURRENT,
    )
)
_UNDER_VOLTAGE, _OVER_VOLTAGE = 0x3220, 0x3210
_SUPPLY_RANGE_V = (11.0, 27.0)
"""Supply voltages outside which the drive reports a fault (assumed from the operating range)."""
_SENSOR = 0x7320
_LIFE_GUARDING = 0x8130
_LIMIT_SWITCHES = (0xFF06, 0xFF07)
_HALT, _MODE_START, _AT_ONCE, _RELATIVE = 1 << 8, 1 << 4, 1 << 5, 1 << 6
_REFERENCED = 1 << 15


class SimulatedEpos(SimulatedNode):
    """One drive with its motor.

    Args:
        port: its connection to the bus.
        config: the drive of the profile; its DIP switches are set to its node id.
        axis: the motor's shaft.
        world: the physics that the shaft belongs to.
        boot_delay_s: time from power-up to the boot-up message.
        seed: of the noise of its measurements.

    Attributes:
        control: its device control.
        motion: its motion control.
        homing: its homing mode.
        outputs: its digital outputs.
        dip_switches: node id that they are set to; 0, all off, for the id in object 0x2000.
        on_power_stage: called with True when the power stage is switched on, with False when off.
    """

    def __init__(
        self, port: SimulatedPort, config: DriveConfig, axis: Axis, world: World, boot_delay_s: float, seed: int
    ) -> None:
        dictionary = SimulatedDictionary(OBJECTS, config.node, FACTORY, VOLATILE)
        self.on_power_stage: Callable[[bool], None] = lambda _: None
        self.motion = Motion(config, axis, self._fault, self._ramp_ended)
        self.homing = Homing(self.motion)
        self.motion.homing = self.homing
        self.control = DeviceControl(self)
        self.outputs = DigitalOutputs(dictionary, lambda: self.control.state is not State.FAULT)
        self._inputs = DigitalInputs(dictionary, self._limit_switch, self._capture)
        self._settings = Settings(dictionary, self.motion, self.homing, config.encoder_pulses_per_turn)
        self._measurements = Measurements(
            self.motion, config.motor.pole_pairs, lambda: self._settings.rad_s_per_rpm, seed
        )
        self.dip_switches = config.node
        self._world = world
        self._word = 0
        self._sensor = (0, 0)
        self._supply_v = 24.0
        super().__init__(port, config.node, dictionary, receive_pdos=3, transmit_pdos=3, boot_delay_s=boot_delay_s)
        dictionary.commission(commissioned(config))
        self._describe_objects_of_drive()

    # What tests may do to it

    def set_digital_input(self, number: int, level: bool) -> None:
        """Apply a level to digital input 1 to 6."""
        self.before_access(asyncio.get_running_loop().time())
        self._inputs.set(number, level)

    def set_analog_input(self, number: int, value_mv: int) -> None:
        """Apply a voltage [mV] to analog input 1 or 2."""
        self.connect_analog_input(number, lambda: value_mv)

    def connect_analog_input(self, number: int, read: Callable[[], float]) -> None:
        """Measure a voltage [mV] at analog input 1 or 2 by ``read``, each time it is asked for."""
        self._measurements.analog_mv[number - 1] = read

    def set_supply_voltage(self, voltage_v: float) -> None:
        """Change the supply voltage as the drive measures it; outside its range the drive faults until it is back."""
        self._supply_v = voltage_v
        self.before_access(asyncio.get_running_loop().time())
        if self.control.state is not State.START:
            self._watch_supply()

    def _watch_supply(self) -> None:
        low, high = _SUPPLY_RANGE_V
        for code, present in ((_UNDER_VOLTAGE, self._supply_v < low), (_OVER_VOLTAGE, self._supply_v > high)):
            if present and code not in self.control.causes:
                self.control.causes.add(code)
                self._fault(code)
            elif not present:
                self.clear_cause(code)

    def trigger_fault(self, code: int, *, lasting: bool = False) -> None:
        """Let a fault come up: EMCY, error history, and the reaction of its class.

        Args:
            code: EMCY code.
            lasting: the cause stays, so that a fault reset does nothing, until :meth:`clear_cause`.

        A drive that is off or boots has no faults.
        """
        self.before_access(asyncio.get_running_loop().time())
        if lasting and self.control.state is not State.START:
            self.control.causes.add(code)
        self._fault(code)

    def clear_cause(self, code: int) -> None:
        """Let the cause of a fault go away; the drive still has to be reset."""
        self.control.causes.discard(code)

    # Life of the node

    def before_access(self, now_s: float) -> None:
        """Bring the world up to this moment, so that the past is computed with the past's commands."""
        self._world.advance(now_s)

    def before_start(self, whole: bool) -> None:
        """At power-up and at a reset the node id is taken from the DIP switches, or from the memory."""
        if whole:
            self.take_node_id(self.dip_switches or self.dictionary.kept_number("node_id_software"))

    def application_started(self) -> None:
        """Boot: position 0, set values and parameters as power-up finds them, state Switch On Disabled."""
        dictionary = self.dictionary
        self.motion.set_counts(0)
        self.homing.forget()
        self._word = self._measurements.captured_qc = 0
        self._sensor = self._settings.sensor
        self._settings.take_parameters()
        self._settings.take_set_values()
        self.motion.change_mode(Mode(dictionary.number("mode_of_operation")))
        self.control.initialised()
        self._inputs.restart()
        self.outputs.switch(powered=True)
        self._watch_supply()

    def application_stopped(self) -> None:
        """Power lost or reset: power stage off, outputs released."""
        self.control.restart()
        self.outputs.switch(powered=False)

    def master_lost(self) -> None:
        """Life guarding: the master is gone."""
        self._fault(_LIFE_GUARDING)

    def _fault(self, code: int) -> None:
        if self.control.state is State.START:
            return
        entry = EMERGENCIES[code]
        self.control.fault(entry.reaction or "D")
        self.outputs.refresh()
        self.emergency(code, self.error_register | (entry.register or 1))

    # Power stage, for device control

    def start(self, now_s: float) -> None:
        """Power stage on."""
        self._world.advance(now_s)
        self.motion.start(now_s)
        self.on_power_stage(True)

    def stop(self, now_s: float) -> None:
        """Power stage off."""
        if self.motion.powered:
            self.motion.stop(now_s)
            self.on_power_stage(False)

    def quick_stop(self) -> None:
        """Brake by the quick-stop ramp."""
        self.motion.quick_stop()

    def resume(self) -> None:
        """Leave the quick stop."""
        self.motion.resume()

    def _ramp_ended(self) -> None:
        self.control.ramp_ended()

    # Objects

    def _describe_objects_of_drive(self) -> None:
        dictionary = self.dictionary
        readers: dict[str, Callable[[], Value]] = {
            **self._measurements.readers(),
            "statusword": self._statusword,
            "recompute_pdo_cob_ids_from_node_id": lambda: 1,
        }
        actions: dict[str, Callable[[int], None]] = {
            **dict.fromkeys(PARAMETERS, self._settings.take_parameters),
            **self._settings.set_value_actions(),
            "controlword": self._on_controlword,
            "mode_of_operation": lambda value: self.motion.change_mode(Mode(value)),
            "encoder_pulses_per_turn": self._on_sensor_changed,
            "position_sensor_type": self._on_sensor_changed,
            "recompute_pdo_cob_ids_from_node_id": self._recompute_cob_ids,
        }
        checks: dict[str, Callable[[int], None]] = {
            "cob_id_sync": _refuse,
            "recompute_pdo_cob_ids_from_node_id": signature_check(LOAD),
            "mode_of_operation": _only(_MODES),
            "homing_method": _only(frozenset(HOMING_METHODS)),
            "motor_type": _only(frozenset(MOTOR_TYPES)),
        }
        dictionary.readers |= {dictionary.address(name): reader for name, reader in readers.items()}
        dictionary.actions |= {dictionary.address(name): action for name, action in actions.items()}
        dictionary.checks |= {dictionary.address(name): check for name, check in checks.items()}

    def _on_controlword(self, word: int) -> None:
        if word == self._word and self.motion.mode is not Mode.PROFILE_POSITION:
            return  # what it asks for was done when it came; only mode 1 looks at its level again
        rising = word & ~self._word
        self._word = word
        faulty = self.control.state is State.FAULT
        self.motion.set_halt(bool(word & _HALT))
        self.control.command(word)
        if faulty and self.control.state is not State.FAULT:
            self.error_register = 0
            self.outputs.refresh()
        if self.control.state is State.OPERATION_ENABLED:
            self._on_mode_bits(word, rising)

    def _on_mode_bits(self, word: int, rising: int) -> None:
        mode, number = self.motion.mode, self.dictionary.number
        if mode is Mode.PROFILE_POSITION:
            if rising & _MODE_START:
                relative, at_once = bool(word & _RELATIVE), bool(word & _AT_ONCE)
                self.motion.new_set_point(number("target_position"), relative=relative, at_once=at_once)
            elif not word & _MODE_START:
                self.motion.clear_set_point_bit()
        elif mode is Mode.HOMING and rising & _MODE_START:
            self.homing.start(number("homing_method"))

    def _statusword(self) -> int:
        referenced = _REFERENCED if self.homing.referenced else 0
        return self.control.state | self.motion.status_bits() | referenced

    def _on_sensor_changed(self, _: int) -> None:
        before, self._sensor = self._sensor, self._settings.sensor
        self._settings.take_parameters()
        if self._sensor != before:
            self._fault(_SENSOR)

    def _recompute_cob_ids(self, _: int) -> None:
        """Give the PDOs the identifiers of the node id; they act after saving and a restart."""
        bases = {0x1400: 0x200, 0x1800: 0x180}
        for index, base in bases.items():
            for n in range(3):
                self.dictionary.values[index + n, 1] = base + 0x100 * n + self.node_id

    def _limit_switch(self, function: int) -> None:
        self._fault(_LIMIT_SWITCHES[function - NEGATIVE_LIMIT])

    def _capture(self) -> None:
        self._measurements.captured_qc = self.motion.counts


def _refuse(_: int) -> None:
    raise SdoAbort(READ_ONLY)


def _only(allowed: frozenset[int]) -> Callable[[int], None]:
    """A check that lets only these codes pass."""

    def check(value: int) -> None:
        if value not in allowed:
            raise SdoAbort(OUT_OF_RANGE)

    return check
