"""A rotary encoder with CANopen profile CiA 406 on the vertical axis of a wheel pair."""

from __future__ import annotations

import asyncio
import struct
from collections.abc import Callable
from math import floor, tau

from drivers.canopen.codes import NmtState
from drivers.encoder.objects import MULTI_TURN, OBJECTS, SINGLE_TURN
from drivers.simulated.angle_sensor import SimulatedAngleSensor
from drivers.simulated.bus import SimulatedPort
from drivers.simulated.dictionary import TOO_HIGH, SdoAbort, SimulatedDictionary, Value
from drivers.simulated.lss_slave import UNCONFIGURED, LssSlave
from drivers.simulated.node import Handler, SimulatedNode
from drivers.simulated.world import World
from profiles.schema import EncoderConfig
from profiles.sensors import SensorDefects

_GUARDING, _LSS_REQUEST, _LSS_ANSWER = 0x700, 0x7E5, 0x7E4
_IDENTITY = ("vendor_id", "product_code", "revision_number", "identity_serial_number")
_FACTORY_IDENTITY = (0x0000_0000, 0x0406_1000, 0x0001_0002)
"""Vendor 0, which CiA gave to nobody; product and revision are assumed."""
_FIRST_SERIAL = 0x2026_0000
_REVERSED, _SCALED = 1 << 0, 1 << 2
_POSITION_ALARM = 0x5000
_ALARMS = struct.Struct("<HH")
_TYPES = frozenset((1, 254, 255))


class Periodic:
    """Calls back at absolute multiples of a period that may be changed or switched off.

    Args:
        callback: what to call.
    """

    def __init__(self, callback: Callable[[], None]) -> None:
        self._callback = callback
        self._period_s = 0.0
        self._due_s = 0.0
        self._timer: asyncio.TimerHandle | None = None

    def set(self, period_s: float) -> None:
        """Start anew with a period; 0 switches off."""
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        self._period_s = period_s
        if period_s > 0.0:
            self._due_s = asyncio.get_running_loop().time()
            self._arm()

    def _arm(self) -> None:
        self._due_s += self._period_s
        self._timer = asyncio.get_running_loop().call_at(self._due_s, self._run)

    def _run(self) -> None:
        self._arm()
        self._callback()


class SimulatedEncoder(SimulatedNode):
    """Position value of a wheel pair's heading.

    Without scaling the counts are those of the sensor; operating parameter bit 2 switches to the units of 0x6001 and
    0x6002, bit 0 reverses the direction that the profile gives. The preset's offset is kept only when it is saved.

    Args:
        port: its connection to the bus.
        config: the encoder of the profile.
        pair: name by which the world knows the wheel pair.
        world: the physics.
        boot_delay_s: time from power-up to the boot-up message.
        sensor: what it reads its axis by; None: one without fault.

    Attributes:
        sensor: between the wheel pair and the counts.
        lss: its LSS slave, with node id and bit rate that it has stored.
    """

    def __init__(
        self,
        port: SimulatedPort,
        config: EncoderConfig,
        pair: str,
        world: World,
        boot_delay_s: float,
        sensor: SimulatedAngleSensor | None = None,
    ) -> None:
        turns = max(1, (config.total_counts or config.counts_per_turn) // config.counts_per_turn)
        factory: dict[str, Value] = {
            **dict(zip(_IDENTITY, (*_FACTORY_IDENTITY, _FIRST_SERIAL + config.node), strict=True)),
            "device_type": SINGLE_TURN if turns == 1 else MULTI_TURN,
            "device_name": "CiA 406 encoder",
            "save_all_parameters": 1,
            "restore_all_defaults": 1,
            "measuring_units_per_turn": config.counts_per_turn,
            "total_measuring_range": config.total_counts or config.counts_per_turn,
            "single_turn_resolution": config.counts_per_turn,
            "number_of_turns": turns,
        }
        dictionary = SimulatedDictionary(OBJECTS, config.node, factory, ("preset_value",), ("offset_value",))
        self._config = config
        self._pair = pair
        self._world = world
        self.sensor = sensor or SimulatedAngleSensor(SensorDefects())
        self._alarms = 0
        identity = (*_FACTORY_IDENTITY, _FIRST_SERIAL + config.node)
        self.lss = LssSlave(identity, config.node, self._lss_ended)
        self._cyclic = Periodic(self._send_cyclic)
        self._heartbeat = Periodic(self._send_heartbeat)
        super().__init__(
            port,
            config.node,
            dictionary,
            receive_pdos=0,
            transmit_pdos=2,
            boot_delay_s=boot_delay_s,
            transmit_types=_TYPES,
            block_transfer=True,
        )
        self._describe_position()

    def _describe_position(self) -> None:
        readers, checks, actions = self.dictionary.readers, self.dictionary.checks, self.dictionary.actions
        address = self.dictionary.address
        readers[address("position_value")] = self.position
        readers[address("alarms")] = lambda: self._alarms
        readers[address("operating_status")] = lambda: self.dictionary.number("operating_parameters")
        checks[address("preset_value")] = self._check_preset
        actions[address("preset_value")] = self._preset
        actions[address("cyclic_timer")] = self._tie("tpdo1_event_timer")
        actions[address("tpdo1_event_timer")] = self._tie("cyclic_timer")
        actions[address("producer_heartbeat_time")] = lambda _: self._set_heartbeat()

    # Position

    def position(self) -> int:
        """Position value: whole counts within the measuring range."""
        return (self._raw() + self.dictionary.number("offset_value")) % self._range()

    def _range(self) -> int:
        number = self.dictionary.number
        if number("operating_parameters") & _SCALED:
            return max(1, number("total_measuring_range"))
        return self._config.total_counts or self._config.counts_per_turn

    def _raw(self) -> int:
        config, per_turn = self._config, self._config.counts_per_turn
        parameters = self.dictionary.number("operating_parameters")
        sign = -config.direction if parameters & _REVERSED else config.direction
        angle = self.sensor.sense(self._world.heading_rad(self._pair))
        counts = config.zero_counts + sign * angle / tau * per_turn
        if parameters & _SCALED:
            counts *= self.dictionary.number("measuring_units_per_turn") / per_turn
        return floor(counts + 0.5)

    def _check_preset(self, value: int) -> None:
        if value >= self._range():
            raise SdoAbort(TOO_HIGH)

    def _preset(self, value: int) -> None:
        counts = self._range()
        offset = (value - self._raw() + counts // 2) % counts - counts // 2
        self.dictionary.values[self.dictionary.address("offset_value")] = offset

    # Alarms

    def set_alarms(self, alarms: int) -> None:
        """Raise alarms (bits of 0x6503) or clear them with 0; an EMCY tells of both."""
        if alarms == self._alarms or not self.powered:
            return
        self._alarms = alarms
        code, register = (_POSITION_ALARM, 0x01) if alarms else (0, 0)
        self.emergency(code, register, _ALARMS.pack(alarms, self.dictionary.number("warnings")))

    # Life of the node

    def before_access(self, now_s: float) -> None:
        """Bring the world up to this moment."""
        self._world.advance(now_s)

    def before_start(self, whole: bool) -> None:
        """Node id and bit rate come from LSS."""
        if whole:
            self.lss.power_up()
        else:
            self.lss.reset_communication()
        self.take_node_id(self.lss.node_id)
        if whole and self.lss.bit_rate is not None:
            self.port.set_bit_rate(self.lss.bit_rate)

    def services(self) -> dict[int, Handler]:
        """LSS is served while no process data flows; a device without a node id has nothing else to do."""
        silent = self.nmt_state is NmtState.BOOT_UP and self.node_id != UNCONFIGURED
        return {} if silent or self.nmt_state is NmtState.OPERATIONAL else {_LSS_REQUEST: self._on_lss}

    def _on_lss(self, data: bytes, _: float) -> None:
        answer = self.lss.answer(data)
        if answer is not None:
            self.port.send(_LSS_ANSWER, answer)

    def _lss_ended(self) -> None:
        """A device that had no node id and was given one starts by itself (CiA 305)."""
        if self.node_id == UNCONFIGURED and self.lss.pending != UNCONFIGURED:
            self.reset_communication()

    def application_stopped(self) -> None:
        """Power lost or reset."""
        self._alarms = 0

    def nmt_changed(self) -> None:
        """TPDO1 is sent once on entering Operational, then cyclically; the heartbeat runs once the node has booted."""
        if self.nmt_state is NmtState.OPERATIONAL:
            self._send_cyclic()
        self._set_cyclic()
        self._set_heartbeat()

    def _tie(self, other: str) -> Callable[[int], None]:
        """Cyclic timer and event timer are one value under two addresses."""

        def action(value: int) -> None:
            self.dictionary.values[self.dictionary.address(other)] = value
            self._set_cyclic()

        return action

    def _set_cyclic(self) -> None:
        running = self.nmt_state is NmtState.OPERATIONAL
        self._cyclic.set(0.001 * self.dictionary.number("cyclic_timer") if running else 0.0)

    def _set_heartbeat(self) -> None:
        running = self.nmt_state is not NmtState.BOOT_UP
        self._heartbeat.set(0.001 * self.dictionary.number("producer_heartbeat_time") if running else 0.0)

    def _send_cyclic(self) -> None:
        pdo = self.tpdos[0]
        if pdo.transmission_type != 1:
            self.before_access(asyncio.get_running_loop().time())
            self.send_pdo(pdo)

    def _send_heartbeat(self) -> None:
        self.port.send(_GUARDING + self.node_id, bytes((self.nmt_state,)))
