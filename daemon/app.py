"""The daemon put together: the one place that knows every room."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from socket import socket as Socket
from typing import TYPE_CHECKING

from canhelm.errors import BusOff
from daemon.runs.store import RunStore
from daemon.runtime.commands import Commands
from daemon.runtime.cycle import Cycle
from daemon.runtime.gathering import Gathering
from daemon.runtime.localising import Localiser
from daemon.runtime.log_forms import CANDUMP, LogForm
from daemon.runtime.recorder import LIMIT_BYTES, BusRecorder
from daemon.runtime.run_recorder import RunRecorder
from daemon.runtime.service import Service
from daemon.runtime.supervisor import Supervisor
from daemon.runtime.vehicles import make_vehicle
from daemon.wires import make_wire
from drivers.canopen.master import Master
from drivers.contract import Drive
from drivers.devices import Devices
from drivers.simulated.bus import SimulatedPort
from drivers.simulated.computer_trouble import ComputerTrouble
from drivers.simulated.device_faults import Site
from drivers.simulated.faults import Faults
from drivers.simulated.workshop import Workshop
from profiles.faults import PlacedFault
from profiles.schema import Profile

if TYPE_CHECKING:
    from daemon.api.door import Door
    from daemon.api.gateway309 import Gateway309
    from daemon.api.peers import Rights
    from daemon.api.server import Server

LOGGER = logging.getLogger("canhelm")
BUS_RETRY_S = 1.0
"""Time between two attempts to open a bus that is not there yet."""


@dataclass(frozen=True, slots=True)
class GatewayAccess:
    """How other CANopen tools reach the bus through the daemon (CiA 309-3).

    Attributes:
        path: of the gateway's Unix socket.
        tcp_port: port on the loopback interface, read-only; None for none.
        writable: the Unix socket may write, too.
    """

    path: Path
    tcp_port: int | None = None
    writable: bool = False


@dataclass(frozen=True, slots=True)
class TcpAccess:
    """How clients reach the API over TCP.

    Attributes:
        host: address to listen on.
        port: to listen on.
        tokens: file of the tokens that open it.
    """

    host: str
    port: int
    tokens: Path


class App:
    """One robot's daemon: bus, master, devices, supervisor, cycle, recorder and server.

    Args:
        profile: the robot.
        bus: the SPEC of :func:`daemon.wires.make_wire`.
        socket: path of the API's socket; None for a daemon without one (demo, tests).
        record: folder or file for a log of the bus; None for none.
        record_bytes: what the logs of that folder may take.
        record_form: how they are written.
        seed: of everything random in the simulated network.
        powered: whether the simulated nodes have power from the start.
        gateway: where other CANopen tools are served; None for nowhere.
        built: how the simulated robot is really built and wired; None: as its profile says.
        profile_file: where the profile stands, for commands that change it; None for nowhere.
        runs: where each motion leaves a run; None for nowhere.
        inherited: sockets that listen already, by their paths; the service manager has opened them and takes them away.
        faults: that strike the simulated network; counted from its start.
        tcp: where the API is served over TCP, too; None for nowhere.
        groups: names of those whose members may watch, drive and configure; None: the usual ones.
    """

    def __init__(
        self,
        profile: Profile,
        bus: str = "simulated",
        *,
        socket: Path | None = None,
        record: Path | None = None,
        record_bytes: int = LIMIT_BYTES,
        record_form: LogForm = CANDUMP,
        seed: int = 0,
        powered: bool = True,
        gateway: GatewayAccess | None = None,
        inherited: Mapping[Path, Socket] | None = None,
        built: Profile | None = None,
        profile_file: Path | None = None,
        runs: RunStore | None = None,
        faults: Sequence[PlacedFault] = (),
        groups: tuple[str, str, str] | None = None,
        tcp: TcpAccess | None = None,
    ) -> None:
        self.spec = bus
        self.wire = wire = make_wire(bus, profile, seed, built)
        self.profile = profile = wire.profile
        self.network = wire.network
        self.medium = wire.medium
        self.bus = wire.bus
        self._powered = powered
        self._inherited = inherited or {}
        self._connecting: asyncio.Task[None] | None = None
        self._record, self._record_bytes, self._record_form = record, record_bytes, record_form
        self.recorder: BusRecorder | None = None
        self.master = Master(self.bus, profile.network)
        self.devices = Devices(self.master, profile, wire.bricks)
        self.vehicle = make_vehicle(profile, self.devices)
        period_s = 1.0 / profile.network.cycle_hz
        late = profile.network.late_after_cycles
        self.supervisor = Supervisor(self.master, self.devices, self.vehicle, period_s)
        self.cycle = Cycle(
            self.master, self.devices, period_s, self.supervisor.step, wire.pace, wire.reading_share, late
        )
        workshop = Workshop(built or profile, self.network) if self.network else None
        self._trouble = ComputerTrouble()
        self.faults = self._make_faults(seed, socket)
        self._faults_to_set = faults
        commands = Commands(self.supervisor, self.network, workshop, self.faults, self._trouble)
        self.service = Service(profile.name, self.supervisor, commands, self.bus, self.cycle, profile_file)
        self._gathering = Gathering(self.bus)
        if runs:
            self.service.runs = RunRecorder(runs, self.supervisor, self._gathering, profile, bus, self._trouble)
        self._localise(commands)
        self._groups = groups
        self.server = self._serve(socket) if socket else None
        self.door = self._serve_network(self.server, tcp) if self.server and tcp else None
        self.gateway = self._serve_tools(gateway) if gateway else None

    def _make_faults(self, seed: int, socket: Path | None) -> Faults | None:
        """What may go wrong in the simulated network, and around it."""
        if self.network is None or self.medium is None:
            return None
        port = self.bus if isinstance(self.bus, SimulatedPort) else None
        site = Site(self.network, self.medium, port, self.wire.cable, self._trouble, socket)
        return Faults(site, seed)

    def _localise(self, commands: Commands) -> None:
        """Correct the vehicle's odometry by bearings, where its profile has reflectors."""
        if self.profile.localisation is None:
            return
        localiser = Localiser(self.profile.localisation, self.vehicle, self.supervisor.log)
        self.supervisor.observers.append(localiser.step)
        commands.handlers |= localiser.handlers
        if commands.paths is not None:
            commands.paths.located = localiser.located
        self.service.localiser = localiser
        if self.network is not None and self.network.scanner is not None:
            self.network.scanner.on_scan = localiser.take

    def _rights(self) -> Rights:
        from daemon.api.peers import Groups, Rights

        groups = Groups(*self._groups or ())
        groups.require()
        return Rights(groups)

    def _serve(self, socket: Path) -> Server:
        from daemon.api.server import Server

        return Server(self.service, socket, self._inherited.get(socket), self._rights())

    def _serve_network(self, server: Server, access: TcpAccess) -> Door:
        from daemon.api.door import Door
        from daemon.api.tokens import load_tokens

        return Door(server, access.host, access.port, load_tokens(access.tokens))

    def _serve_tools(self, access: GatewayAccess) -> Gateway309:
        from daemon.api.gateway309 import Gateway309

        return Gateway309(
            self.supervisor,
            access.path,
            tcp_port=access.tcp_port,
            writable=access.writable,
            inherited=self._inherited.get(access.path),
            rights=self._rights(),
        )

    async def start(self) -> None:
        """Open the sockets first, then the bus; everything else comes up by itself.

        A bus that is missing or down is waited for; the control cycle ticks meanwhile. Without any device it does not
        tick, and nothing is sent.

        Raises:
            Refused, ConfigError, PermissionRefused: a socket or the log cannot be opened.
            UsageError: a fault cannot happen in this network.
        """
        if self.server is not None:
            await self.server.start()
        if self.faults is not None:  # some are clients of the socket
            self.faults.load(self._faults_to_set)
        if self.door is not None:
            await self.door.start()
        if self.gateway is not None:
            await self.gateway.start()
        if self._record is not None:
            self.recorder = BusRecorder(
                self._gathering,
                self._record,
                self.profile.name,
                self.supervisor.log,
                self._record_bytes,
                self._record_form,
                self._trouble,
            )
            self.recorder.start()
            self.service.recorder = self.recorder
        if self.service.runs is not None:
            self.service.runs.start()
        if self.network is not None and self._powered:
            self.network.power_on("all")
        if self.network is not None and self.network.scanner is not None:
            self.network.scanner.start()
        if await self._opens_bus():
            self.devices.start()
        else:
            self._connecting = asyncio.create_task(self._wait_for_bus(), name="waiting for the bus")
        if self.devices.all:
            self.cycle.start()

    async def _opens_bus(self) -> bool:
        try:
            await self.master.start()
        except BusOff as error:
            if self.supervisor.bus_missing != str(error):
                LOGGER.error("%s", error)
            self.supervisor.bus_missing = str(error)
            return False
        self.supervisor.bus_missing = ""
        return True

    async def _wait_for_bus(self) -> None:
        while True:
            await asyncio.sleep(BUS_RETRY_S)
            if await self._opens_bus():
                break
        LOGGER.info("%s is there", self.spec)
        self.devices.start()

    async def close(self) -> tuple[Drive, ...]:
        """Bring the vehicle to rest, then take everything down; the drives that are not known to be at rest and off."""
        if self.gateway is not None:
            await self.gateway.close()
        doubtful = await self.supervisor.close()
        if self._connecting is not None:
            self._connecting.cancel()
            await asyncio.wait([self._connecting])
        self.cycle.stop()
        await self.devices.close()
        await self.master.close()
        if self.faults is not None:
            self.faults.close()
        if self.network is not None:
            await self.network.close()
        if self.door is not None:
            self.door.close()
        if self.server is not None:
            await self.server.close()
        if self.service.runs is not None:
            self.service.runs.close()
        if self.recorder is not None:
            self.recorder.close()
        return doubtful
