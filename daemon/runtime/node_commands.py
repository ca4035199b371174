"""The methods about nodes as such: ``nodes.scan``, ``nodes.store``, ``nodes.restore``, and ``lss.*``."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from typing import Any

from canhelm.errors import Aborted, NodeAbsent, Refused, Timeout, UsageError
from daemon.runtime.epos_node_id import set_node_id
from daemon.runtime.handlers import Handler, Params, node_number
from daemon.runtime.interlocks import require_all_disabled
from daemon.runtime.node_report import FIRMWARE, VENDOR_MAXON, bit_rate_remark, missing_entry, node_entry
from daemon.runtime.supervisor import Supervisor
from drivers.canopen.codes import NmtCommand
from drivers.canopen.lss import Identity, LssMaster, parse_identity
from drivers.canopen.scan import IDENTITY, FoundNode, NodeScan
from drivers.contract import NodeState
from drivers.epos.commissioning import Commissioning
from drivers.epos.drive import EposDrive

STORE, RESTORE = (0x1010, 1), (0x1011, 1)
SIGNATURES = {STORE: b"save", RESTORE: b"load"}
MEMORY_TIMEOUT_S = 5.0
"""Time that a node gets to write its non-volatile memory (assumed)."""
QUICK_S = 0.1
"""Time that a node gets to show that it is there."""
SETTLE_S = 0.05
"""Time that a node gets to change its state or to start its communication anew, before it is asked."""
ATTEMPTS = 10


class NodeCommands:
    """Handlers of ``nodes.*`` and ``lss.*``, by name in :attr:`handlers`.

    Args:
        supervisor: what decides.
    """

    def __init__(self, supervisor: Supervisor) -> None:
        self._supervisor = supervisor
        self._lss_turn = asyncio.Lock()
        self.handlers: dict[str, Handler] = {
            "nodes.scan": self._scan,
            "nodes.store": self._store,
            "nodes.restore": self._restore,
            "lss.find": self._lss_find,
            "lss.set_node_id": self._lss_set_node_id,
            "lss.set_bit_rate": self._lss_set_bit_rate,
        }

    # --- scan ----------------------------------------------------------------------------------------------------

    async def _scan(self, params: Params, lease: str | None) -> dict[str, Any]:
        first, last = params["first"], params["last"]
        master = self._supervisor.master
        remarks = self._require_some(range(first, last + 1))
        found = await self._ask(range(first, last + 1))
        entries = [node_entry(each, await self._firmware(each)) for each in found]
        silent = set(self._supervisor.devices.by_node) - {each.node for each in found}
        missing = sorted(node for node in silent if first <= node <= last)
        entries += [missing_entry(node, master.names[node]) for node in missing]
        remark = bit_rate_remark(master.bus, bool(found), [master.who(node) for node in missing])
        remarks += [remark] if remark else []
        return {"nodes": sorted(entries, key=lambda entry: int(entry["node"])), "remarks": remarks}

    def _require_some(self, wanted: range) -> list[str]:
        """What is to be said before; raises UsageError where there is nobody to ask."""
        if not wanted:
            raise UsageError(
                f"node {wanted.start} lies behind node {wanted.stop - 1}", remedy="--first is the lower one of the two"
            )
        if self._supervisor.master.network.synchronous:
            return []
        nodes = sorted(self._supervisor.devices.by_node)
        told = f"over RS-232 only nodes of the profile are asked: {', '.join(map(str, nodes))}"
        if not set(wanted) & set(nodes):
            raise UsageError(told, remedy="choose from these, or connect a CAN adapter")
        return [told]

    async def _ask(self, nodes: range) -> list[FoundNode]:
        """Over a gateway each silent node id blocks the line for its time-out: ask those that are there."""
        master = self._supervisor.master
        if master.network.synchronous:
            return await NodeScan(master, QUICK_S).run(nodes)
        require_all_disabled(self._supervisor)
        there = {
            n for n, device in self._supervisor.devices.by_node.items() if device.node_state is not NodeState.ABSENT
        }
        return await NodeScan(master, master.network.sdo_timeout_s, at_once=1).run([n for n in nodes if n in there])

    async def _firmware(self, found: FoundNode) -> str:
        for address, applies, words in FIRMWARE:
            if found.answers and applies(found):
                try:
                    raw = await self._supervisor.master.sdo(found.node).read_raw(address)
                except (Aborted, NodeAbsent, Timeout):
                    continue
                return words(int.from_bytes(raw, "little"))
        return found.firmware

    # --- memory of nodes -----------------------------------------------------------------------------------------

    async def _store(self, params: Params, lease: str | None) -> dict[str, Any]:
        return await self._work_on_memory(params, STORE, "it keeps its parameters from now on")

    async def _restore(self, params: Params, lease: str | None) -> dict[str, Any]:
        node = node_number(self._supervisor, params["node"])
        note = f"its factory values count after a restart: `canhelm nmt reset {node}`"
        return await self._work_on_memory(params, RESTORE, note)

    async def _work_on_memory(self, params: Params, command: tuple[int, int], note: str) -> dict[str, Any]:
        node = node_number(self._supervisor, params["node"])
        require_all_disabled(self._supervisor)
        _require_confirmation(params, f"the memory of node {node} is written")
        async with self._out_of_operation(node):
            await self._supervisor.master.sdo(node).write_raw(command, SIGNATURES[command], MEMORY_TIMEOUT_S)
        return {"node": node, "object": f"0x{command[0]:04X}/{command[1]}", "note": note}

    @asynccontextmanager
    async def _out_of_operation(self, node: int) -> AsyncIterator[None]:
        """Hold a node of the profile in pre-operational; afterwards its boot-up configures it again."""
        device, master = self._supervisor.devices.by_node.get(node), self._supervisor.master
        if isinstance(device, EposDrive):
            async with Commissioning(device) as commissioning:
                await commissioning.take_out()
                yield
        elif device is not None:
            async with device.configuring:
                master.nmt(NmtCommand.ENTER_PRE_OPERATIONAL, node)
                try:
                    yield
                finally:
                    master.nmt(NmtCommand.START, node)
        else:
            yield

    # --- LSS -----------------------------------------------------------------------------------------------------

    def _require_lss(self) -> None:
        require_all_disabled(self._supervisor)
        if not self._supervisor.master.network.synchronous:
            raise Refused("LSS does not pass the RS-232 gateway of an EPOS", remedy="connect a CAN adapter for it")

    async def _lss_find(self, params: Params, lease: str | None) -> dict[str, Any]:
        self._require_lss()
        lss = self._supervisor.master.lss
        async with self._lss_turn:
            try:
                identity = await lss.find()
            finally:
                lss.switch_global(False)
        if identity is None:
            raise NodeAbsent(
                "no LSS device is without a node id",
                remedy="`canhelm nodes scan` shows those that have one; check power and bit rate of the device",
            )
        return {"identity": str(identity), **identity._asdict()}

    async def _lss_set_node_id(self, params: Params, lease: str | None) -> dict[str, Any]:
        self._require_lss()
        new = int(params["node_id"])
        _require_confirmation(params, f"{params['device']} becomes node {new} for good")
        if await self._is_there(new):
            raise Refused(
                f"node id {new} is taken", node=new, remedy="give one that `canhelm nodes scan` does not show"
            )

        async def change(lss: LssMaster) -> None:
            await lss.set_node_id(new)

        device, master = str(params["device"]), self._supervisor.master
        old = self._node_of(device)
        if old is not None and await self._is_epos(old):
            async with self._stopped(old):
                await set_node_id(master, old, new)
        else:
            await self._set_up(device, change)
            if old is not None:
                master.send_nmt(NmtCommand.RESET_COMMUNICATION, old)
        for _ in range(ATTEMPTS):
            await asyncio.sleep(SETTLE_S)
            if await self._is_there(new):
                return {"device": device, "node": new, "note": f"node {new} answers{self._unknown(new, old)}"}
        raise NodeAbsent(
            f"the device has stored node id {new}, but does not answer", node=new, remedy="switch it off and on"
        )

    def _unknown(self, new: int, old: int | None) -> str:
        """What is to be changed where the profile has no such node; empty where it has."""
        devices = self._supervisor.devices.by_node
        if new in devices:
            return ""
        whose = devices[old].name if old in devices else "a drive or an encoder"
        return f"; the profile has no node {new}: write `node: {new}` there for {whose}, and start the daemon anew"

    async def _lss_set_bit_rate(self, params: Params, lease: str | None) -> dict[str, Any]:
        self._require_lss()
        bit_rate = int(params["bit_rate"])
        _require_confirmation(params, f"{params['device']} gets {bit_rate} bit/s for good")

        async def change(lss: LssMaster) -> None:
            await lss.set_bit_rate(bit_rate)

        await self._set_up(str(params["device"]), change)
        note = f"stored; it counts when the device was switched off and on, on a network of {bit_rate} bit/s"
        return {"device": params["device"], "bit_rate": bit_rate, "note": note}

    def _node_of(self, device: str) -> int | None:
        """Its node id; None where it is named by its identity."""
        if parse_identity(device) is not None:
            return None
        return node_number(self._supervisor, device)

    async def _is_epos(self, node: int) -> bool:
        try:
            vendor = await self._supervisor.master.sdo(node).read_raw(IDENTITY["vendor_id"])
        except Aborted:
            return False
        return int.from_bytes(vendor, "little") == VENDOR_MAXON

    async def _set_up(self, device: str, change: Callable[[LssMaster], Awaitable[None]]) -> None:
        """Change and store something in one device with LSS."""
        identity, node = parse_identity(device), self._node_of(device)
        if identity is None:
            assert node is not None
            identity = await self._identity_of(node)
        async with self._lss_turn, self._stopped(node):
            lss = self._supervisor.master.lss
            try:
                await lss.select(identity)
                await change(lss)
                await lss.store()
            finally:
                lss.switch_global(False)

    @asynccontextmanager
    async def _stopped(self, node: int | None) -> AsyncIterator[None]:
        """A node that serves process data does not serve LSS."""
        if node is None:
            yield
            return
        self._supervisor.master.send_nmt(NmtCommand.ENTER_PRE_OPERATIONAL, node)
        async with self._out_of_operation(node):
            await asyncio.sleep(SETTLE_S)
            yield

    async def _identity_of(self, node: int) -> Identity:
        client = self._supervisor.master.sdo(node)
        parts = ("vendor_id", "product_code", "revision_number", "serial_number")
        try:
            return Identity(*[int.from_bytes(await client.read_raw(IDENTITY[part]), "little") for part in parts])
        except Aborted as error:
            raise Refused(
                f"node {node} does not tell its whole identity, so LSS cannot single it out",
                node=node,
                object=error.object,
                remedy="an EPOS has no LSS; give another device's identity by hand",
            ) from None

    async def _is_there(self, node: int) -> bool:
        try:
            await self._supervisor.master.sdo(node).read_raw(IDENTITY["device_type"], QUICK_S)
        except (NodeAbsent, Timeout):
            return False
        except Aborted:
            return True
        return True


def _require_confirmation(params: Params, what: str) -> None:
    if not params["confirm"]:
        raise Refused(f"not confirmed: {what}", remedy="say `confirm: true` (on the command line: --yes)")
