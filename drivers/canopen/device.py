"""What every device that the master boots has in common."""

from __future__ import annotations

import asyncio
import math
from abc import ABC, abstractmethod
from collections.abc import Awaitable, Callable
from typing import Any, NamedTuple

from canhelm.errors import NodeAbsent, NotReady
from drivers.canopen.master import Master
from drivers.contract import Fault, NodeState


class Step(NamedTuple):
    """One step of a node's configuration.

    Attributes:
        name: what it does, to follow "node 3 (front_left):" (``checking its identity``).
        run: does it; raises Refused, Aborted, NodeAbsent, Timeout or DeviceFault.
    """

    name: str
    run: Callable[[], Awaitable[None]]


class CanopenDevice(ABC):
    """A device on a node of its own.

    Args:
        master: the master of its bus.
        name: its name in the profile.
        node: its node id.

    Attributes:
        reading_time_s: loop time of the last cyclic reading; ``-inf`` before the first.
        on_reading: called with the node id after each cyclic reading.
        configuring: held by whoever configures it: its boot-up, or a person's command.
    """

    kind = ""

    def __init__(self, master: Master, name: str, node: int) -> None:
        self.name = name
        self.node = node
        self.node_state = NodeState.ABSENT
        self.status_sentence = ""
        self.fault: Fault | None = None
        self.reading_time_s = -math.inf
        self.on_reading: Callable[[int], None] | None = None
        self.configuring = asyncio.Lock()
        self.master = master
        master.names[node] = name
        self.sdo = master.sdo(node)

    @abstractmethod
    def boot_steps(self) -> tuple[Step, ...]:
        """The steps of one attempt to configure it, in pre-operational."""

    def urgent_steps(self) -> tuple[Step, ...]:
        """Steps of the next attempt that wait neither for other nodes nor for anything else."""
        return ()

    @abstractmethod
    def start_steps(self) -> tuple[Step, ...]:
        """The steps after it was started and guarded, before it counts as ready."""

    @abstractmethod
    def on_ready(self) -> None:
        """It is configured, started and guarded."""

    @abstractmethod
    def on_lost(self, fault: Fault) -> None:
        """It went away, or restarted; ``fault`` says how."""

    @abstractmethod
    def on_emcy(self, code: int, register: int, vendor: bytes) -> Fault | None:
        """It sent an emergency message; returns the fault it means, None for the end of all errors."""

    @abstractmethod
    async def before_close(self) -> None:
        """Leave it in order: called before the master closes, while it is ready."""

    @property
    def who(self) -> str:
        """The device for people: ``node 3 (front_left)``."""
        return f"node {self.node} ({self.name})"

    def make_fault(self, code: int, message: str, remedy: str) -> Fault:
        """A fault of this device."""
        return Fault(self.name, self.node, code, message, remedy)

    def require_ready(self) -> None:
        """Raise NodeAbsent or NotReady unless the node is configured, started and guarded."""
        if self.node_state is NodeState.READY:
            return
        failure = NodeAbsent if self.node_state is NodeState.ABSENT else NotReady
        raise failure(
            self.status_sentence or f"{self.who} was not started yet",
            node=self.node,
            remedy="`canhelm status` shows what it waits for",
        )

    def status(self) -> dict[str, Any]:
        """Everything about the device for people and programs; keys carry units."""
        fault = self.fault
        return {
            "node": self.node,
            "name": self.name,
            "device": self.kind,
            "node_state": str(self.node_state),
            "status": self.status_sentence,
            "fault": None
            if fault is None
            else {"code": f"0x{fault.code:04X}", "message": fault.message, "remedy": fault.remedy},
        }
