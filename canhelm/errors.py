"""The one tree of errors, shared by both ends of the socket.

Leaves are cut by what the caller can do about them. Every error says what happened and where; ``remedy`` says what to
do next. ``exit_code`` is what the command line returns for it and ``rpc_code`` what stands in a JSON-RPC error object.
"""

from __future__ import annotations

from typing import Any, ClassVar


class CanhelmError(Exception):
    """Root of all errors.

    Args:
        message: what happened and where, one sentence.
        node: CANopen node id concerned, if any.
        object: object concerned, as ``"0x6041"`` or ``"0x2078/1"``, or a field of a profile.
        value: the offending value.
        limit: the limit it broke, as a number or in words.
        remedy: what to do next, one sentence.
    """

    exit_code: ClassVar[int] = 1
    rpc_code: ClassVar[int] = -32000

    def __init__(
        self,
        message: str,
        *,
        node: int | None = None,
        object: str | None = None,
        value: Any = None,
        limit: Any = None,
        remedy: str | None = None,
    ) -> None:
        super().__init__(message)
        self.message = message
        self.node = node
        self.object = object
        self.value = value
        self.limit = limit
        self.remedy = remedy

    def __str__(self) -> str:
        return f"{self.message} ({self.remedy})" if self.remedy else self.message

    def data(self) -> dict[str, Any]:
        """The ``data`` member of a JSON-RPC error object: the class by name and every field that is set."""
        fields = {"node": self.node, "object": self.object, "value": self.value, "limit": self.limit}
        fields["remedy"] = self.remedy
        return {"type": type(self).__name__, **{key: value for key, value in fields.items() if value is not None}}


class Refused(CanhelmError):
    """The request is understood and will not be carried out as things stand."""

    rpc_code = -32001


class LimitExceeded(Refused):
    """The request lies outside a limit of the vehicle; ``limit`` names it."""

    rpc_code = -32002


class NotReady(Refused):
    """Something that the request needs is not there yet (a node that still boots, a vehicle in fault)."""

    rpc_code = -32003


class Aborted(CanhelmError):
    """A device answered an SDO request with an abort code, kept in ``value``."""

    rpc_code = -32004


class DeviceFault(CanhelmError):
    """A device reported a fault or did not do what it was told."""

    rpc_code = -32005


class BusOff(CanhelmError):
    """The CAN interface is down, bus-off or gone."""

    rpc_code = -32006


class UsageError(CanhelmError):
    """A call with arguments that make no sense (exit code 2)."""

    exit_code = 2
    rpc_code = -32602


class DaemonNotRunning(CanhelmError):
    """No daemon answers on the socket (exit code 3)."""

    exit_code = 3
    rpc_code = -32010


class PermissionRefused(CanhelmError):
    """This user may not open the socket or call this method (exit code 3)."""

    exit_code = 3
    rpc_code = -32011


class NodeAbsent(CanhelmError):
    """No such node, or it does not answer (exit code 4)."""

    exit_code = 4
    rpc_code = -32012


class Timeout(CanhelmError):
    """An answer or a motion did not come in time (exit code 5)."""

    exit_code = 5
    rpc_code = -32013


class Interlock(Refused):
    """An interlock forbids it, for instance a brake in the wrong state (exit code 6)."""

    exit_code = 6
    rpc_code = -32014


class EmergencyStop(Interlock):
    """The emergency stop is latched; a person has to reset it (exit code 6)."""

    rpc_code = -32015


class ConfigError(CanhelmError):
    """The configuration is invalid (exit code 7); the message lists every mistake with file:line."""

    exit_code = 7
    rpc_code = -32016


def _leaves(root: type[CanhelmError]) -> dict[str, type[CanhelmError]]:
    found = {root.__name__: root}
    for leaf in root.__subclasses__():
        found.update(_leaves(leaf))
    return found


def all_errors() -> list[type[CanhelmError]]:
    """Every class of the tree, the root first."""
    return list(_leaves(CanhelmError).values())


def from_rpc(error: dict[str, Any]) -> CanhelmError:
    """The exception for a JSON-RPC error object; unknown types become a plain :class:`CanhelmError`."""
    data = error.get("data")
    data = data if isinstance(data, dict) else {}
    leaf = _leaves(CanhelmError).get(str(data.get("type")), CanhelmError)
    fields = {key: data.get(key) for key in ("node", "object", "value", "limit", "remedy")}
    return leaf(str(error.get("message", "unknown error")), **fields)
