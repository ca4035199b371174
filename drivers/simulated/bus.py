"""The simulated wire: a CAN bus in this process, with the arbitration and the frame times of a real one.

The bus keeps its own time base. A frame begins when the wire is free and it wins the arbitration, and is stamped with
the end of its last bit; that is when it is delivered on virtual time. A real loop wakes up late: then everything whose
stamp has passed is delivered in one go, and what a participant sends in answer is queued at the stamp of the frame it
answers, so that neither the stamps nor the throughput depend on the loop's lateness. A loop of virtual time may offer
``jump_to``, which spares the frames of a burst a timer each.
"""

from __future__ import annotations

import asyncio
import math
import random
from collections import defaultdict, deque
from collections.abc import Callable, Iterable
from heapq import heapify, heappop, heappush

from drivers.bus.contract import ID_MASK, RTR_FLAG, Bus, FrameHandler
from drivers.bus.wire_time import INTERMISSION_BITS, LoadMeter, frame_bits

QUEUE_DEPTH = 64

ERROR_FRAME_BITS = 20 + INTERMISSION_BITS
"""Error flag and its echo (12 bits), delimiter (8) and intermission (Bosch CAN 2.0 part A, 3.1.3)."""

ERROR_STEP, ERROR_PASSIVE, BUS_OFF = 8, 128, 256
"""What each error adds to a participant's counter, and where that makes it error-passive and bus-off."""


class SimulatedPort(Bus):
    """One participant's connection to a simulated bus; made by :meth:`SimulatedBus.port`.

    Attributes:
        participant: who it belongs to.
        attached: whether it takes part in the bus: from the beginning until :meth:`close`.
        connected: set it to False to pull the cable: frames are lost both ways.
        accepted: identifiers that reach ``receiver``; None for all.
        depth: frames that the transmit queue holds.
        queued: frames in the transmit queue, the one on the wire included.
        queue_high_water: most frames that were ever queued at a time.
        lost: own frames lost because the cable was pulled or the port closed.
        receiver_errors: exceptions that ``receiver`` or a tap raised.
        errors: error counter of a participant with another bit rate than the bus.
    """

    def __init__(self, medium: SimulatedBus, participant: str, depth: int) -> None:
        super().__init__(medium.name, medium.bit_rate)
        self.participant = participant
        self.attached = False
        self.connected = True
        self.accepted: frozenset[int] | None = None
        self.depth = depth
        self.queued = 0
        self.queue_high_water = 0
        self.lost = 0
        self.receiver_errors = 0
        self.errors = 0
        self._medium = medium

    async def open(self) -> None:
        """Take part in the bus again after :meth:`close`; a new port does so from the beginning."""
        self._medium.attach(self)

    def accept(self, ids: Iterable[int]) -> None:
        """Let only these 11-bit identifiers through to ``receiver``, data and remote frames alike; taps see all."""
        self.accepted = frozenset(ids)
        self._medium.forget_routes()

    def set_bit_rate(self, bit_rate: int) -> None:
        """Begin anew with a bit rate, which may be another one than the bus has: see :class:`SimulatedBus`."""
        self.bit_rate = bit_rate
        self.errors = 0
        self._medium.forget_routes()

    def send(self, can_id: int, data: bytes = b"", deadline_s: float = math.inf) -> None:
        """Queue one frame; see :meth:`Bus.send`. Raises ValueError for what no base frame can be."""
        self._medium.transmit(self, can_id, data, deadline_s)

    def load(self) -> float:
        """Share of the last second that the wire was busy, 0 to 1."""
        return self._medium.load()

    def remedy(self) -> str:
        """What mends an interface that a fault has taken down."""
        return "`canhelm sim faults` shows the fault, `canhelm sim fault clear` mends it"

    async def close(self) -> None:
        """Leave the bus; what is still queued is dropped."""
        self._medium.detach(self)


_Queued = tuple[int, int, int, bytes, int, float, SimulatedPort]
"""Priority on the wire, order of queueing, identifier with flags, data, bits, deadline, sender."""


class SimulatedBus:
    """The medium that joins all ports. Of everything queued when the wire gets free, the lowest identifier goes first.

    A participant with another bit rate understands nothing and takes every frame for an error. It destroys frames of
    others until its error counter makes it error-passive. Its own frames are all destroyed, until it is bus-off; then
    its ``connected`` is False (Bosch CAN 2.0 part A, 8: counts of 8, limits 128 and 256).

    Args:
        bit_rate: bit/s.
        name: the interface's name as it stands in logs.
        seed: of the disturbances.
        instant: frames take no time, for nodes on an interface whose wire takes it.
        disturbed: share of the frames, 0 to 1, whose last bit a disturbance destroys. Nobody gets such a frame; its
            sender repeats it after the error frame.

    Attributes:
        frames: frames sent, by identifier with flags.
        error_frames: frames destroyed.
        faults: asked for each frame, with identifier, data, sender and stamp: whether it arrives as it is; None: they
            all do. Of one that does not, whoever is asked calls :meth:`deliver` as often as it shall arrive.
    """

    def __init__(
        self,
        bit_rate: int = 1_000_000,
        name: str = "vcan0",
        seed: int = 0,
        disturbed: float = 0.0,
        *,
        instant: bool = False,
    ) -> None:
        self.bit_rate = bit_rate
        self.name = name
        self.frames: defaultdict[int, int] = defaultdict(int)
        self.error_frames = 0
        self.faults: Callable[[int, bytes, SimulatedPort, float], bool] | None = None
        self._disturbed = disturbed
        self._random = random.Random(seed)
        self._bit_s = 0.0 if instant else 1.0 / bit_rate
        self._meter = LoadMeter(bit_rate)
        self._ports: list[SimulatedPort] = []
        self._routes: dict[int, tuple[SimulatedPort, ...]] = {}
        self._taps: list[list[FrameHandler]] = []
        self._strangers: tuple[SimulatedPort, ...] = ()
        self._timer: asyncio.TimerHandle | None = None
        self._queue: list[_Queued] = []
        self._behind: deque[tuple[float, _Queued]] = deque()
        self._order = 0
        self._current: _Queued | None = None
        self._start_s = self._end_s = self._free_s = 0.0
        self._delivering = False

    def port(self, participant: str, depth: int = QUEUE_DEPTH) -> SimulatedPort:
        """Connect one more participant; ``depth`` is the number of frames its transmit queue holds."""
        port = SimulatedPort(self, participant, depth)
        self.attach(port)
        return port

    @property
    def busy_s(self) -> float:
        """Time that the wire has been busy since the beginning, intermissions included."""
        return self._meter.total_bits * self._bit_s

    @property
    def queue_high_water(self) -> int:
        """Most frames that ever waited at a time in one port's queue."""
        return max((port.queue_high_water for port in self._ports), default=0)

    def load(self) -> float:
        """Share of the last second that the wire was busy, 0 to 1."""
        return self._meter.load(asyncio.get_running_loop().time())

    def attach(self, port: SimulatedPort) -> None:
        """Let a port take part."""
        if not port.attached:
            port.attached = True
            self._ports.append(port)
            self.forget_routes()

    def detach(self, port: SimulatedPort) -> None:
        """Take a port off the bus with everything it has queued; a frame on the wire is completed."""
        if port.attached:
            port.attached = False
            self._ports.remove(port)
            self.forget_routes()
            self._queue = [queued for queued in self._queue if queued[6] is not port]
            heapify(self._queue)
            self._behind = deque(late for late in self._behind if late[1][6] is not port)
            port.queued = int(self._current is not None and self._current[6] is port)

    def forget_routes(self) -> None:
        """Work out anew who gets which identifier, and whose taps see it."""
        self._routes.clear()
        self._taps = [port.taps for port in self._ports]
        self._strangers = tuple(port for port in self._ports if port.bit_rate != self.bit_rate)

    def transmit(self, port: SimulatedPort, can_id: int, data: bytes, deadline_s: float) -> None:
        """Queue a frame of ``port`` as of now: the loop's time, or the stamp of the frame being delivered."""
        bits = frame_bits(can_id, data)
        now = self._end_s if self._delivering else asyncio.get_running_loop().time()
        fits = port.attached and port.connected and port.queued < port.depth
        if not (fits or self._admits(port, now)):
            return
        port.queued += 1
        if port.queued > port.queue_high_water:
            port.queue_high_water = port.queued
        self._order += 1
        priority = (can_id & ID_MASK) << 1 | (can_id & RTR_FLAG != 0)  # a data frame beats a remote one of its number
        queued = (priority, self._order, can_id, data, bits, deadline_s, port)
        current = self._current
        if current is not None and now > self._free_s:
            self._behind.append((now, queued))
            return
        heappush(self._queue, queued)
        if current is None:
            self._begin_next(max(now, self._free_s))
        elif not self._delivering and queued < current and now <= self._start_s:
            heappush(self._queue, current)
            self._begin_next(self._start_s)

    def _admits(self, port: SimulatedPort, now_s: float) -> bool:
        """Whether a port may queue one more frame; a full queue makes room by what has become stale."""
        if not (port.attached and port.connected):
            port.lost += 1
            return False
        if port.queued >= port.depth:
            stale = [queued for queued in self._queue if queued[6] is port and queued[5] < now_s]
            for queued in stale:
                self._drop(queued)
                self._queue.remove(queued)
            heapify(self._queue)
        if port.queued >= port.depth:
            port.counters.dropped_full += 1
            return False
        return True

    def _drop(self, queued: _Queued) -> None:
        port = queued[6]
        port.queued -= 1
        if port.connected:
            port.counters.dropped_stale += 1
        else:
            port.lost += 1

    def _begin_next(self, start_s: float) -> None:
        """Put the most urgent frame on the wire at ``start_s`` or, where none is queued by then, as soon as one is."""
        queue, behind = self._queue, self._behind
        while True:
            while behind and behind[0][0] <= start_s:
                heappush(queue, behind.popleft()[1])
            if queue:
                queued = heappop(queue)
                if queued[5] >= start_s and queued[6].connected:
                    break
                self._drop(queued)
            elif behind:
                start_s = behind[0][0]
            else:
                self._current = None
                return
        bits = queued[4]
        self._current = queued
        self._start_s = start_s
        self._end_s = start_s + (bits - INTERMISSION_BITS) * self._bit_s
        self._free_s = start_s + bits * self._bit_s
        if not self._delivering:
            self._arm()

    def _arm(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
        self._timer = asyncio.get_running_loop().call_at(self._end_s, self._on_frame_end)

    def _on_frame_end(self) -> None:
        """Deliver every frame whose stamp has passed; always at least the one that the timer was set for."""
        self._timer = None
        self._delivering = True
        loop = asyncio.get_running_loop()
        jump_to: Callable[[float], bool] = getattr(loop, "jump_to", _cannot_jump)
        now = max(loop.time(), self._end_s)
        while (sent := self._current) is not None and (self._end_s <= now or jump_to(self._end_s)):
            if (self._strangers or self._disturbed) and self._is_destroyed(sent[6]):
                self._repeat(sent)
            else:
                self._complete(sent)
            self._begin_next(self._free_s)
        self._delivering = False
        if sent is not None:
            self._timer = loop.call_at(self._end_s, self._on_frame_end)

    def _repeat(self, destroyed: _Queued) -> None:
        """Signal an error and let the frame take part in the next arbitration again."""
        self.error_frames += 1
        for port in self._ports:
            port.counters.error_frames += port.connected
        bits = destroyed[4] - INTERMISSION_BITS + ERROR_FRAME_BITS
        self._free_s = self._start_s + bits * self._bit_s
        self._meter.add(self._free_s, bits)
        heappush(self._queue, destroyed)

    def _complete(self, sent: _Queued) -> None:
        _, _, can_id, data, bits, _, sender = sent
        self._meter.add(self._free_s, bits)
        sender.queued -= 1
        if not sender.connected:
            sender.lost += 1
            return
        sender.counters.sent += 1
        self.frames[can_id] += 1
        if self.faults is None or self.faults(can_id, data, sender, self._end_s):
            self.deliver(can_id, data, sender, self._end_s)

    def deliver(self, can_id: int, data: bytes, sender: SimulatedPort, end_s: float) -> None:
        """Let a frame arrive at everybody but its sender, stamped with ``end_s``."""
        if any(self._taps):
            self._show_to_taps(can_id, data, end_s)
        route = self._routes.get(can_id)
        if route is None:
            route = self._routes[can_id] = self._find_route(can_id & ID_MASK)
        for port in route:
            receiver = port.receiver
            if receiver is None or port is sender or not port.connected:
                continue
            port.counters.received += 1
            try:
                receiver(can_id, data, end_s)
            except Exception as error:  # noqa: BLE001 - one participant's mistake must not stop the wire
                self._report(port, error)

    def _show_to_taps(self, can_id: int, data: bytes, end_s: float) -> None:
        for port in self._ports:
            for tap in tuple(port.taps) if port.connected else ():
                try:
                    tap(can_id, data, end_s)
                except Exception as error:  # noqa: BLE001 - a listener's mistake must not stop the wire
                    self._report(port, error)

    def _find_route(self, number: int) -> tuple[SimulatedPort, ...]:
        return tuple(
            port
            for port in self._ports
            if (port.accepted is None or number in port.accepted) and port.bit_rate == self.bit_rate
        )

    def _is_destroyed(self, sender: SimulatedPort) -> bool:
        """Whether a disturbance or a participant with another bit rate spoils a frame; the errors are counted."""
        spoilt = bool(self._disturbed) and self._random.random() < self._disturbed
        for port in self._strangers:
            limit = BUS_OFF if port is sender else ERROR_PASSIVE
            if port.connected and port.errors < limit:
                port.errors += ERROR_STEP
                spoilt = True
            if port.errors >= BUS_OFF:
                port.connected = False
        return spoilt or sender in self._strangers

    def _report(self, port: SimulatedPort, error: Exception) -> None:
        port.receiver_errors += 1
        message = f"a receiver of {port.participant} on {self.name} failed"
        asyncio.get_running_loop().call_exception_handler({"message": message, "exception": error})


def _cannot_jump(_: float) -> bool:
    """Real time does not jump."""
    return False
