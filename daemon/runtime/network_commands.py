"""The methods that reach through to the bus: ``nmt``, ``sdo.read`` and ``sdo.write``."""

from __future__ import annotations

from typing import Any

from canhelm.errors import Aborted, NodeAbsent, UsageError
from daemon.runtime.handlers import Handler, Params
from daemon.runtime.interlocks import require_all_disabled, require_write_allowed
from daemon.runtime.supervisor import Supervisor
from drivers.canopen.codes import NmtCommand
from drivers.canopen.objects import ObjectDef, ObjectTable, parse_address
from drivers.encoder.objects import OBJECTS as ENCODER_OBJECTS
from drivers.epos.commissioning import ABSENT
from drivers.epos.objects import OBJECTS as EPOS_OBJECTS

NMT_COMMANDS = {
    "start": NmtCommand.START,
    "stop": NmtCommand.STOP,
    "preop": NmtCommand.ENTER_PRE_OPERATIONAL,
    "reset": NmtCommand.RESET_NODE,
    "reset-comm": NmtCommand.RESET_COMMUNICATION,
}


class NetworkCommands:
    """Handlers of ``nmt`` and ``sdo.*``, by name in :attr:`handlers`.

    Args:
        supervisor: what decides.
    """

    def __init__(self, supervisor: Supervisor) -> None:
        self._supervisor = supervisor
        self.handlers: dict[str, Handler] = {
            "nmt": self._nmt,
            "sdo.read": self._sdo_read,
            "sdo.write": self._sdo_write,
        }

    def _node(self, node: int | str) -> int:
        if isinstance(node, int) or str(node).isdigit():
            return int(node)
        for number, device in self._supervisor.devices.by_node.items():
            if device.name == node:
                return number
        raise NodeAbsent(f"no node {node} in this profile", remedy="`canhelm status` lists the nodes")

    async def _nmt(self, params: Params, lease: str | None) -> dict[str, Any]:
        require_all_disabled(self._supervisor)
        command = NMT_COMMANDS[str(params["command"])]
        node = 0 if params["node"] == "all" else self._node(params["node"])
        self._supervisor.master.nmt(command, node)
        return {"node": params["node"], "command": params["command"]}

    def _object(self, node: int, text: str) -> ObjectDef | tuple[int, int]:
        found = self._table(node).find(text)
        if found is not None:
            return found
        address = parse_address(text)
        if address is None:
            raise UsageError(
                f"no object {text!r}", object=text, remedy="a name (`canhelm object list`), 0x6041, or 0x2078/1"
            )
        return address

    def _table(self, node: int) -> ObjectTable:
        device = self._supervisor.devices.by_node.get(node)
        if device is not None and device.name in self._supervisor.devices.encoders:
            return ENCODER_OBJECTS
        return EPOS_OBJECTS

    async def _sdo_read(self, params: Params, lease: str | None) -> dict[str, Any]:
        node = self._node(params["node"])
        wanted = self._object(node, str(params["object"]))
        client = self._supervisor.master.sdo(node)
        if isinstance(wanted, ObjectDef):
            try:
                value = await client.read(wanted)
            except Aborted as error:
                raise self._absent(node, wanted, error) or error from None
            shown = value.hex() if isinstance(value, bytes) else value
            return {"node": node, "object": wanted.address, "name": wanted.name, "value": shown,
                    "type": wanted.type.name.lower(), "unit": wanted.unit}  # fmt: skip
        raw = await client.read_raw(wanted)
        return {"node": node, "object": f"0x{wanted[0]:04X}/{wanted[1]}", "raw": raw.hex(),
                "value": int.from_bytes(raw, "little")}  # fmt: skip

    async def _sdo_write(self, params: Params, lease: str | None) -> dict[str, Any]:
        node = self._node(params["node"])
        wanted = self._object(node, str(params["object"]))
        if not isinstance(wanted, ObjectDef):
            raise UsageError(
                f"{params['object']} is in no table, so its type is unknown",
                remedy="`canhelm object list` shows what can be written",
            )
        value = _as_number(wanted, params["value"])
        require_write_allowed(self._supervisor, node, wanted.index, value if isinstance(value, int) else 0)
        try:
            await self._supervisor.master.sdo(node).write(wanted, value)
        except Aborted as error:
            raise self._absent(node, wanted, error) or error from None
        return {"node": node, "object": wanted.address, "name": wanted.name, "value": value,
                "type": wanted.type.name.lower(), "unit": wanted.unit}  # fmt: skip

    def _absent(self, node: int, wanted: ObjectDef, error: Aborted) -> Aborted | None:
        """The refusal of an object that came with later firmware than the node's, in words; None for any other."""
        if wanted.firmware != "later" or error.value not in ABSENT:
            return None
        return Aborted(
            f"{self._supervisor.master.who(node)} does not have {wanted.address} ({wanted.name}): "
            "it came with later firmware",
            node=node,
            object=wanted.address,
            value=error.value,
            remedy="`canhelm sdo read NODE 0x2003/1` tells its firmware; leave this object alone",
        )


def _as_number(wanted: ObjectDef, value: int | str) -> int | str:
    """A number that a person typed, for objects that are numbers. Raises UsageError where it is none."""
    if not wanted.type.bits or isinstance(value, int):
        return value
    try:
        return int(value, 0)
    except ValueError:
        raise UsageError(
            f"{value!r} is no number", object=wanted.address, value=value, remedy=f"{wanted.name} takes a number"
        ) from None
