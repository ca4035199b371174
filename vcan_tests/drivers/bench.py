"""A bench for driver tests: the simulated network of the MAX2D, a master with its devices, and a bare control cycle."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from daemon.runtime.clock import Ticker
from drivers.canopen.master import Master, NodeEvent
from drivers.devices import Devices
from drivers.encoder.encoder import Cia406Encoder
from drivers.epos.brake import EposBrake
from drivers.epos.drive import EposDrive
from drivers.simulated.bus import SimulatedBus
from drivers.simulated.network import SimulatedNetwork
from profiles.loader import load
from profiles.schema import Profile

PERIOD_S = 0.01


class Bench:
    """Everything of one test; the cycle sends SYNC, the drives' targets and guard requests."""

    def __init__(self, profile: Profile) -> None:
        self.profile = profile
        self.medium = SimulatedBus(profile.network.bit_rate, "vcan0")
        self.network = SimulatedNetwork(profile, self.medium, 0)
        self.port = self.medium.port("master")
        self.intruder = self.medium.port("intruder")
        self.master = Master(self.port, profile.network)
        self.events: list[NodeEvent] = []
        self.master.on_event = self.events.append
        self.devices = Devices(self.master, profile)
        self.cycle = Ticker(PERIOD_S, self._tick)

    def _tick(self) -> None:
        now = asyncio.get_running_loop().time()
        self.master.sync()
        for drive in self.devices.drives.values():
            drive.transmit(now + PERIOD_S)
        self.master.guard_due(now)

    def drive(self, name: str = "front_left") -> EposDrive:
        drive = self.devices.drives[name]
        assert isinstance(drive, EposDrive)
        return drive

    def encoder(self, name: str = "front") -> Cia406Encoder:
        encoder = self.devices.encoders[name]
        assert isinstance(encoder, Cia406Encoder)
        return encoder

    def brake(self, name: str = "front") -> EposBrake:
        brake = self.devices.brakes[name]
        assert isinstance(brake, EposBrake)
        return brake

    def kinds(self, node: int) -> list[str]:
        """Kinds of the events of a node, in their order."""
        return [event.kind for event in self.events if event.node == node]


def max2d() -> Profile:
    """The shipped profile."""
    return load("max2d").profile


@asynccontextmanager
async def bench(profile: Profile | None = None, *, powered: bool = True) -> AsyncIterator[Bench]:
    """A bench whose nodes are ready when it is powered."""
    made = Bench(profile or max2d())
    await made.master.start()
    made.devices.start()
    made.cycle.start()
    if powered:
        made.network.power_on()
        await asyncio.sleep(0.5)
    yield made
    made.cycle.stop()
    await made.devices.close()
    await made.master.close()
    await made.network.close()


async def driving(b: Bench, speed_m_s: float = 0.4) -> None:
    """All wheels at a speed."""
    await asyncio.gather(*(drive.enable() for drive in b.devices.drives.values()))
    for drive in b.devices.drives.values():
        drive.command_speed(speed_m_s)
    await asyncio.sleep(1.0)
