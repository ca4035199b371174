"""The methods that reach through to the bus: ``nmt``, ``sdo.read`` and ``sdo.write``."""

from __future__ import annotations

from typing import Any

from canhelm.errors import Aborted, UsageError
from daemon.runtime.handlers import Handler, Params, node_number
from daemon.runtime.interlocks import require_all_disabled, require_reach_allowed, require_write_allowed
from daemon.runtime.supervisor import Supervisor
from drivers.canopen.codes import NmtCommand
from drivers.canopen.objects import ObjectDef, ObjectTable, parse_address
from drivers.encoder.objects import OBJECTS as ENCODER_OBJECTS
from drivers.epos.commissioning import ABSENT
from drivers.epos.objects import OBJECTS as EPOS_OBJECTS
from drivers.epos.state_machine import state_of
from drivers.epos.value_tables import VALUE_TABLES

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

    async def _nmt(self, params: Params, lease: str | None) -> dict[str, Any]:
        require_all_disabled(self._supervisor)
        command = NMT_COMMANDS[str(params["command"])]
        node = 0 if params["node"] == "all" else node_number(self._supervisor, params["node"])
        self._supervisor.master.nmt(command, node)
        known = not node or node in self._supervisor.devices.by_node
        note = {} if known else {"note": f"node {node} is not in the profile, and no node confirms such a command"}
        return {"node": params["node"], "command": params["command"], **note}

    def _object(self, node: int, text: str) -> ObjectDef | tuple[int, int]:
        table = table_of(self._supervisor, node)
        found = table.find(text)
        if found is not None:
            return found
        address = parse_address(text)
        if address is None:
            near = table.name_like(text)
            forms = "a name (`canhelm object list`), 0x6041, or 0x2078/1"
            raise UsageError(
                f"no object {text!r}", object=text, remedy=f"did you mean {near}?" if near else f"give {forms}"
            )
        return address

    async def _sdo_read(self, params: Params, lease: str | None) -> dict[str, Any]:
        node = node_number(self._supervisor, params["node"])
        wanted = self._object(node, str(params["object"]))
        require_reach_allowed(self._supervisor, node)
        client = self._supervisor.master.sdo(node)
        if isinstance(wanted, ObjectDef):
            try:
                value = await client.read(wanted)
            except Aborted as error:
                raise self._absent(node, wanted, error) or error from None
            shown = value.hex() if isinstance(value, bytes) else value
            return {"node": node, "object": wanted.address, "name": wanted.name, "value": shown,
                    **_readings(wanted, value), "type": wanted.type.name.lower(), "unit": wanted.unit}  # fmt: skip
        raw = await client.read_raw(wanted)
        return {"node": node, "object": f"0x{wanted[0]:04X}/{wanted[1]}", "raw": raw.hex(),
                "value": int.from_bytes(raw, "little")}  # fmt: skip

    async def _sdo_write(self, params: Params, lease: str | None) -> dict[str, Any]:
        node = node_number(self._supervisor, params["node"])
        wanted = self._object(node, str(params["object"]))
        if not isinstance(wanted, ObjectDef):
            raise UsageError(
                f"{params['object']} is in no table, so its type is unknown",
                remedy="`canhelm object list` shows what can be written",
            )
        value = _as_typed(wanted, params["value"])
        require_write_allowed(self._supervisor, node, wanted.index)
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


def table_of(supervisor: Supervisor, node: int) -> ObjectTable:
    """The objects of a node: an encoder's where the profile says so, a drive's otherwise."""
    device = supervisor.devices.by_node.get(node)
    if device is not None and device.name in supervisor.devices.encoders:
        return ENCODER_OBJECTS
    return EPOS_OBJECTS


def _readings(wanted: ObjectDef, value: int | str | bytes) -> dict[str, str]:
    """A number in hexadecimal, and in words where its values have a meaning each."""
    if not isinstance(value, int):
        return {}
    bits = wanted.type.bits
    reading = {"hex": f"0x{value & (1 << bits) - 1:0{bits // 4}X}"}
    state = state_of(value) if wanted.name == "statusword" else None
    words = state.words if state is not None else VALUE_TABLES.get(wanted.name, {}).get(value)
    return reading if words is None else {**reading, "words": words}


def _as_typed(wanted: ObjectDef, value: float | str) -> int | str:
    """What a person typed in the type of an object. Raises UsageError where it is no whole number, but should be."""
    if not wanted.type.bits:
        return str(value)
    if isinstance(value, int):
        return value
    try:
        return int(str(value), 0)
    except ValueError:
        raise UsageError(
            f"{value!r} is no whole number",
            object=wanted.address,
            value=value,
            remedy=f"{wanted.name} takes a whole number",
        ) from None
