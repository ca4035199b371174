"""Faults that strike devices: how each kind begins to act on nodes, sensors, brakes, wheels and bricks, and ends."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from dataclasses import dataclass, field
from math import inf, radians
from pathlib import Path
from random import Random

from canhelm.errors import UsageError
from drivers.canopen.objects import parse_address
from drivers.epos.codes import EMERGENCIES
from drivers.simulated.bus import SimulatedBus, SimulatedPort
from drivers.simulated.computer_trouble import ComputerTrouble
from drivers.simulated.dictionary import Address, Value
from drivers.simulated.encoder import SimulatedEncoder
from drivers.simulated.epos import SimulatedEpos
from drivers.simulated.network import SimulatedNetwork
from drivers.simulated.node import SimulatedNode
from drivers.simulated.serial_wire import QUIET, SerialCable, SerialNoise
from drivers.simulated.world import Axis
from profiles.faults import Fault

ICE = 0.02
"""Coefficient of friction of rubber on wet ice (assumed)."""
POWER_CYCLE_S = 1.0
_IDENTITY = "0x1000"
"""Device type (CiA 301 7.5.2.1)."""
_GENERIC_ERROR = 0x01
_BABBLE_ID, _BABBLE = 0x001, bytes(8)
_BABBLE_S, _BABBLE_DEPTH = 0.001, 16
"""So often a babbling node fills its queue of so many frames, which take longer on a wire of 1 Mbit/s."""


def _nothing() -> None:
    """For a fault that is over as soon as it has struck."""


@dataclass(frozen=True, slots=True)
class Effect:
    """What a fault does.

    Attributes:
        begin: lets it act.
        end: takes it away.
        lasts_s: how long it lasts by itself; None: as long as the fault says.
    """

    begin: Callable[[], None]
    end: Callable[[], None] = _nothing
    lasts_s: float | None = None


@dataclass(frozen=True, slots=True)
class Site:
    """Where faults happen.

    Attributes:
        network: the simulated robot.
        medium: its bus.
        port: by which the daemon, or the interface to it, is on that bus; None where it is not.
        cable: of a simulated serial line; None where there is none.
        computer: that the daemon runs on; None where it is in another process.
        socket: of the daemon; None where it has none, or is in another process.
        shafts: between motors and drives whose encoders were broken once, by the drives' names.
    """

    network: SimulatedNetwork
    medium: SimulatedBus
    port: SimulatedPort | None = None
    cable: SerialCable | None = None
    computer: ComputerTrouble | None = None
    socket: Path | None = None
    shafts: dict[str, FaultyShaft] = field(default_factory=dict)


Maker = Callable[[Site, Fault, Random], Effect]


def _node_of(site: Site, fault: Fault) -> SimulatedNode:
    return site.network.node(fault.part or "")


# Nodes


def _node_reset(site: Site, fault: Fault, _: Random) -> Effect:
    node = _node_of(site, fault)
    return Effect(lambda: node.restart() if node.powered else None)


def _communication_reset(site: Site, fault: Fault, _: Random) -> Effect:
    node = _node_of(site, fault)
    return Effect(lambda: node.reset_communication() if node.powered else None)


def _power_cycle(site: Site, fault: Fault, _: Random) -> Effect:
    node, had_power = _node_of(site, fault), False

    def begin() -> None:
        nonlocal had_power
        had_power = node.powered
        node.power_off()

    return Effect(begin, lambda: node.power_on() if had_power else None, fault.for_s or POWER_CYCLE_S)


def _emcy(site: Site, fault: Fault, _: Random) -> Effect:
    node, code = _node_of(site, fault), fault.code or 0
    if not isinstance(node, SimulatedEpos) or code not in EMERGENCIES:
        return Effect(lambda: node.emergency(code, _GENERIC_ERROR if code else 0))
    lasting = fault.for_s is not None
    return Effect(lambda: node.trigger_fault(code, lasting=lasting), lambda: node.clear_cause(code))


class _Lie:
    """What an object says instead of the truth; a later one takes its place."""

    def __init__(self, readers: dict[Address, Callable[[], Value]], address: Address, said: Value) -> None:
        self._readers, self._address, self._said = readers, address, said
        self._truth: Callable[[], Value] | None = None

    def __call__(self) -> Value:
        return self._said

    def begin(self) -> None:
        """Let the object say it."""
        before = self._readers.get(self._address)
        self._truth = before._truth if isinstance(before, _Lie) else before
        self._readers[self._address] = self

    def end(self) -> None:
        """Let the object tell the truth again, unless it says something else meanwhile."""
        if self._readers.get(self._address) is self:
            del self._readers[self._address]
            if self._truth is not None:
                self._readers[self._address] = self._truth


def _wrong_identity(site: Site, fault: Fault, _: Random) -> Effect:
    dictionary = _node_of(site, fault).dictionary
    address = parse_address(fault.object or _IDENTITY) or (0, 0)
    if address not in dictionary.objects:
        what = f"{fault.part} has no object {fault.object}"
        remedy = "give one that it has, as `canhelm object list` lists them"
        raise UsageError(what, object="object", value=fault.object, remedy=remedy)
    said: Value | None = fault.value
    if said is None:
        before = dictionary.getter(address)()
        said = before + 1 if isinstance(before, int) else 0
    lie = _Lie(dictionary.readers, address, said)
    return Effect(lie.begin, lie.end)


class _Babbler:
    """A node whose transmitter runs away."""

    def __init__(self, site: Site, fault: Fault) -> None:
        self._medium = site.medium
        self._can_id = _BABBLE_ID if fault.cob_id is None else fault.cob_id
        self._name = f"{fault.part} (babbling)"
        self._port: SimulatedPort | None = None
        self._timer: asyncio.TimerHandle | None = None

    def begin(self) -> None:
        """Begin."""
        self._port = self._medium.port(self._name, _BABBLE_DEPTH)
        self._port.connected = True
        self._fill(self._port)

    def _fill(self, port: SimulatedPort) -> None:
        while port.queued < _BABBLE_DEPTH:
            port.send(self._can_id, _BABBLE)
        self._timer = asyncio.get_running_loop().call_later(_BABBLE_S, self._fill, port)

    def end(self) -> None:
        """End."""
        if self._port is not None and self._timer is not None:
            self._timer.cancel()
            self._medium.detach(self._port)


def _babbling(site: Site, fault: Fault, _: Random) -> Effect:
    babbler = _Babbler(site, fault)
    return Effect(babbler.begin, babbler.end)


# Encoders


class _Distortion:
    """What a broken encoder makes of an angle and a speed [rad, rad/s]."""

    def __init__(self, fault: Fault, random: Random) -> None:
        self._kind = fault.kind
        self._angle_rad = radians(fault.angle_deg or 0.0)
        self._random = random
        self._first_rad: float | None = None

    def angle(self, true_rad: float) -> float:
        """The angle that it says."""
        if self._first_rad is None:
            self._first_rad = true_rad
        if self._kind == "encoder_stuck":
            return self._first_rad
        if self._kind == "encoder_reversed":
            return 2.0 * self._first_rad - true_rad
        if self._kind == "encoder_noise":
            return true_rad + self._random.gauss(0.0, self._angle_rad)
        return true_rad + self._angle_rad

    def speed(self, true_rad_s: float) -> float:
        """The speed that a drive finds by it."""
        return {"encoder_stuck": 0.0, "encoder_reversed": -true_rad_s}.get(self._kind, true_rad_s)


class FaultyShaft:
    """Between a motor's shaft and its drive: the drive regulates and reports by what its broken encoder says.

    Args:
        drive: whose encoder it is.
    """

    def __init__(self, drive: SimulatedEpos) -> None:
        self._motion = drive.motion
        self._true: Axis = drive.motion.axis
        self._shown = Axis()
        self._distortion: _Distortion | None = None

    def begin(self, distortion: _Distortion) -> None:
        """Let the encoder be broken in this way, and no longer in another."""
        if self._distortion is None:
            self._shown.torque_source = self._true.torque_source
            self._motion.axis, self._true.torque_source = self._shown, self
        self._distortion = distortion
        self._look(distortion, self._true.speed_rad_s, self._true.position_rad)

    def end(self, distortion: _Distortion) -> None:
        """Let it be whole again, unless it is broken in another way meanwhile."""
        if self._distortion is distortion:
            self._distortion = None
            self._motion.axis, self._true.torque_source = self._true, self._shown.torque_source

    def _look(self, distortion: _Distortion, speed_rad_s: float, position_rad: float) -> None:
        self._shown.position_rad = distortion.angle(position_rad)
        self._shown.speed_rad_s = distortion.speed(speed_rad_s)
        self._shown.current_a = self._true.current_a

    def current_demand(self, speed_rad_s: float, position_rad: float, dt_s: float) -> float:
        """Demand of motor current [A] for the coming step."""
        shown, source, distortion = self._shown, self._shown.torque_source, self._distortion
        if distortion is not None:
            self._look(distortion, speed_rad_s, position_rad)
        return 0.0 if source is None else source.current_demand(shown.speed_rad_s, shown.position_rad, dt_s)


def _encoder_fault(site: Site, fault: Fault, random: Random) -> Effect:
    node, distortion = _node_of(site, fault), _Distortion(fault, random)
    if isinstance(node, SimulatedEpos):
        shaft = site.shafts.setdefault(fault.part or "", FaultyShaft(node))
        return Effect(lambda: shaft.begin(distortion), lambda: shaft.end(distortion))
    assert isinstance(node, SimulatedEncoder)
    sensor, broken = node.sensor, distortion.angle

    def end() -> None:
        if sensor.broken is broken:
            sensor.broken = None

    return Effect(lambda: setattr(sensor, "broken", broken), end)


# Brakes, wheels, motors


def _brake_fault(site: Site, fault: Fault, _: Random) -> Effect:
    brake, engaged = site.network.brakes[fault.part or ""], fault.kind == "brake_stuck"
    return Effect(lambda: brake.wear_out(engaged), lambda: brake.wear_out(None))


def _ice(site: Site, fault: Fault, _: Random) -> Effect:
    world = site.network.world
    contact = world.contacts.get(fault.part or "")
    if contact is None:
        known = ", ".join(world.contacts) or "none in this simulation"
        what = f"{fault.part} drives no wheel on a floor"
        raise UsageError(what, object="part", value=fault.part, remedy=f"wheels on a floor: {known}")
    friction = ICE if fault.friction is None else fault.friction
    return Effect(lambda: contact.lay_ice(friction), lambda: contact.lay_ice(inf))


def _motor_blocked(site: Site, fault: Fault, _: Random) -> Effect:
    name = fault.part or ""
    world = site.network.world_of(name)
    return Effect(lambda: world.block(name, True), lambda: world.block(name, False))


def _motor_open(site: Site, fault: Fault, _: Random) -> Effect:
    motion = site.network.drives[fault.part or ""].motion
    return Effect(lambda: setattr(motion, "cable_off", True), lambda: setattr(motion, "cable_off", False))


# The way to the daemon


def _adapter_fault(site: Site, fault: Fault, _: Random) -> Effect:
    port, cable = site.port, site.cable
    if cable is not None and fault.kind == "unplugged":
        return Effect(lambda: setattr(cable, "pulled", True), lambda: setattr(cable, "pulled", False))
    if port is None:
        remedy = "over a serial line the cable is unplugged" if cable else "leave it out"
        raise UsageError("there is no CAN adapter here", object="kind", value=fault.kind, remedy=remedy)
    why = "its controller is bus-off" if fault.kind == "bus_off" else "the adapter is unplugged"

    def switch(connected: bool) -> None:
        port.connected = connected
        port.down = None if connected else why

    return Effect(lambda: switch(False), lambda: switch(True))


def _serial_noise(site: Site, fault: Fault, _: Random) -> Effect:
    cable = site.cable
    if cable is None:
        remedy = "give --bus rs232 (rs232:pty for `canhelm simulate`)"
        raise UsageError("there is no simulated serial line here", object="kind", value=fault.kind, remedy=remedy)

    def set_noise(noise: SerialNoise) -> None:
        cable.to_host.noise = cable.to_device.noise = noise

    return Effect(lambda: set_noise(SerialNoise(flip=fault.probability)), lambda: set_noise(QUIET))


def _brick_lost(site: Site, fault: Fault, _: Random) -> Effect:
    link = site.network.bricks[fault.part or ""].link

    def leave() -> None:
        link.reachable = False
        link.drop()

    return Effect(leave, lambda: setattr(link, "reachable", True))


MAKERS: dict[str, Maker] = {
    "node_reset": _node_reset,
    "communication_reset": _communication_reset,
    "power_cycle": _power_cycle,
    "babbling": _babbling,
    "wrong_identity": _wrong_identity,
    "emcy": _emcy,
    **dict.fromkeys(("encoder_stuck", "encoder_jump", "encoder_noise", "encoder_reversed"), _encoder_fault),
    **dict.fromkeys(("brake_slips", "brake_stuck"), _brake_fault),
    "ice": _ice,
    "motor_blocked": _motor_blocked,
    "motor_open": _motor_open,
    **dict.fromkeys(("bus_off", "unplugged"), _adapter_fault),
    "serial_noise": _serial_noise,
    "brick_lost": _brick_lost,
}
