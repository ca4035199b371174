"""The boot-up of one node, for ever: wait for it, configure it, prove it, start it, guard it; again when it comes back.

In the spirit of CiA 302-2 (boot slave): each step has a name, each attempt a deadline, each failure a sentence, and
there is always a next attempt.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Iterable

from canhelm.errors import Aborted, DeviceFault, NodeAbsent, Refused, Timeout
from drivers.canopen.codes import NmtCommand, NmtState
from drivers.canopen.device import CanopenDevice, Step
from drivers.canopen.emcy import EMCY_COB_ID, parse_emcy
from drivers.canopen.master import Master
from drivers.canopen.nmt import ERROR_CONTROL_COB_ID, parse_error_control
from drivers.contract import NodeState

LOGGER = logging.getLogger("canhelm")

FIRST_PAUSE_S = 0.1
LONGEST_PAUSE_S = 1.0
REFUSED_PAUSE_S = 2.0
"""Time before a device that was refused is looked at again."""
DEVICE_TYPE = (0x1000, 0)
NO_BOOT_UP = "no boot-up; is motor power on?"
_RESETS = (NmtCommand.RESET_NODE, NmtCommand.RESET_COMMUNICATION)
STATE_WORDS = {int(state): state.name.lower().replace("_", "-") for state in NmtState}


class _Interrupted(Exception):
    """The node must be configured anew. Args: why."""


class NodeBoot:
    """Boots one device and keeps it booted.

    Args:
        master: the master of its bus.
        device: what stands on the node.
    """

    def __init__(self, master: Master, device: CanopenDevice) -> None:
        self._master = master
        self._device = device
        self._node = device.node
        self._who = device.who
        self._sign_of_life = asyncio.Event()
        self._gone = asyncio.Event()
        self._held = False
        self._restarted = False
        self._booted = False
        self._guarded: asyncio.Future[None] | None = None
        self._wrong_toggle = False
        self._last_told = ""
        self._task: asyncio.Task[None] | None = None
        self._guard = master.guard(self._node, self._on_lost)
        master.subscribe(ERROR_CONTROL_COB_ID + self._node, self._on_error_control)
        master.subscribe(EMCY_COB_ID + self._node, self._on_emcy)
        master.on_command(self._node, self._on_command)

    def start(self) -> None:
        """Begin, on the running loop."""
        self._task = asyncio.get_running_loop().create_task(self._run(), name=f"boot {self._who}")

    async def close(self) -> None:
        """End; the node is no longer guarded."""
        self._guard.disarm()
        if self._task is not None:
            self._task.cancel()
            await asyncio.wait([self._task])

    # --- the life of a node --------------------------------------------------------------------------------------

    async def _run(self) -> None:
        while True:
            try:
                await self._one_life()
            except Exception as error:  # a task's edge: a mistake of ours must not leave a node alone
                LOGGER.exception("boot-up of %s", self._who)
                self._master.counters.internal_errors += 1
                self._fail(
                    NodeState.ABSENT, "lost", "error", f"{self._who}: internal error: {error!r}", "report the log"
                )
                await asyncio.sleep(LONGEST_PAUSE_S)

    async def _one_life(self) -> None:
        """From waiting for the node to losing it, or to the next attempt."""
        await self._wait_for_node()
        try:
            async with self._device.configuring:
                await self._configure()
        except (Refused, Aborted, DeviceFault) as error:
            self._fail(NodeState.REFUSED, "refused", "error", error.message, error.remedy or "")
            await self._pause(REFUSED_PAUSE_S)
        except (NodeAbsent, Timeout) as error:
            self._fail(
                NodeState.CONFIGURING, "waiting", "warning", self._failed_step(error.message), error.remedy or ""
            )
            await self._pause(FIRST_PAUSE_S)
        except _Interrupted as why:
            self._fail(NodeState.CONFIGURING, "waiting", "warning", self._failed_step(str(why)), "")
        else:
            self._ready()
            await self._gone.wait()
            await asyncio.sleep(1.0 / self._master.network.cycle_hz)  # pre-operational, it would not hear its last PDOs

    async def _wait_for_node(self) -> None:
        pause_s = FIRST_PAUSE_S
        while self._held or not await self._answers():
            if self._held:
                name = self._device.name
                self._say("waiting", f"{self._who} is held by command; `canhelm nmt start {name}` brings it back")
                self._sign_of_life.clear()
            elif not self._sign_of_life.is_set():
                self._device.node_state = NodeState.ABSENT
                self._say("waiting", f"waiting for {self._who}: {self._lacks()}")
            await self._pause(pause_s)
            pause_s = min(2 * pause_s, LONGEST_PAUSE_S)

    def _lacks(self) -> str:
        """Why the node is not there: the interface where that does not work, else what is not heard of the node."""
        if self._master.bus.trouble is not None:
            return self._master.bus.trouble.message
        return "no SDO answer since its boot-up; is it still powered?" if self._booted else NO_BOOT_UP

    async def _answers(self) -> bool:
        """Take the node to pre-operational, alone, and see whether it answers (a stopped node would not)."""
        self._restarted = False
        self._sign_of_life.clear()
        self._master.send_nmt(NmtCommand.ENTER_PRE_OPERATIONAL, self._node)
        try:
            await self._device.sdo.read_raw(DEVICE_TYPE)
        except Aborted:
            return True
        except (NodeAbsent, Timeout):
            return False
        return True

    async def _pause(self, pause_s: float) -> None:
        """Wait, at most until the node is heard of."""
        try:
            async with asyncio.timeout(pause_s):
                await self._sign_of_life.wait()
        except TimeoutError:
            return

    async def _configure(self) -> None:
        self._gone.clear()
        device = self._device
        device.node_state = NodeState.CONFIGURING
        loop, limit_s = asyncio.get_running_loop(), self._master.network.boot_deadline_s
        await self._take_steps(device.urgent_steps(), loop.time() + limit_s)
        device.status_sentence = f"{self._who}: waiting until other nodes are configured"
        async with self._master.pacing.turns:
            deadline_s = loop.time() + limit_s
            await self._take_steps(device.boot_steps(), deadline_s)
        start = Step("starting it", self._start)
        guard = Step("waiting for its first guarding answer", self._first_guarding_answer)
        await self._take_steps((start, guard, *device.start_steps()), deadline_s)

    async def _take_steps(self, steps: Iterable[Step], deadline_s: float) -> None:
        """One step after the other until a loop time. Raises Timeout then."""
        try:
            async with asyncio.timeout_at(deadline_s):
                for step in steps:
                    self._device.status_sentence = f"{self._who}: {step.name}"
                    await self._master.pacing.give_way()
                    await step.run()
                    if self._restarted:
                        raise _Interrupted("it restarted")
                    if self._held:
                        raise _Interrupted("it is held by command")
        except TimeoutError:
            limit_s = self._master.network.boot_deadline_s
            remedy = "check the bus load and the control cycle with `canhelm status`"
            raise Timeout(f"not done {limit_s:g} s after its boot-up began", node=self._node, remedy=remedy) from None
        except NodeAbsent:
            if self._restarted:
                raise _Interrupted("it restarted") from None
            raise

    async def _start(self) -> None:
        self._master.send_nmt(NmtCommand.START, self._node)

    async def _first_guarding_answer(self) -> None:
        loop = asyncio.get_running_loop()
        self._guarded = loop.create_future()
        self._guard.arm(loop.time())
        try:
            await self._guarded
        finally:
            self._guarded = None

    def _ready(self) -> None:
        self._last_told, self._wrong_toggle = "", False
        device = self._device
        device.node_state = NodeState.READY
        device.status_sentence = f"{self._who} is ready"
        device.on_ready()
        self._master.tell(self._node, "ready", "info", f"{self._who} is configured, started and guarded")

    def _failed_step(self, reason: str) -> str:
        return f"{self._device.status_sentence} failed: {reason}"

    def _fail(self, state: NodeState, kind: str, severity: str, message: str, remedy: str) -> None:
        self._guard.disarm()
        self._device.node_state = state
        self._say(kind, message, severity, remedy)

    def _say(self, kind: str, message: str, severity: str = "info", remedy: str = "") -> None:
        """Put a sentence into the status; it becomes an event when it is new."""
        self._device.status_sentence = f"{message} ({remedy})" if remedy else message
        if message != self._last_told:
            self._last_told = message
            self._master.tell(self._node, kind, severity, message, remedy)

    # --- what is heard of the node -------------------------------------------------------------------------------

    def _on_error_control(self, can_id: int, data: bytes, timestamp: float) -> None:
        parsed = parse_error_control(data)
        if parsed is None:
            self._master.counters.malformed += 1
            return
        toggle, state = parsed
        self._sign_of_life.set()
        if state == NmtState.BOOT_UP:
            self._on_boot_up()
        else:
            self._on_guarding_answer(toggle, state)

    def _on_boot_up(self) -> None:
        self._restarted = True
        if self._device.node_state is NodeState.READY:
            remedy = "check its supply if nobody switched it; it is configured again by itself"
            self._leave("rebooted", f"{self._who} has restarted", remedy)
        else:
            self._master.tell(self._node, "boot_up", "info", f"boot-up of {self._who}")
        self._booted = True
        self._device.sdo.give_up("restarted")

    def _on_guarding_answer(self, toggle: int, state: int) -> None:
        alternates = self._guard.answer(toggle)
        if not alternates:
            self._master.counters.toggle_errors += 1
            if not self._wrong_toggle:
                message = f"{self._who}: toggle bit of its guarding answer did not alternate"
                remedy = "`canhelm nodes scan` tells whether two nodes have this id"
                self._master.tell(self._node, "toggle", "warning", message, remedy)
            self._wrong_toggle = True
        if state == NmtState.OPERATIONAL:
            if self._guarded is not None and not self._guarded.done():
                self._guarded.set_result(None)
        elif self._device.node_state is NodeState.READY:
            words = STATE_WORDS.get(state, f"in state {state}")
            self._leave("lost", f"{self._who} is no longer operational but {words}", "it is configured again by itself")

    def _on_lost(self, awaited_s: float) -> None:
        why = f"no guarding answer for {awaited_s * 1e3:.0f} ms" if awaited_s else "the gateway waited for it in vain"
        message = f"{self._who} is lost: {why}"
        remedy = "check its motor power and the CAN cable; it is configured again when it is back"
        trouble = self._master.bus.trouble
        if trouble is not None:  # then the node is not to blame
            message, remedy = f"{trouble.message}; {message}", trouble.remedy or ""
        self._leave("lost", message, remedy)

    def _leave(self, kind: str, message: str, remedy: str, severity: str = "error") -> None:
        """The node was ready and is no longer. One that is held by command is guarded on, for it guards its life."""
        device = self._device
        self._booted = False
        self._master.counters.nodes_lost += 1
        if not self._held:
            self._guard.disarm()
        self._gone.set()
        device.fault = device.make_fault(0, message, remedy)
        device.node_state = NodeState.ABSENT
        device.status_sentence = message
        device.on_lost(device.fault)
        if self._guarded is not None and not self._guarded.done():
            self._guarded.set_exception(NodeAbsent(message, node=self._node, remedy=remedy))
        self._master.tell(self._node, kind, severity, message, remedy)

    def _on_emcy(self, can_id: int, data: bytes, timestamp: float) -> None:
        parsed = parse_emcy(data)
        if parsed is None:
            self._master.counters.malformed += 1
            return
        self._sign_of_life.set()
        fault = self._device.on_emcy(*parsed)
        if fault is None:
            self._master.tell(self._node, "emcy", "info", f"{self._who} reports that its errors are gone")
        else:
            severity = "error" if self._device.node_state is NodeState.READY else "warning"
            self._master.tell(self._node, "emcy", severity, fault.message, fault.remedy)

    def _on_command(self, command: NmtCommand) -> None:
        """A person commands the node: a stop holds it until a start or a reset."""
        self._held = command in (NmtCommand.STOP, NmtCommand.ENTER_PRE_OPERATIONAL)
        self._sign_of_life.set()
        if command in _RESETS and self._device.node_state is not NodeState.READY:
            self._guard.disarm()  # it restarts, and answers nothing until then
        if self._held and self._device.node_state is NodeState.READY:
            words = command.name.lower().replace("_", " ")
            message = f"{self._who} left operation: NMT {words} by command"
            self._leave("lost", message, "`canhelm nmt start` brings it back", "warning")
