"""What a bus SPEC means: the interface, the profile as it can be run over it, and what paces the control cycle."""

from __future__ import annotations

import asyncio
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import partial

from canhelm.errors import UsageError
from daemon.brick_ports import brick_port, is_brick_port
from daemon.runtime.clock import Ticker, VirtualTimeLoop
from daemon.runtime.cycle import Pace
from daemon.runtime.pace import LinePace
from daemon.runtime.sync_pace import SyncPace
from drivers.bus.broadcast_manager import kernel_repeats
from drivers.bus.contract import Bus
from drivers.bus.interfaces import open_bus
from drivers.bus.no_bus import NoBus
from drivers.bus.socketcan import SocketCanBus
from drivers.devices import Connect
from drivers.encoder.objects import OBJECTS as ENCODER_OBJECTS
from drivers.epos.first_look import FirstLook
from drivers.epos.serial_bus import SerialGatewayBus
from drivers.epos.serial_conversation import Transport
from drivers.epos.serial_first_look import first_look_over
from drivers.epos.serial_handshake import Exchange, Handshake
from drivers.epos.serial_handshake_v2 import StuffedExchange
from drivers.epos.serial_plan import facts, gateway_of, serial_profile
from drivers.epos.serial_tty import BAUD_RATES, SerialTty, require_serial_device
from drivers.simulated.bus import SimulatedBus
from drivers.simulated.network import SimulatedNetwork
from drivers.simulated.serial import SimulatedSerial
from drivers.simulated.serial_later import SimulatedLaterSerial
from drivers.simulated.serial_wire import SerialCable, SerialPty
from profiles.schema import Profile

DEFAULT_BAUD = 115200
READING_SHARE = 0.8
"""Of the longest cycle over a serial line, what its readings may take."""
_RS232 = re.compile(r"rs232(?P<colon>:(?P<device>[^@,]*))?(?:@(?P<baud>[^,]*))?(?:,(?P<framing>.*))?")
LATER_FRAMING = "epos2"
"""The framing of later drives on a serial line, behind a comma."""
OnLost = Callable[[str], None]
MakeExchange = Callable[[int], Exchange]


@dataclass(frozen=True, slots=True)
class Wire:
    """One way to a robot.

    Attributes:
        bus: the interface for the master.
        profile: the robot as it can be run over it.
        network, medium: the simulated network and its CAN bus; None on a real one.
        cable: the simulated serial cable, where there is one.
        pace: makes what ticks the control cycle, from period and callback.
        reading_share: share of a cycle that its readings may take.
        bricks: ways to the profile's NXT bricks, by their names.
    """

    bus: Bus
    profile: Profile
    network: SimulatedNetwork | None = None
    medium: SimulatedBus | None = None
    cable: SerialCable | None = None
    pace: Callable[[float, Callable[[], None]], Pace] = Ticker
    reading_share: float = 0.5
    bricks: Mapping[str, Connect] = field(default_factory=dict)


def make_wire(spec: str, profile: Profile, seed: int, built: Profile | None = None) -> Wire:
    """The way to a robot that a SPEC names.

    Args:
        spec: ``simulated``; ``rs232`` for a simulated drive on a simulated serial line; ``rs232:DEVICE[@BAUD]``,
            either with ``,epos2`` behind it for a gateway with the framing of later drives;
            ``INTERFACE:CHANNEL`` of python-can; for a robot with nothing on CAN ``serial:DEVICE`` or ``usb`` for its
            brick, or ``none`` for all bricks as the profile says.
        profile: the robot. Without any device a serial line is not opened: :func:`look_over_line` comes first.
        seed: of everything random in a simulated network.
        built: how the robot of a simulated network is really built; None: as its profile says.

    Raises:
        UsageError: a SPEC that means nothing.
    """
    if spec == "none" or is_brick_port(spec):
        return _brick_wire(spec, profile)
    wire = _bus_wire(spec, profile, seed, built or profile)
    if wire.network is not None:
        links = {name: twin.link.connect for name, twin in wire.network.bricks.items()}
        return replace(wire, bricks=links)
    return replace(wire, bricks={name: brick_port(brick.port) for name, brick in profile.bricks.items()})


def _brick_wire(spec: str, profile: Profile) -> Wire:
    """A robot of bricks only. Raises UsageError."""
    if profile.drives or profile.encoders:
        remedy = "give the CAN bus; the ports of its bricks stand in the profile"
        raise UsageError(f"{spec!r} is no bus, and robot {profile.name} has nodes on one", value=spec, remedy=remedy)
    ports = {name: brick.port for name, brick in profile.bricks.items()}
    if spec != "none" and len(ports) != 1:
        remedy = "give none; the port of each brick stands in the profile"
        raise UsageError(f"{spec!r} is the way to one brick, and there are {len(ports)}", value=spec, remedy=remedy)
    connects = {name: brick_port(port if spec == "none" else spec) for name, port in ports.items()}
    return Wire(NoBus(profile.network.bit_rate), profile, bricks=connects)


def _bus_wire(spec: str, profile: Profile, seed: int, built: Profile) -> Wire:
    if spec == "simulated":
        medium = SimulatedBus(bit_rate=profile.network.bit_rate, name="vcan0")
        network = SimulatedNetwork(built, medium, seed)
        on_can = profile.drives or profile.encoders
        bus: Bus = medium.port("master") if on_can else NoBus(profile.network.bit_rate)
        return Wire(bus, profile, network, medium)
    serial = _RS232.fullmatch(spec)
    if serial is None:
        return _can_wire(open_bus(spec, profile.network.bit_rate), profile)
    if not profile.drives and profile.bricks:
        remedy = "give serial:/dev/rfcomm0, usb, or simulated"
        raise UsageError(
            f"robot {profile.name} has no EPOS that {spec} could be the line of", value=spec, remedy=remedy
        )
    baud, make_exchange = _baud(spec, serial["baud"]), _framing(spec, serial["framing"])
    if serial["colon"] is None:
        return _simulated_serial(profile, baud, make_exchange, seed, built)
    if not serial["device"]:
        remedy = f"give rs232:/dev/ttyS0@{baud}, or rs232@{baud} for a simulated line"
        raise UsageError(f"{spec!r} names no serial device", value=spec, remedy=remedy)
    require_serial_device(serial["device"])
    if not profile.drives:
        return Wire(NoBus(profile.network.bit_rate), profile)
    return _serial_wire(serial["device"], partial(_open_device, serial["device"], baud), profile, baud, make_exchange)


def _baud(spec: str, text: str | None) -> int:
    """The baud rate that stands behind the ``@``. Raises UsageError."""
    if text is None:
        return DEFAULT_BAUD
    baud = int(text) if text.isascii() and text.isdecimal() else 0
    if baud not in BAUD_RATES:
        known = ", ".join(map(str, BAUD_RATES))
        raise UsageError(f"{text!r} in {spec!r} is no baud rate of a serial line", value=spec, remedy=f"give {known}")
    return baud


def _framing(spec: str, text: str | None) -> MakeExchange:
    """How requests and answers go over the line. Raises UsageError."""
    if text not in (None, LATER_FRAMING):
        remedy = f"leave it out for an EPOS 24/5, or give {LATER_FRAMING}"
        raise UsageError(f"{text!r} in {spec!r} is no framing of a serial line", value=spec, remedy=remedy)
    return Handshake if text is None else StuffedExchange


def _can_wire(bus: Bus, profile: Profile) -> Wire:
    """On the kernel's CAN the kernel sends SYNC, where it can, and SYNC paces the cycle."""
    if isinstance(bus, SocketCanBus) and kernel_repeats():
        return Wire(bus, profile, pace=partial(SyncPace, bus))
    return Wire(bus, profile)


def _simulated_serial(profile: Profile, baud: int, make_exchange: MakeExchange, seed: int, built: Profile) -> Wire:
    medium = SimulatedBus(bit_rate=profile.network.bit_rate, name="vcan0")
    network = SimulatedNetwork(built, medium, seed)
    gateway = network.drives[gateway_of(profile)]
    make_port = SimulatedSerial if make_exchange is Handshake else SimulatedLaterSerial
    cable = make_port(gateway, baud, seed=seed).cable
    return _serial_wire("rs232", partial(_open_cable, cable), profile, baud, make_exchange, network, medium, cable)


def _serial_wire(
    name: str,
    connect: Callable[[OnLost], Transport],
    profile: Profile,
    baud: int,
    make_exchange: MakeExchange,
    network: SimulatedNetwork | None = None,
    medium: SimulatedBus | None = None,
    cable: SerialCable | None = None,
) -> Wire:
    shrunk = serial_profile(profile, baud)
    encoders = {encoder.node: ENCODER_OBJECTS for encoder in profile.encoders.values()}
    gateway = profile.drives[gateway_of(profile)].node
    inputs = frozenset(drive.node for drive in profile.drives.values() if drive.emergency_stop)
    bus = SerialGatewayBus(
        name, connect, baud, make_exchange, profile.network.bit_rate, gateway, encoders, inputs, facts(profile, baud)
    )
    late = shrunk.network.late_after_cycles
    return Wire(
        bus,
        shrunk,
        network,
        medium,
        cable,
        partial(LinePace, bus, late / shrunk.network.cycle_hz),
        READING_SHARE * late,
    )


async def look_over_line(spec: str) -> FirstLook:
    """What the drive on a serial line says of itself. Raises BusOff, Timeout, Aborted or Refused."""
    serial = _RS232.fullmatch(spec)
    assert serial is not None
    device, baud, make_exchange = serial["device"], _baud(spec, serial["baud"]), _framing(spec, serial["framing"])
    port = SerialTty(device, baud)
    port.open()
    try:
        return await first_look_over(port, make_exchange(baud), baud, device)
    finally:
        port.close()


def _open_device(device: str, baud: int, on_lost: OnLost) -> Transport:
    port = SerialTty(device, baud)
    port.on_lost = on_lost
    port.open()
    return port


def _open_cable(cable: SerialCable, on_lost: OnLost) -> Transport:
    """On virtual time the cable itself; in real time a terminal at its end, as a person would plug it in."""
    if isinstance(asyncio.get_running_loop(), VirtualTimeLoop):
        return cable
    return _open_device(SerialPty(cable).device, cable.baud, on_lost)
