"""``canhelm simulate``: the simulated network as a process of its own, on a wire that other programs can reach."""

from __future__ import annotations

import asyncio
import re
import signal
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from canhelm.errors import UsageError
from daemon.cli.options import node_of
from daemon.cli.output import Json, say, show

if TYPE_CHECKING:
    from drivers.simulated.network import SimulatedNetwork
    from drivers.simulated.serial_wire import SerialNoise
    from profiles.faults import PlacedFault
    from profiles.schema import Profile

DEFAULT_BAUD = 115200
_RS232 = re.compile(r"rs232:pty(?:@(\d+))?")
_CLEAN = (0.0, 0.0, 0.0, 0.0)


def simulate(
    *,
    profile: str,
    bus: str,
    nodes: str | None = None,
    gateway: str | None = None,
    seed: int = 0,
    lose: float = 0.0,
    flip: float = 0.0,
    duplicate: float = 0.0,
    delay: float = 0.0,
    faults: Path | None = None,
    json: Json = None,
) -> int:
    """Run a robot's simulated network, or some of its nodes beside real ones, until Ctrl-C or SIGTERM.

    Example: `canhelm simulate --profile max2d --bus rs232:pty`

    Args:
        profile: Name of a profile, or a YAML file.
        bus: `rs232:pty` or `rs232:pty@38400`: the serial line of one drive, on a pseudo terminal whose name is printed;
            `serial:pty`: the robot's NXT brick on one; or a CAN interface such as `socketcan:vcan0`.
        nodes: Node ids or names, separated by commas; the others have no power. All without it.
        gateway: The drive with the serial line; the first of the profile without it.
        seed: Seed of everything random.
        lose: Share of the bytes on the serial line that noise loses, 0 to 1.
        flip: Share of which noise changes a bit.
        duplicate: Share that noise doubles.
        delay: Share that noise delays.
        faults: YAML file of faults that strike the network (docs/faults.md).
    """
    from daemon.runtime.clock import run_precise
    from drivers.simulated.serial_wire import SerialNoise
    from profiles.faults import load_faults
    from profiles.loader import load

    shares = (lose, flip, duplicate, delay)
    if not all(0.0 <= share <= 1.0 for share in shares):
        raise UsageError("a share of bytes is 0 to 1", value=shares, limit="0 to 1", remedy="give 0.01 for one in 100")
    robot = load(profile).profile
    serial, wrong = _RS232.fullmatch(bus), load_faults(faults, robot) if faults else ()
    if serial:
        baud = int(serial[1] or DEFAULT_BAUD)
        run_precise(_on_terminal(robot, nodes, gateway, baud, SerialNoise(*shares), seed, wrong, json))
    elif bus == "serial:pty" and faults:
        raise UsageError("--faults is for a network, not for a brick alone", remedy="`canhelm run --simulate --faults`")
    elif bus == "serial:pty":
        run_precise(_brick_on_terminal(robot, seed, json))
    elif bus == "simulated" or bus.startswith("rs232") or ":" not in bus:
        remedy = "give rs232:pty, serial:pty, or a CAN interface such as socketcan:vcan0"
        raise UsageError(f"nobody could reach a network on {bus!r}", value=bus, remedy=remedy)
    elif gateway is not None or shares != _CLEAN:
        raise UsageError("a gateway and noise are for the serial line", remedy="give --bus rs232:pty")
    else:
        run_precise(_on_interface(robot, nodes, bus, seed, wrong))
    return 0


async def _on_terminal(
    profile: Profile,
    nodes: str | None,
    gateway: str | None,
    baud: int,
    noise: SerialNoise,
    seed: int,
    wrong: Sequence[PlacedFault],
    json: bool | None,
) -> None:
    from drivers.simulated.bus import SimulatedBus
    from drivers.simulated.device_faults import Site
    from drivers.simulated.faults import Faults
    from drivers.simulated.network import SimulatedNetwork
    from drivers.simulated.serial import SimulatedSerial
    from drivers.simulated.serial_wire import SerialPty

    ended = _ending()
    medium = SimulatedBus(profile.network.bit_rate)
    network = SimulatedNetwork(profile, medium, seed)
    name = _gateway(network, gateway)
    try:
        port = SimulatedSerial(network.drives[name], baud, noise=noise, seed=seed)
    except ValueError as error:
        raise UsageError(str(error), value=baud, remedy="give 9600, 14400, 19200, 38400, 57600 or 115200") from None
    faults = Faults(Site(network, medium, cable=port.cable), seed)
    faults.load(wrong)
    _power_on(network, nodes)
    if not network.drives[name].powered:
        raise UsageError(f"the gateway {name} has no power", value=nodes, remedy="add it to --nodes")
    pty = SerialPty(port.cable)
    spec = f"rs232:{pty.device}@{baud}"
    show({"device": pty.device, "baud": baud, "gateway": name, "node": network.drives[name].node_id}, json=json)
    say(f"the network runs; drive it with `canhelm run --profile {profile.name} --bus {spec}`, end it with Ctrl-C")
    await ended.wait()
    faults.close()
    pty.close()
    await network.close()


async def _brick_on_terminal(profile: Profile, seed: int, json: bool | None) -> None:
    """The robot's only brick, as over Bluetooth."""
    from drivers.simulated.nxt_link import simulated_brick
    from drivers.simulated.serial_wire import SerialPty

    if len(profile.bricks) != 1:
        remedy = "give a profile with one, such as nxt"
        raise UsageError(
            f"robot {profile.name} has {len(profile.bricks)} NXT bricks", value=profile.name, remedy=remedy
        )
    ended, name = _ending(), next(iter(profile.bricks))
    twin = simulated_brick(profile, name, seed)
    pty = SerialPty(twin.brick.cable)
    show({"device": pty.device, "brick": name}, json=json)
    command = f"canhelm run --profile {profile.name} --bus serial:{pty.device}"
    say(f"the brick runs; drive it with `{command}`, end it with Ctrl-C")
    await ended.wait()
    pty.close()
    await twin.close()


async def _on_interface(
    profile: Profile, nodes: str | None, spec: str, seed: int, wrong: Sequence[PlacedFault] = ()
) -> None:
    """Put the nodes onto a CAN interface; the time on the wire is the interface's."""
    from drivers.bus.interfaces import open_bus
    from drivers.simulated.bus import SimulatedBus
    from drivers.simulated.device_faults import Site
    from drivers.simulated.faults import Faults
    from drivers.simulated.network import SimulatedNetwork

    ended = _ending()
    medium = SimulatedBus(profile.network.bit_rate, instant=True)
    network = SimulatedNetwork(profile, medium, seed)
    near, far = medium.port("interface"), open_bus(spec, profile.network.bit_rate)
    faults = Faults(Site(network, medium, near), seed)
    near.receiver = lambda can_id, data, _: far.send(can_id, data)
    far.receiver = lambda can_id, data, _: near.send(can_id, data)
    await far.open()
    try:
        faults.load(wrong)
        _power_on(network, nodes)
        say(f"the network runs on {spec}; end it with Ctrl-C")
        await ended.wait()
    finally:
        faults.close()
        await network.close()
        await far.close()


def _gateway(network: SimulatedNetwork, wanted: str | None) -> str:
    """Name of the drive with the serial line."""
    for name, drive in network.drives.items():
        if wanted in (None, name, str(drive.node_id)):
            return name
    drives = ", ".join(network.drives)
    raise UsageError(f"no drive {wanted!r} that could be the gateway", value=wanted, remedy=f"give one of {drives}")


def _power_on(network: SimulatedNetwork, nodes: str | None) -> None:
    wanted = [node_of(node.strip()) for node in nodes.split(",")] if nodes else ["all"]
    for node in wanted:
        try:
            network.power_on(node)
        except KeyError:
            remedy = "`canhelm profile show` lists the nodes"
            raise UsageError(f"the profile has no node {node}", value=node, remedy=remedy) from None


def _ending() -> asyncio.Event:
    """Set at the first SIGTERM or SIGINT from now on."""
    ended = asyncio.Event()
    for number in (signal.SIGTERM, signal.SIGINT):
        asyncio.get_running_loop().add_signal_handler(number, ended.set)
    return ended
