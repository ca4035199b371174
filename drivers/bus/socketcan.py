"""SocketCAN on the running loop: one raw socket, no thread, times by the kernel.

While nobody taps the bus the kernel keeps away what the receiver does not need, this program's own frames included.
With a tap it hands over everything, own frames when they were on the wire, so that a log has the order of the wire. An
interface that goes down or vanishes is opened again as soon as it is back.
"""

from __future__ import annotations

import asyncio
import errno
import logging
import math
import os
import socket
import time
from collections.abc import Callable, Collection
from typing import Any

from canhelm.errors import BusOff
from drivers.bus import can_errors
from drivers.bus.can_link import IS_BUS_OFF, read_link
from drivers.bus.contract import Bus, FrameHandler
from drivers.bus.controller import Controller
from drivers.bus.interface_load import NETWORK_DEVICES, InterfaceLoad
from drivers.bus.socketcan_frames import (
    ANCILLARY_BYTES,
    ERROR_FLAG,
    EVERYTHING,
    LONGEST_PACKET_BYTES,
    SO_RXQ_OVFL,
    SO_TIMESTAMPNS,
    Ancillary,
    make_filters,
    make_frame,
    parse_ancillary,
    parse_frame,
)
from drivers.bus.transmit_queue import TransmitQueue

LOGGER = logging.getLogger("canhelm.bus")

NO_KERNEL_CAN = (
    "this kernel has no CAN: sudo modprobe can_raw, or another kernel; a serial adapter (slcan:DEVICE) needs none"
)
RECEIVE_BUFFER_BYTES = 4 * 1024 * 1024
"""Asked for; the kernel doubles it for its own needs."""
SEND_BUFFER_BYTES = 12 * 1024
"""Room for about 32 frames in the kernel, doubled: one control cycle of a robot. Others wait here, where they go stale,
however long the queue of the interface is."""
KERNEL_FRAME_BYTES = 768
"""What one frame takes of a buffer on a 64-bit machine."""
BATCH = 256
"""Frames taken in one go before other callbacks have their turn."""
LOOK_S = 1.0
FIRST_REOPEN_S = 0.1
LAST_REOPEN_S = 1.0
FRESH_S = 0.001
"""A frame older than this has waited, and so may others that came with it."""
OLDEST_STAMP_S = 60.0
"""A frame that seems older than this was stamped before the wall clock was set."""

_CAN_RAW_ERR_FILTER = 2
_SO_RCVBUFFORCE = 33
_OURS, _OWN = int(socket.MSG_DONTROUTE), 0x800
"""Flags of a received frame: this machine sent it; this very socket did (MSG_CONFIRM)."""
_NO_ROOM = {errno.ENOBUFS, errno.EAGAIN}


def _make_raw_socket() -> socket.socket:
    return socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW)


class _Taps(list[FrameHandler]):
    """Taps that tell when there is one more or one less."""

    def __init__(self, changed: Callable[[], None]) -> None:
        super().__init__()
        self._changed = changed

    def append(self, tap: FrameHandler) -> None:
        super().append(tap)
        self._changed()

    def remove(self, tap: FrameHandler) -> None:
        super().remove(tap)
        self._changed()


class SocketCanBus(Bus):
    """One CAN interface of the kernel. Append taps and remove them one at a time.

    Args:
        channel: name of the interface.
        bit_rate: bit/s that it is expected to have; who sets the interface up decides.
        make_socket: makes the socket, not bound yet; raises OSError.

    Attributes:
        foreign: frames that are no classic base frames.
        overflowed: frames that the kernel dropped because its receive buffer was full.
    """

    def __init__(
        self, channel: str, bit_rate: int, make_socket: Callable[[], socket.socket] = _make_raw_socket
    ) -> None:
        super().__init__(channel, bit_rate)
        self.taps = _Taps(self._on_taps)
        self._tapping: tuple[FrameHandler, ...] = ()
        self._make_socket = make_socket
        self.foreign = 0
        self.overflowed = 0
        self._controller = Controller(channel, f"then sudo ip link set {channel} down; sudo ip link set {channel} up")
        self._load = InterfaceLoad(channel, bit_rate)
        self._queue = TransmitQueue(self._transmit, self.counters)
        self._link: socket.socket | None = None
        self._no_can = False
        self._link_overflowed = 0
        self._buffered_frames = 0
        self._burst = BATCH
        self._wanted: Collection[int] | None = None
        self._heard: dict[int, FrameHandler] = {}
        self._timer: asyncio.TimerHandle | None = None
        self._reopen_s = FIRST_REOPEN_S
        self._now_s = self._newest_s = self._wall_to_loop_s = 0.0

    async def open(self) -> None:
        """Open the interface on the running loop. Raises BusOff where it is down, missing, or has another bit rate."""
        self._loop = asyncio.get_running_loop()
        self._connect()

    async def close(self) -> None:
        """Close the interface; what is still queued is dropped."""
        self._disconnect()

    def load(self) -> float:
        """Share of the last second or so that everybody's frames kept the wire busy, 0 to 1."""
        return self._load.load

    def details(self) -> dict[str, Any]:
        """What is wrong with the interface, if anything is, and what was lost on it."""
        trouble = {"down": self.down, "remedy": self.remedy()} if self.down else {}
        return {
            **trouble,
            **self._controller.details(),
            "receive_buffer_frames": self._buffered_frames,
            "dropped_overflow": self.overflowed,
            "foreign": self.foreign,
        }

    def needs(self, can_ids: Collection[int]) -> None:
        """Which identifiers the receiver needs; see :meth:`Bus.needs`."""
        self._wanted = can_ids
        self._set_filters()

    def hear(self, can_id: int, handler: FrameHandler) -> None:
        """Hand frames with an identifier that this machine sent to a handler as soon as they were on the wire.

        Whichever socket sent them: the handler is for what the kernel repeats. They do not go to the receiver, and
        count as sent.
        """
        self._heard[can_id] = handler
        self._set_filters()

    def send(self, can_id: int, data: bytes = b"", deadline_s: float = math.inf) -> None:
        """Send one frame or queue it; see :meth:`Bus.send`. Raises ValueError for what no base frame can be."""
        self._queue.send(can_id, make_frame(can_id, data), deadline_s)

    def _transmit(self, can_id: int, frame: bytes) -> bool:
        if self._link is None:
            return False
        try:
            self._link.send(frame)
        except OSError as error:
            if error.errno not in _NO_ROOM:
                self._lose(error)
            return False
        self.counters.sent += 1
        return True

    def _on_readable(self) -> None:
        """Take what has come, until nothing is left or a handler has closed the bus.

        Who asks for one more when nothing is left pays for a refusal, so as many are taken as there were the last time;
        what is left then is called for anew. What waited because this process stood still is taken wholly: the timers
        that ran out meanwhile come next, and are not to take a node for silent whose frame is here.
        """
        link = self._link
        if link is None:
            return
        self._now_s = now_s = self._loop.time()
        self._wall_to_loop_s = now_s - time.time()
        receive, take, burst = link.recvmsg, self._take, self._burst
        for taken in range(BATCH):
            if taken >= burst and now_s - self._newest_s < FRESH_S:
                self._burst = 2 * taken
                return
            try:
                packet, ancillary, flags, _ = receive(LONGEST_PACKET_BYTES, ANCILLARY_BYTES)
            except BlockingIOError:
                self._burst = max(taken, 1)
                return
            except OSError as error:
                self._lose(error)
                return
            take(packet, ancillary, flags)
            if link is not self._link:
                return

    def _take(self, packet: bytes, ancillary: Ancillary, flags: int) -> None:
        frame = parse_frame(packet)
        if frame is None:
            self.foreign += 1
            return
        can_id, data = frame
        stamp = self._stamp(ancillary)
        if can_id & ERROR_FLAG:
            self.counters.error_frames += 1
            self._follow(can_id, data)
            return
        for tap in self._tapping:
            tap(can_id, data, stamp)
        if flags & _OURS:
            if can_id in self._heard:
                self.counters.sent += not flags & _OWN
                self._heard[can_id](can_id, data, stamp)
                return
            if flags & _OWN:
                return
        if self.down is not None:
            self._recover()
        self.counters.received += 1
        if self.receiver is not None:
            self.receiver(can_id, data, stamp)

    def _stamp(self, ancillary: Ancillary) -> float:
        """Loop time at which a frame came; what was lost before it is counted."""
        wall_s, lost = parse_ancillary(ancillary)
        if lost:
            self._count_overflow(lost)
        stamp = self._now_s if wall_s is None else wall_s + self._wall_to_loop_s
        self._newest_s = stamp if abs(stamp - self._now_s) < OLDEST_STAMP_S else self._now_s
        return self._newest_s

    def _count_overflow(self, lost: int) -> None:
        """Count what the receive buffer had no room for; the kernel counts in 32 bits since the socket was made."""
        if not self.overflowed:
            LOGGER.error(
                "%s: the receive buffer overflowed, frames are lost (%s)", self.name, "is this machine too busy?"
            )
        self.overflowed += (lost - self._link_overflowed) & 0xFFFF_FFFF
        self._link_overflowed = lost

    def _follow(self, can_id: int, data: bytes) -> None:
        """Take what an error frame says of the controller."""
        self._controller.take(can_id, data)
        if self._controller.bus_off:
            self.down = "bus-off"
            self._queue.close()
        elif self.down is not None:
            self._recover()

    def _recover(self) -> None:
        """The controller is no longer bus-off: others' frames come in, or it says so."""
        self.down = None
        self._controller.recovered()
        self._queue.open()

    def _on_taps(self) -> None:
        self._tapping = tuple(self.taps)
        self._set_filters()

    def _set_filters(self) -> None:
        if self._link is not None:
            try:
                self._link.setsockopt(socket.SOL_CAN_RAW, socket.CAN_RAW_FILTER, self._filters())
                self._link.setsockopt(socket.SOL_CAN_RAW, socket.CAN_RAW_RECV_OWN_MSGS, self._wants_own())
            except OSError as error:
                self._lose(error)

    def _wants_own(self) -> bool:
        """Whether anybody here wants to see this socket's own frames."""
        return bool(self.taps or self._heard)

    def _filters(self) -> bytes:
        if self.taps or self._wanted is None:
            return EVERYTHING
        return make_filters({*self._wanted, *self._heard})

    def _connect(self) -> None:
        try:
            self._link = link = self._make_link()
            link.bind((self.name,))
            number = link.getsockopt(socket.SOL_SOCKET, socket.SO_ERROR)  # where an interface that is down says so
            if number:
                raise OSError(number, os.strerror(number))
        except OSError as error:
            self._disconnect()
            raise self._bus_off(error) from error
        found = read_link(self.name)
        self._require_bit_rate(found.bit_rate)
        self._link_overflowed = 0
        self._reopen_s = FIRST_REOPEN_S
        self._loop.add_reader(link.fileno(), self._on_readable)
        self._recover()
        if found.state == IS_BUS_OFF:
            self._follow(can_errors.BUS_OFF, b"")
        self._look()

    def _require_bit_rate(self, rate: int | None) -> None:
        """Take no part with another bit rate than the network's: it would destroy the others' frames."""
        if rate not in (None, self.bit_rate):
            self._disconnect()
            self.down = f"it has {rate} bit/s, the profile says {self.bit_rate}"
            raise BusOff(f"socketcan interface {self.name}: {self.down}", remedy=self.remedy())

    def _make_link(self) -> socket.socket:
        link = self._make_socket()
        link.setblocking(False)
        try:
            link.setsockopt(socket.SOL_SOCKET, _SO_RCVBUFFORCE, RECEIVE_BUFFER_BYTES)
        except PermissionError:
            link.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, RECEIVE_BUFFER_BYTES)
        self._buffered_frames = link.getsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF) // KERNEL_FRAME_BYTES
        link.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, SEND_BUFFER_BYTES)
        link.setsockopt(socket.SOL_SOCKET, SO_TIMESTAMPNS, 1)
        link.setsockopt(socket.SOL_SOCKET, SO_RXQ_OVFL, 1)
        link.setsockopt(socket.SOL_CAN_RAW, socket.CAN_RAW_RECV_OWN_MSGS, self._wants_own())
        link.setsockopt(socket.SOL_CAN_RAW, _CAN_RAW_ERR_FILTER, can_errors.ALL_CLASSES)
        link.setsockopt(socket.SOL_CAN_RAW, socket.CAN_RAW_FILTER, self._filters())
        return link

    def _look(self) -> None:
        """Once a second: how busy the wire is, and whether a controller that was bus-off is back without a word."""
        self._load.sample(self._loop.time())
        if self._controller.bus_off and self._has_carrier():
            self._recover()
        self._timer = self._loop.call_later(LOOK_S, self._look)

    def _has_carrier(self) -> bool:
        try:
            return (NETWORK_DEVICES / self.name / "carrier").read_text().strip() == "1"
        except OSError:
            return False

    def _disconnect(self) -> None:
        self._queue.close()
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        if self._link is not None:
            self._loop.remove_reader(self._link.fileno())
            self._link.close()
            self._link = None

    def _lose(self, error: OSError) -> None:
        self._disconnect()
        LOGGER.error("%s", self._bus_off(error))
        self._timer = self._loop.call_later(self._reopen_s, self._reopen)

    def _reopen(self) -> None:
        self._reopen_s = min(2.0 * self._reopen_s, LAST_REOPEN_S)
        cause = self.down
        try:
            self._connect()
        except BusOff as error:
            if self.down != cause:
                LOGGER.error("%s", error)
            self._timer = self._loop.call_later(self._reopen_s, self._reopen)
        else:
            LOGGER.info("%s is back", self.name)

    def _bus_off(self, error: OSError) -> BusOff:
        self.down = error.strerror or str(error)
        self._no_can = error.errno == errno.EAFNOSUPPORT
        return BusOff(f"socketcan interface {self.name} is down or missing: {error}", remedy=self.remedy())

    def remedy(self) -> str:
        """What mends an interface that is down, missing or bus-off, or a kernel without any."""
        if self._no_can:
            return NO_KERNEL_CAN
        if self._controller.bus_off:
            return self._controller.remedy()
        if self.name.startswith("vcan"):
            return f"sudo ip link add dev {self.name} type vcan; sudo ip link set {self.name} up"
        set_up = f"{self.name} up type can bitrate {self.bit_rate} restart-ms 100"
        return f"sudo ip link set {self.name} down; sudo ip link set {set_up}"
