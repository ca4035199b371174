"""First contact with a bus that no profile describes: listen, scan, look at who is there, and run them as they are."""

from __future__ import annotations

import asyncio
from typing import Any

from canhelm.errors import Aborted, BusOff, CanhelmError, NodeAbsent, Refused, Timeout
from daemon.app import App
from daemon.life import Life
from daemon.runtime.node_report import VENDOR_MAXON, bit_rate_remark, node_entry
from daemon.runtime.tasks import TaskSet
from daemon.wires import look_over_line
from drivers.canopen.nmt import SYNC_COB_ID
from drivers.canopen.scan import FoundNode, NodeScan
from drivers.canopen.sdo import SdoClient
from drivers.encoder.encoder import PROFILE_406, PROFILE_MASK
from drivers.encoder.objects import OBJECTS as ENCODER
from drivers.epos.first_look import JOG_RAMP_RPM_S, JOG_RPM, FirstLook, first_look
from profiles.schema import SCHEMA_VERSION, DriveConfig, EncoderConfig, Limits, Network, Profile

NAME = "bench"
"""What a robot without a profile is called."""
SERIAL = "rs232:"
LISTEN_S = 1.0
PAUSE_S = 3.0
"""Time between two looks at a bus on which nobody can be driven."""
ANSWER_S = 0.1
_UNREADABLE = (Aborted, NodeAbsent, Timeout, Refused)
_SCALING = 4
"""Bit of the encoder's operating parameters (0x6000) that makes 0x6001 and 0x6002 count (CiA 406)."""


def bench_profile(
    network: Network, drives: dict[str, DriveConfig] | None = None, encoders: dict[str, EncoderConfig] | None = None
) -> Profile:
    """A robot without a vehicle: motors one by one, slowly."""
    return Profile(
        schema_version=SCHEMA_VERSION,
        name=NAME,
        network=network,
        drives=drives or {},
        encoders=encoders or {},
        limits=Limits(
            speed_m_s=JOG_RPM / 1e3, acceleration_m_s2=JOG_RAMP_RPM_S / 1e3, wheel_speed_m_s=(JOG_RPM + 1) / 1e3
        ),
    )


class Listener:
    """Counts what others send. Add :meth:`see` to a bus' taps."""

    def __init__(self) -> None:
        self.frames = 0
        self.syncs = 0

    def see(self, can_id: int, data: bytes, timestamp: float) -> None:
        """Take a frame."""
        self.frames += 1
        self.syncs += can_id == SYNC_COB_ID


class FirstContact:
    """Looks at a bus until there is somebody who can be driven or read; then the daemon begins anew with them.

    Args:
        life: runs a daemon with :func:`bench_profile`, without any node.

    Attributes:
        found: what is told of each node, for ``status``.
    """

    def __init__(self, life: Life) -> None:
        self.found: list[dict[str, Any]] = []
        self._life = life
        self._tasks = TaskSet(self._on_failure)
        self._drives: dict[str, DriveConfig] = {}
        self._encoders: dict[str, EncoderConfig] = {}

    def start(self) -> None:
        """Begin, on the running loop."""
        self._tasks.spawn(self._run(), "first contact")

    async def close(self) -> None:
        """Look no more."""
        await self._tasks.close()

    def _on_failure(self, name: str, error: BaseException) -> None:
        self._life.app.master.counters.internal_errors += 1
        self._life.app.supervisor.remark = f"the daemon's {name} failed: {error} - report it with the log"

    async def _run(self) -> None:
        """Look once; let the daemon begin anew with who was found, or look again later."""
        if not await self._finds_somebody(self._life.app):
            asyncio.get_running_loop().call_later(PAUSE_S, self.start)
            return
        profile = bench_profile(self._life.app.profile.network, self._drives, self._encoders)
        self._life.take_over(profile).service.found = self.found

    async def _finds_somebody(self, app: App) -> bool:
        self.found = app.service.found = []
        if app.spec.startswith(SERIAL):
            remark = await self._look_over_line(app)
        else:
            remark = await self._listen(app) or await self._scan(app)
        if remark != app.supervisor.remark:
            app.supervisor.remark = remark
            app.supervisor.log.add("warning" if remark else "info", NAME, remark or "nodes found")
        return bool(self._drives or self._encoders)

    async def _listen(self, app: App) -> str:
        """Send nothing for a while; why the bus is not to be disturbed, or nothing."""
        bus, ears = app.bus, Listener()
        errors = bus.counters.error_frames
        app.supervisor.remark = app.supervisor.remark or f"listening to {bus.name} before anything is sent"
        bus.taps.append(ears.see)
        await asyncio.sleep(LISTEN_S)
        bus.taps.remove(ears.see)
        errors = bus.counters.error_frames - errors
        if app.supervisor.bus_missing or bus.trouble:
            return app.supervisor.bus_missing or str(bus.trouble)
        if errors and not ears.frames:
            return (
                f"{errors} error frames and not one good frame on {bus.name} while nothing was sent: {bus.bit_rate} "
                "bit/s is not the bit rate of this network; begin again with --bit-rate"
            )
        if ears.syncs:
            return f"another master sends SYNC on {bus.name}: stop it first, or ask its daemon"
        return ""

    async def _look_over_line(self, app: App) -> str:
        """Look at the drive on a serial line; what is wrong where it cannot be used."""
        app.supervisor.remark = app.supervisor.remark or f"asking the drive on {app.spec} who it is"
        try:
            self._tell(app, self._take(await look_over_line(app.spec)))
        except (*_UNREADABLE, BusOff) as error:
            return _told(error)
        return ""

    async def _scan(self, app: App) -> str:
        """Ask all node ids and look at those that answer; what is wrong where none of them can be used."""
        nodes = await NodeScan(app.master, ANSWER_S).run()
        for node in nodes:
            self._tell(app, await self._look_at(app, node))
        if self._drives or self._encoders:
            return ""
        bit_rate = bit_rate_remark(app.bus, bool(nodes), [])
        told = [f"node {row['node']}: {row['remark']}" for row in self.found]
        nobody = f"nobody answers on {app.bus.name} at {app.bus.bit_rate} bit/s: check motor power, cable and bit rate"
        return "; ".join(told) or bit_rate or nobody

    async def _look_at(self, app: App, node: FoundNode) -> dict[str, Any]:
        row = node_entry(node, node.firmware)
        if node.sighting.two_nodes or not node.answers:
            return row
        client = app.master.sdo(node.node)
        try:
            if node.numbers.get("vendor_id") == VENDOR_MAXON:
                return self._take(await first_look(node.node, client.read_int))
            if node.numbers.get("device_type", 0) & PROFILE_MASK == PROFILE_406:
                name = f"node_{node.node}"
                self._encoders[name] = await _encoder_config(client)
                return row | {"name": name, "remark": ""}
        except _UNREADABLE as error:
            return row | {"remark": _told(error)}
        return row | {"remark": f"{row['device'] or 'a device'} that canhelm neither drives nor reads"}

    def _take(self, look: FirstLook) -> dict[str, Any]:
        """A drive that can be jogged. Raises Refused where it cannot."""
        name = f"node_{look.node}"
        self._drives[name] = look.config()
        return {"name": name, **look.row(), "remark": "; ".join(look.sentences[1:])}

    def _tell(self, app: App, row: dict[str, Any]) -> None:
        self.found.append(row)
        firmware = f", firmware {row['firmware']}" if row["firmware"] else ""
        parts = (f"{row['device']}{firmware}", row["state"], row["remark"])
        app.supervisor.log.add("info", f"node {row['node']}", "; ".join(part for part in parts if part))


def _told(error: CanhelmError) -> str:
    return f"{error.message} - {error.remedy}" if error.remedy else error.message


async def _encoder_config(client: SdoClient) -> EncoderConfig:
    """An encoder as it is scaled; its position 0 is heading 0. Raises NodeAbsent, Timeout or Aborted."""
    if await client.read_int(ENCODER["operating_parameters"]) & _SCALING:
        counts = await client.read_int(ENCODER["measuring_units_per_turn"])
        total = await client.read_int(ENCODER["total_measuring_range"])
        return EncoderConfig(node=client.node, counts_per_turn=counts, total_counts=total)
    counts = await client.read_int(ENCODER["single_turn_resolution"])
    turns = await client.read_int(ENCODER["number_of_turns"])
    return EncoderConfig(node=client.node, counts_per_turn=counts, total_counts=max(1, turns) * counts)
