"""Reads, writes and keeps the settings of an EPOS 24/5 that is taken out of operation for it."""

from __future__ import annotations

import asyncio
from collections.abc import Mapping

from canhelm.errors import Aborted, DeviceFault, Interlock, NodeAbsent, Timeout
from drivers.canopen.codes import NmtCommand
from drivers.canopen.configuration import Configuration
from drivers.canopen.objects import ObjectDef
from drivers.canopen.pdo import Settings
from drivers.contract import NodeState
from drivers.epos.drive import EposDrive
from drivers.epos.objects import OBJECTS
from drivers.epos.parameters import SETTINGS
from drivers.epos.state_machine import state_of

ABSENT = (0x0602_0000, 0x0609_0011)
"""Abort codes that say that a drive does not have an object."""
SAVE = b"save"
SAVE_TIMEOUT_S = 5.0
"""Time that a drive gets to keep its parameters (assumed)."""
RESTART_PAUSE_S, RESTART_ATTEMPTS = 1.0, 10
"""How often a drive is asked whether it has restarted, and how many times (assumed)."""
MARK_QC = 0x5EED
"""Left in the target position, which counts at a new set-point only and is forgotten at a restart."""
_IDENTITY = ("vendor_id", "product_code", "software_version", "hardware_version")


class Commissioning:
    """One drive, alone: its boot-up waits until this is over.

    Use as ``async with Commissioning(drive) as commissioning``. Reading disturbs nobody; :meth:`take_out` comes before
    anything is changed. At the end a drive that was taken out is booted and configured from the profile again.

    Args:
        drive: the drive.

    Raises:
        NodeAbsent, Timeout, Aborted, DeviceFault: from every method, as SDO transfers do.
    """

    def __init__(self, drive: EposDrive) -> None:
        self._drive = drive
        self._sdo = drive.sdo
        self._pacing = drive.master.pacing
        self._taken_out = False

    async def __aenter__(self) -> Commissioning:
        await self._drive.configuring.acquire()
        return self

    async def __aexit__(self, *_: object) -> None:
        self._drive.configuring.release()
        if self._taken_out:
            self._drive.master.nmt(NmtCommand.START, self._drive.node)

    async def identity(self) -> dict[str, int]:
        """Vendor, product code and versions of the drive."""
        return {name: await self._sdo.read_int(OBJECTS[name]) for name in _IDENTITY}

    async def read(self) -> dict[ObjectDef, int]:
        """Every setting that the drive has; those of later firmware are probed."""
        found: dict[ObjectDef, int] = {}
        for entry in SETTINGS:
            try:
                found[entry] = await self._sdo.read_int(entry)
            except Aborted as error:
                if entry.firmware == "2011h" or error.value not in ABSENT:
                    raise
            await self._pacing.give_way()
        return found

    async def take_out(self) -> dict[ObjectDef, int]:
        """To pre-operational, life guarding off and the brakes' outputs idle, as without power.

        Returns:
            The settings that this has changed.

        Raises:
            Interlock: its power stage is on.
        """
        state = state_of(await self._sdo.read_int(OBJECTS["statusword"]))
        if state is not None and state.power_stage_on:
            raise Interlock(
                f"{self._drive.who} has its power stage on: settings are changed at rest and disabled",
                node=self._drive.node,
                remedy=f"`canhelm motor disable {self._drive.name}`",
            )
        self._taken_out = True
        self._drive.master.nmt(NmtCommand.ENTER_PRE_OPERATIONAL, self._drive.node)
        mask = OBJECTS["digital_output_functions_mask"]
        driven = await self._sdo.read_int(mask)
        idle = {OBJECTS["life_time_factor"]: 0, mask: driven & ~self._drive.outputs.own_bits}
        await self.write(list(idle.items()))
        return idle

    async def write(self, settings: Settings) -> None:
        """Write settings in their order and read them back. Raises Refused where one did not take."""
        configuration = Configuration(self._sdo, self._drive.who, self._pacing)
        await configuration.write(settings)
        await configuration.verify()

    async def save(self) -> None:
        """Let the drive keep its parameters; returns when it has confirmed."""
        await self._sdo.write_raw(OBJECTS["save_all_parameters"], SAVE, SAVE_TIMEOUT_S)

    async def restart(self) -> None:
        """Restart the drive; returns when it has. Raises Timeout where it does not come back.

        Its boot-up message does not pass a serial gateway, so a volatile object tells: it forgets a mark that was left
        in it. The drive is asked seldom, because each request to a silent node blocks such a gateway.
        """
        target = OBJECTS["target_position"]
        await self._sdo.write(target, MARK_QC)
        self._drive.master.nmt(NmtCommand.RESET_NODE, self._drive.node)
        for _ in range(RESTART_ATTEMPTS):
            await asyncio.sleep(RESTART_PAUSE_S)
            try:
                if await self._sdo.read_int(target) != MARK_QC:
                    return
            except (NodeAbsent, Timeout):
                continue
        raise Timeout(
            f"{self._drive.who} did not come back within {RESTART_ATTEMPTS * RESTART_PAUSE_S:g} s of its restart",
            node=self._drive.node,
            remedy="switch it off and on; `canhelm status` shows when it is back",
        )

    async def require_kept(self, wanted: Mapping[ObjectDef, int]) -> None:
        """Raise DeviceFault unless the settings have outlived the restart."""
        lost = await Configuration(self._sdo, self._drive.who, self._pacing).differences(wanted.items())
        if lost:
            raise DeviceFault(
                f"{self._drive.who} did not keep its settings: {'; '.join(map(str, lost))}",
                node=self._drive.node,
                object=lost[0].entry.address,
                remedy="try again; replace the drive if it happens again",
            )


async def until_ready(drive: EposDrive, timeout_s: float) -> None:
    """Return when the drive is ready again, was refused, or the time is over."""
    loop = asyncio.get_running_loop()
    settled: asyncio.Future[None] = loop.create_future()

    def on_change(ready: bool) -> None:
        if ready and not settled.done():
            settled.set_result(None)

    drive.on_ready_change.append(on_change)
    try:
        if drive.node_state is not NodeState.READY:
            await asyncio.wait([settled], timeout=timeout_s)
    finally:
        drive.on_ready_change.remove(on_change)
