"""One conversation with the CiA 309-3 gateway: a line in, its answer out, and what the client has set."""

from __future__ import annotations

from canhelm import __version__
from canhelm.errors import Aborted, CanhelmError, DeviceFault, NodeAbsent, Timeout
from daemon.api.gateway309_answers import (
    EMPTY,
    ErrorNumber,
    GatewayError,
    make_abort,
    make_error,
    make_value,
    printable,
)
from daemon.api.gateway309_help import HELP
from daemon.api.gateway309_lss import LssCommands
from daemon.api.gateway309_text import Lss, Nmt, Read, Refusal, Request, Set, Tell, Write, parse_request
from daemon.api.gateway309_types import print_value
from daemon.runtime.interlocks import require_all_disabled, require_reach_allowed, require_write_allowed
from daemon.runtime.network_commands import table_of
from daemon.runtime.supervisor import Supervisor
from drivers.canopen.sdo import ABORT_OUT_OF_MEMORY, ABORT_TIMEOUT
from drivers.canopen.sdo_block import WRONG_LENGTH

SDO_TIMEOUT_S = 0.5
"""How long a node may take to answer, until the client sets another time."""
EVENTS_SHOWN = 5


class Session:
    """One client's conversation. Its defaults (node, time-out) are its own.

    Args:
        supervisor: what decides, and what the bus is reached through.
        read_only: why this client may only read; empty where it may write, too.

    Attributes:
        sequence: number of the last request.
    """

    def __init__(self, supervisor: Supervisor, read_only: str = "") -> None:
        self._supervisor = supervisor
        self._read_only = read_only
        self._lss = LssCommands(supervisor.master.lss, supervisor.devices.by_node)
        self.sequence = 0
        self._node: int | None = None
        self._timeout_s = SDO_TIMEOUT_S

    async def answer(self, line: bytes) -> bytes:
        """The whole answer to one line.

        Args:
            line: any bytes, without the ``\\n`` at their end.
        """
        request = parse_request(line)
        if request is None:
            return EMPTY
        if request.sequence is not None:
            self.sequence = request.sequence
        if isinstance(request, Refusal):
            return make_error(self.sequence, request.number, request.detail)
        try:
            return make_value(self.sequence, await self._carry_out(request))
        except GatewayError as error:
            return make_error(self.sequence, error.number, error.detail)
        except Aborted as error:
            return make_abort(self.sequence, int(error.value))
        except (NodeAbsent, Timeout):
            return make_abort(self.sequence, ABORT_TIMEOUT)
        except DeviceFault:
            return make_abort(self.sequence, ABORT_OUT_OF_MEMORY)
        except CanhelmError as error:
            return make_error(self.sequence, ErrorNumber.INTERNAL_STATE, str(error))

    async def _carry_out(self, request: Request) -> str:
        match request.command:
            case Read() as command:
                return await self._read(self._node_of(request), command)
            case Write() as command:
                return await self._write(self._node_of(request), command)
            case Nmt() as command:
                return self._nmt(self._node_of(request), command)
            case Set() as command:
                return self._set(command)
            case Lss() as command:
                self._require_write()
                require_all_disabled(self._supervisor)
                return await self._lss.carry_out(command.name, command.numbers)
            case Tell() as command:
                return self._tell(command)

    def _node_of(self, request: Request) -> int:
        node = self._node if request.node is None else request.node
        if node is None:
            raise GatewayError(ErrorNumber.NO_DEFAULT_NODE)
        return node

    def _require_write(self) -> None:
        if self._read_only:
            raise GatewayError(ErrorNumber.NOT_SUPPORTED, self._read_only)

    async def _read(self, node: int, command: Read) -> str:
        require_reach_allowed(self._supervisor, node)
        data = await self._supervisor.master.sdo(node).read_raw((command.index, command.sub), self._timeout_s)
        return print_value(data, command.datatype)

    async def _write(self, node: int, command: Write) -> str:
        self._require_write()
        require_write_allowed(self._supervisor, node, command.index)
        self._require_length(node, command)
        client = self._supervisor.master.sdo(node)
        await client.write_raw((command.index, command.sub), command.data, self._timeout_s)
        return "OK"

    def _require_length(self, node: int, command: Write) -> None:
        """Refuse what does not fit the object, as its node would: over a serial line the node is not told the length.

        The objects of a node that the profile does not name are unknown.
        """
        entry = table_of(self._supervisor, node).at(command.index, command.sub)
        known = node in self._supervisor.devices.by_node and entry is not None and entry.type.bits
        if known and len(command.data) * 8 != known:
            raise Aborted("the value has another length than the object", value=WRONG_LENGTH)

    def _nmt(self, node: int, command: Nmt) -> str:
        self._require_write()
        require_all_disabled(self._supervisor)
        self._supervisor.master.nmt(command.command, node)
        return "OK"

    def _set(self, command: Set) -> str:
        """There is one network, and long values are transferred in blocks wherever a node can: both need no memory."""
        if command.item == "node":
            self._node = command.value
        elif command.item == "sdo_timeout":
            self._timeout_s = command.value / 1e3
        return "OK"

    def _tell(self, command: Tell) -> str:
        match command.what:
            case "help":
                return HELP[command.topic]
            case "info":
                return _version()
            case "log":
                events = self._supervisor.log.last(EVENTS_SHOWN)
                return "\n".join(printable(f"{e['time_s']:.3f} {e['source']}: {e['message']}") for e in events)
            case _:
                return self._supervisor.state.value


def _version() -> str:
    """Vendor, product, revision, serial number, gateway class, version of the protocol, of the implementation."""
    major, minor = __version__.split(".")[:2]
    return f"0 0 {major}.{minor} 0 0 3.0 {major}.{minor}"
