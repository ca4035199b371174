"""Any interface that python-can knows, on the running loop: slcan, vendor adapters.

Frames come through a file descriptor on the loop where the interface has one, else through one reader thread. Frames
that the interface has no room for wait here, most urgent first, until they fit or their deadline passes. An interface
that goes down is opened again as soon as it is back.
"""

from __future__ import annotations

import asyncio
import contextlib
import errno
import importlib.util
import logging
import math
import sys
import threading
import time
from pathlib import PurePath
from typing import Any

import can

from canhelm.errors import BusOff, UsageError
from drivers.bus.contract import ID_MASK, RTR_FLAG, Bus
from drivers.bus.controller import BUS_OFF_CAUSES
from drivers.bus.transmit_queue import TransmitQueue
from drivers.bus.wire_time import LoadMeter, frame_bits

LOGGER = logging.getLogger("canhelm.bus")

MAX_BYTES = 8
REOPEN_S = 1.0
READER_TIMEOUT_S = 0.1
SEND_TIMEOUT_S = 0.01
"""Longest time that an adapter may hold up the loop."""
OPTIONS: dict[str, dict[str, Any]] = {"slcan": {"timeout": 0.0}}
"""What interfaces need beside channel and bit rate: a serial port that does not wait for the next byte."""

NO_CAN_INTERFACES = ("rs232", "simulated")
"""What may be named in place of an interface, and is none of python-can's."""

_GONE = {errno.ENETDOWN, errno.ENODEV, errno.ENXIO, errno.EIO, errno.EBADF}
_ERROR_CLASS_BUS_OFF = 0x40  # linux/can/error.h


def python_can_bus(interface: str, channel: str, bit_rate: int) -> PythonCanBus:
    """The bus of one of python-can's interfaces. Raises UsageError where it has none such, or a package is missing."""
    if interface not in can.VALID_INTERFACES:
        known = sorted({*can.VALID_INTERFACES, *NO_CAN_INTERFACES})
        small = interface.lower()
        remedy = f"write {small}" if small in known else f"use one of {', '.join(known)}"
        raise UsageError(f"there is no CAN interface {interface!r}", value=interface, remedy=remedy)
    if interface == "slcan" and importlib.util.find_spec("serial") is None:
        install = f"{sys.executable} -m pip install 'canhelm[slcan]'"
        raise UsageError("the package pyserial is missing, which slcan needs", value=interface, remedy=install)
    return PythonCanBus(interface, channel, bit_rate)


class PythonCanBus(Bus):
    """One interface of python-can.

    Attributes:
        interface: python-can's name of the kind of interface.
        channel: which one.
        foreign: frames that are no classic base frames, and garbage of the adapter.
    """

    def __init__(self, interface: str, channel: str, bit_rate: int) -> None:
        super().__init__(PurePath(channel).name, bit_rate)
        self.interface = interface
        self.channel = channel
        self.foreign = 0
        self._queue = TransmitQueue(self._transmit, self.counters)
        self._meter = LoadMeter(bit_rate)
        self._link: can.BusABC | None = None
        self._fd: int | None = None
        self._reader: threading.Thread | None = None
        self._reopening: asyncio.Task[None] | None = None

    async def open(self) -> None:
        """Open the interface on the running loop. Raises BusOff where it is down or missing."""
        self._loop = asyncio.get_running_loop()
        await self._connect()

    async def close(self) -> None:
        """Close the interface; what is still queued is dropped."""
        if self._reopening is not None:
            self._reopening.cancel()
            self._reopening = None
        link = self._disconnect()
        if link is not None:
            await asyncio.to_thread(self._shut_down, link)

    def load(self) -> float:
        """Share of the last second that the frames seen here kept the wire busy, 0 to 1."""
        return self._meter.load(self._loop.time())

    def details(self) -> dict[str, Any]:
        """What is wrong with the interface, if anything is."""
        trouble = {"down": self.down, "remedy": self.remedy()} if self.down else {}
        return {**trouble, "foreign": self.foreign}

    def send(self, can_id: int, data: bytes = b"", deadline_s: float = math.inf) -> None:
        """Send one frame or queue it; see :meth:`Bus.send`. Raises ValueError for what no base frame can be."""
        frame_bits(can_id, data)
        self._queue.send(can_id, data, deadline_s)

    def _transmit(self, can_id: int, data: bytes) -> bool:
        """Hand a frame to the interface; False where it has no room for it or is gone."""
        if self._link is None:
            return False
        remote = bool(can_id & RTR_FLAG)
        message = can.Message(
            arbitration_id=can_id & ID_MASK, is_extended_id=False, is_remote_frame=remote, data=None if remote else data
        )
        try:
            self._link.send(message, timeout=SEND_TIMEOUT_S)
        except (can.CanError, OSError) as error:
            if _error_number(error) in _GONE:
                self._lose(error)
            return False
        self.counters.sent += 1
        self._show(can_id, data, self._loop.time())
        return True

    def _on_readable(self) -> None:
        try:
            self._receive_all()
        except (can.CanError, OSError) as error:
            self._lose(error)

    def _receive_all(self) -> None:
        while self._link is not None:
            try:
                message = self._link.recv(0)
            except (ValueError, IndexError) as error:  # an adapter's line that is none
                self.foreign += 1
                if isinstance(error, UnicodeDecodeError):
                    self._forget_line()
                continue
            if message is None:
                return
            self._take(message)

    def _forget_line(self) -> None:
        """Drop what an adapter has said so far; slcan of python-can would fail on it again with every further line."""
        flush = getattr(self._link, "flush", None)
        if flush is not None:
            flush()

    def _read_until_closed(self, link: can.BusABC) -> None:
        """The reader thread of an interface without a file descriptor."""
        while self._link is link:
            try:
                message = link.recv(READER_TIMEOUT_S)
            except (can.CanError, OSError) as error:
                if self._link is link:
                    self._loop.call_soon_threadsafe(self._lose, error)
                return
            if message is not None:
                self._loop.call_soon_threadsafe(self._take, message)

    def _take(self, message: can.Message) -> None:
        if self._link is None:
            return  # read just before the interface was closed
        if message.is_error_frame:
            self._take_error(message)
        elif message.is_extended_id or message.is_fd or len(message.data) > MAX_BYTES:
            self.foreign += 1
        else:
            remote = message.is_remote_frame
            can_id = message.arbitration_id | RTR_FLAG if remote else message.arbitration_id
            data = b"" if remote else bytes(message.data)
            stamp = self._loop_time(message.timestamp)
            self.down = None
            self.counters.received += 1
            self._show(can_id, data, stamp)
            if self.receiver is not None:
                self.receiver(can_id, data, stamp)

    def _take_error(self, message: can.Message) -> None:
        self.counters.error_frames += 1
        if message.arbitration_id & _ERROR_CLASS_BUS_OFF and self.down is None:
            self.down = "bus-off"
            LOGGER.error("%s is bus-off (%s; %s)", self.name, BUS_OFF_CAUSES, self.remedy())

    def _loop_time(self, wall_s: float) -> float:
        """The loop's time of a wall-clock stamp less than a second old; now for interfaces with clocks of their own."""
        now = self._loop.time()
        age_s = time.time() - wall_s
        return now - age_s if 0.0 <= age_s < 1.0 else now

    def _show(self, can_id: int, data: bytes, stamp: float) -> None:
        self._meter.add(stamp, frame_bits(can_id, data))
        for tap in tuple(self.taps):
            tap(can_id, data, stamp)

    async def _connect(self) -> None:
        try:
            link = await asyncio.to_thread(self._open_link)
        except (can.CanError, OSError, ValueError) as error:
            raise self._bus_off(error) from error
        self._link = link
        self._queue.open()
        try:
            self._listen(link)
        except (can.CanError, OSError) as error:
            self._disconnect()
            await asyncio.to_thread(self._shut_down, link)
            raise self._bus_off(error) from error
        self.down = None

    def _open_link(self) -> can.BusABC:
        options = OPTIONS.get(self.interface, {})
        return can.Bus(
            channel=self.channel, interface=self.interface, bitrate=self.bit_rate, ignore_config=True, **options
        )

    def _listen(self, link: can.BusABC) -> None:
        """Begin to receive; an interface that is down says so at the first reading."""
        self._fd = _descriptor_of(link)
        if self._fd is None:
            self._reader = threading.Thread(target=self._read_until_closed, args=(link,), daemon=True, name=self.name)
            self._reader.start()
        else:
            self._receive_all()
            self._loop.add_reader(self._fd, self._on_readable)

    def _disconnect(self) -> can.BusABC | None:
        """Stop sending and receiving; the link that is to be shut down."""
        link, self._link = self._link, None
        if self._fd is not None:
            self._loop.remove_reader(self._fd)
            self._fd = None
        self._queue.close()
        return link

    def _shut_down(self, link: can.BusABC) -> None:
        """In a thread of its own: wait for the reader, then close, which talks to a serial adapter."""
        if self._reader is not None:
            self._reader.join()
            self._reader = None
        with contextlib.suppress(can.CanError, OSError):
            link.shutdown()

    def _lose(self, error: Exception) -> None:
        link = self._disconnect()
        if link is not None:
            self.down = str(error)
            LOGGER.error("%s", self._bus_off(error))
            self._reopening = self._loop.create_task(self._reopen(link))

    async def _reopen(self, link: can.BusABC) -> None:
        await asyncio.to_thread(self._shut_down, link)
        while self._link is None:
            await asyncio.sleep(REOPEN_S)
            with contextlib.suppress(BusOff):
                await self._connect()
        LOGGER.info("%s is back", self.name)

    def _bus_off(self, error: Exception) -> BusOff:
        return BusOff(f"{self.interface} interface {self.channel} is down or missing: {error}", remedy=self.remedy())

    def remedy(self) -> str:
        """What to look at where the adapter does not work."""
        return "is the adapter plugged in, may this user open it, and are its driver and python-can extra installed?"


def _descriptor_of(link: can.BusABC) -> int | None:
    """The file descriptor that tells when a link can be read; None where a thread has to wait for it.

    That there is none python-can says by an error alone (``BusABC.fileno``): adapters that are asked through a maker's
    library, and slcan over ``rfc2217://``.
    """
    try:
        return link.fileno()
    except NotImplementedError:  # python-can's only way to say so: BusABC.fileno as it stands, or slcan's own
        return None


def _error_number(error: Exception) -> int | None:
    number = error.error_code if isinstance(error, can.CanError) else getattr(error, "errno", None)
    return number if isinstance(number, int) else None
