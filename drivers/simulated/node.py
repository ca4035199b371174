"""A CANopen slave on a simulated bus: NMT, SDO server, PDOs, guarding, emergencies (CiA 301).

What a device of a certain kind adds (its objects, what they do) comes from a subclass.
"""

from __future__ import annotations

import asyncio
import struct
from collections.abc import Callable
from dataclasses import dataclass

from drivers.bus.contract import ID_MASK, RTR_FLAG
from drivers.canopen.codes import NmtCommand, NmtState
from drivers.simulated.bus import SimulatedPort
from drivers.simulated.dictionary import CANNOT_STORE, LOAD, OUT_OF_RANGE, SAVE, SdoAbort, SimulatedDictionary
from drivers.simulated.guarding import GuardedSide
from drivers.simulated.pdo import Pdo, ReceivePdo, TransmitPdo
from drivers.simulated.sdo_block_server import BlockServer
from drivers.simulated.sdo_server import SdoServer

_NMT, _SYNC, _EMCY, _SDO_ANSWER, _SDO_REQUEST, _GUARDING = 0x000, 0x080, 0x080, 0x580, 0x600, 0x700
_GUARD_TIME, _LIFE_TIME_FACTOR = 0x100C, 0x100D
_EMERGENCY = struct.Struct("<HB5s")
_HIGHEST_NODE_ID = 127
_COMMUNICATION_RESET_S = 0.005
"""Time that an NMT reset communication takes (assumed)."""
_COMMANDS = {int(command): command for command in NmtCommand}
_STATES = {
    NmtCommand.START: NmtState.OPERATIONAL,
    NmtCommand.STOP: NmtState.STOPPED,
    NmtCommand.ENTER_PRE_OPERATIONAL: NmtState.PRE_OPERATIONAL,
}

Handler = Callable[[bytes, float], None]


@dataclass(slots=True)
class NodeCounters:
    """What a node received and could not use."""

    malformed: int = 0
    """Frames of a wrong length on NMT or SDO, or with an unknown NMT command."""
    pdo_length: int = 0
    """PDOs whose length is not the mapped one."""
    pdo_refused: int = 0
    """PDOs with a value that the device refuses."""


class SimulatedNode:
    """One slave, switched off until :meth:`power_on`.

    Args:
        port: its connection to the bus.
        node_id: 1 to 127; 255 for a device that was given none and keeps silent.
        dictionary: its objects.
        receive_pdos, transmit_pdos: how many it has.
        boot_delay_s: time from power-up or reset to the boot-up message.
        transmit_types: transmission types of its TPDOs.
        block_transfer: whether its SDO server knows block transfer.

    Attributes:
        nmt_state: BOOT_UP while it is off or starts.
        counters: frames that it could not use.
        answer_sdo: its SDO server: what is answered to a request of 8 bytes, None for nothing.
    """

    def __init__(
        self,
        port: SimulatedPort,
        node_id: int,
        dictionary: SimulatedDictionary,
        *,
        receive_pdos: int,
        transmit_pdos: int,
        boot_delay_s: float,
        transmit_types: frozenset[int] = frozenset((1, 255)),
        block_transfer: bool = False,
    ) -> None:
        self.port = port
        self.node_id = node_id
        self.dictionary = dictionary
        self.boot_delay_s = boot_delay_s
        self.powered = False
        self.nmt_state = NmtState.BOOT_UP
        self.counters = NodeCounters()
        self.error_register = 0
        self.error_history: list[int] = []
        self._history_length = sum(index == 0x1003 and sub > 0 for index, sub in dictionary.objects)
        self._sdo = SdoServer(dictionary, BlockServer(dictionary, self._answer_sdo) if block_transfer else None)
        self.answer_sdo: Callable[[bytes], bytes | None] = self._sdo.answer
        numbers = range(receive_pdos)
        self._rpdos = [ReceivePdo(dictionary, 0x1400 + n, 0x1600 + n, self._may_remap) for n in numbers]
        numbers = range(transmit_pdos)
        self.tpdos = [TransmitPdo(dictionary, 0x1800 + n, 0x1A00 + n, self._may_remap, transmit_types) for n in numbers]
        self._sync_rpdos: list[ReceivePdo] = []
        self._sync_tpdos: list[TransmitPdo] = []
        self._handlers: dict[int, Handler] = {}
        self._guarding = GuardedSide(self._life_time_s, self._on_master_lost)
        self._boot_timer: asyncio.TimerHandle | None = None
        self._starting = False
        self._held_emergency: bytes | None = None
        self._describe_objects()
        port.connected = False
        port.receiver = self._receive

    # What a device adds

    def before_access(self, now_s: float) -> None:
        """Called before objects are read or written: bring the simulated world up to this moment."""

    def before_start(self, whole: bool) -> None:
        """Called before the node starts anew: from power-up or a reset (``whole``), or its communication alone."""

    def services(self) -> dict[int, Handler]:
        """Handlers of what the device listens to beside CiA 301, in its present state, by identifier."""
        return {}

    def application_started(self) -> None:
        """Called when the node has restarted, with the values of power-up in the dictionary."""

    def application_stopped(self) -> None:
        """Called when the node loses power or is reset."""

    def nmt_changed(self) -> None:
        """Called when the NMT state has changed."""

    def master_lost(self) -> None:
        """Called when life guarding finds the master gone."""

    def take_node_id(self, node_id: int) -> None:
        """Change the node id, for :meth:`before_start`."""
        self.node_id = node_id
        self.dictionary.take_node_id(node_id)

    # Power

    def power_on(self) -> None:
        """Switch the node on; it boots after its delay. No effect on a node that is on."""
        if not self.powered:
            self.powered = True
            self.port.connected = True
            self.restart()

    def power_off(self) -> None:
        """Switch the node off at once: it is silent, and everything that was not saved is lost."""
        if self.powered:
            self.powered = False
            self._halt()
            self.port.connected = False

    def restart(self) -> None:
        """Start anew, as by NMT reset node or by the device's own watchdog."""
        self._halt()
        self.before_start(True)
        self.dictionary.restart()
        self.error_register = 0
        self.error_history.clear()
        self._starting = True
        self._boot_timer = asyncio.get_running_loop().call_later(self.boot_delay_s, self._boot, True)

    def _halt(self) -> None:
        self.before_access(asyncio.get_running_loop().time())
        self.application_stopped()
        self._stop_communication()

    def _stop_communication(self) -> None:
        if self._boot_timer is not None:
            self._boot_timer.cancel()
            self._boot_timer = None
        self._guarding.restart()
        self._held_emergency = None
        self._sdo.reset()
        self._enter(NmtState.BOOT_UP)

    def reset_communication(self) -> None:
        """Start the communication anew, as NMT reset communication does; a node that is starting does so anyway."""
        if self._starting:
            return
        self._stop_communication()
        self.before_start(False)
        self.dictionary.restart(communication_only=True)
        loop = asyncio.get_running_loop()
        self._boot_timer = loop.call_later(_COMMUNICATION_RESET_S, self._boot, False)

    def _boot(self, whole: bool) -> None:
        self._boot_timer = None
        if whole:
            self._starting = False
            self.application_started()
        if self.node_id > _HIGHEST_NODE_ID:
            self._listen()
            return
        self.port.send(_GUARDING + self.node_id, bytes((NmtState.BOOT_UP,)))
        self._enter(NmtState.PRE_OPERATIONAL)

    # Frames in

    def _receive(self, can_id: int, data: bytes, now_s: float) -> None:
        handler = self._handlers.get(can_id)
        if handler is not None:
            handler(data, now_s)

    def _enter(self, state: NmtState) -> None:
        self.nmt_state = state
        self._listen()
        if state in (NmtState.PRE_OPERATIONAL, NmtState.OPERATIONAL) and self._held_emergency is not None:
            self.port.send(_EMCY + self.node_id, self._held_emergency)
            self._held_emergency = None
        self.nmt_changed()

    def _listen(self) -> None:
        """Handle what the NMT state allows (CiA 301 7.3.2.2) by identifier."""
        state, handlers = self.nmt_state, self.services()
        if state is not NmtState.BOOT_UP:
            handlers[_NMT] = self._on_nmt
            handlers[_GUARDING + self.node_id | RTR_FLAG] = self._on_guard_request
            if state is not NmtState.STOPPED:
                handlers[_SDO_REQUEST + self.node_id] = self._on_sdo
            if state is NmtState.OPERATIONAL:
                self._listen_to_pdos(handlers)
        self._handlers = handlers
        self.port.accept(can_id & ID_MASK for can_id in handlers)

    def _listen_to_pdos(self, handlers: dict[int, Handler]) -> None:
        pdos: list[Pdo] = [*self._rpdos, *self.tpdos]
        for pdo in pdos:
            pdo.compile()
        self._sync_rpdos = [pdo for pdo in self._rpdos if pdo.can_id is not None and pdo.transmission_type == 1]
        self._sync_tpdos = [pdo for pdo in self.tpdos if pdo.can_id is not None and pdo.transmission_type == 1]
        handlers[_SYNC] = self._on_sync
        for rpdo in self._rpdos:
            if rpdo.can_id is not None:
                handlers[rpdo.can_id] = self._receiver_of(rpdo)
        for tpdo in self.tpdos:
            if tpdo.can_id is not None and tpdo.transmission_type != 1:
                handlers[tpdo.can_id | RTR_FLAG] = self._answerer_of(tpdo)

    def _receiver_of(self, pdo: ReceivePdo) -> Handler:
        at_once = pdo.transmission_type != 1

        def receive(data: bytes, now_s: float) -> None:
            if not pdo.accepts(data):
                self.counters.pdo_length += 1
                return
            pdo.latch(data)
            if at_once:
                self.before_access(now_s)
                self._apply(pdo)

        return receive

    def _answerer_of(self, pdo: TransmitPdo) -> Handler:
        def answer(_: bytes, now_s: float) -> None:
            self.before_access(now_s)
            self.send_pdo(pdo)

        return answer

    def send_pdo(self, pdo: TransmitPdo) -> None:
        """Sample a PDO now and queue it."""
        if pdo.can_id is not None:
            self.port.send(pdo.can_id, pdo.sample())

    def _apply(self, pdo: ReceivePdo) -> None:
        try:
            pdo.apply_latched()
        except SdoAbort:
            self.counters.pdo_refused += 1

    def _on_sync(self, _: bytes, now_s: float) -> None:
        """Sample first, then act: what is sent is the state at the SYNC."""
        self.before_access(now_s)
        for tpdo in self._sync_tpdos:
            self.send_pdo(tpdo)
        for rpdo in self._sync_rpdos:
            self._apply(rpdo)

    def _on_sdo(self, data: bytes, now_s: float) -> None:
        if len(data) != 8:
            self.counters.malformed += 1
            return
        self.before_access(now_s)
        answer = self.answer_sdo(data)
        if answer is not None:
            self._answer_sdo(answer)

    def _answer_sdo(self, answer: bytes) -> None:
        self.port.send(_SDO_ANSWER + self.node_id, answer)

    def _on_nmt(self, data: bytes, _: float) -> None:
        command = _COMMANDS.get(data[0]) if len(data) == 2 else None
        if command is None:
            self.counters.malformed += 1
            return
        if data[1] not in (0, self.node_id):
            return
        if command is NmtCommand.RESET_NODE:
            self.restart()
        elif command is NmtCommand.RESET_COMMUNICATION:
            self.reset_communication()
        elif _STATES[command] is not self.nmt_state:
            self._enter(_STATES[command])

    # Guarding

    def _on_guard_request(self, _: bytes, now_s: float) -> None:
        self.port.send(_GUARDING + self.node_id, self._guarding.answer(self.nmt_state, now_s))

    def _life_time_s(self) -> float:
        return 0.001 * self.dictionary.number("guard_time") * self.dictionary.number("life_time_factor")

    def _on_master_lost(self) -> None:
        self.before_access(asyncio.get_running_loop().time())
        self.master_lost()

    # Emergencies

    def emergency(self, code: int, register: int, vendor: bytes = b"") -> None:
        """Send an EMCY and note it in the history; a stopped node sends the latest one when it is stopped no more.

        Args:
            code: error code, 0 for "no error".
            register: the error register from now on.
            vendor: up to 5 manufacturer specific bytes.
        """
        self.error_register = register
        if code:
            self.error_history = [code, *self.error_history][: self._history_length]
        frame = _EMERGENCY.pack(code, register, vendor)
        if self.nmt_state in (NmtState.PRE_OPERATIONAL, NmtState.OPERATIONAL):
            self.port.send(_EMCY + self.node_id, frame)
        elif self.powered:
            self._held_emergency = frame

    # Objects that every node has

    def _describe_objects(self) -> None:
        readers, checks, actions = self.dictionary.readers, self.dictionary.checks, self.dictionary.actions
        readers[0x1001, 0] = lambda: self.error_register
        readers[0x1003, 0] = lambda: len(self.error_history)
        for sub in range(1, self._history_length + 1):
            readers[0x1003, sub] = self._history_reader(sub)
        checks[0x1003, 0] = _check_clear
        actions[0x1003, 0] = lambda _: self.error_history.clear()
        for index, code, act in ((0x1010, SAVE, self.dictionary.save), (0x1011, LOAD, self.dictionary.forget)):
            readers[index, 1] = lambda: 1
            checks[index, 1] = signature_check(code)
            actions[index, 1] = _ignoring_value(act)
        for index in (_GUARD_TIME, _LIFE_TIME_FACTOR):
            actions[index, 0] = lambda _: self._guarding.life_time_changed()
        pdos: list[Pdo] = [*self._rpdos, *self.tpdos]
        for pdo in pdos:
            for address in pdo.configuration:
                actions[address] = lambda _: self._listen()

    def _history_reader(self, sub: int) -> Callable[[], int]:
        return lambda: self.error_history[sub - 1] if sub <= len(self.error_history) else 0

    def _may_remap(self) -> bool:
        return self.nmt_state is NmtState.PRE_OPERATIONAL


def signature_check(code: int) -> Callable[[int], None]:
    """A check that lets only the signature of a save or load command pass."""

    def check(value: int) -> None:
        if value != code:
            raise SdoAbort(CANNOT_STORE)

    return check


def _check_clear(value: int) -> None:
    if value:
        raise SdoAbort(OUT_OF_RANGE)


def _ignoring_value(act: Callable[[], None]) -> Callable[[int], None]:
    return lambda _: act()
