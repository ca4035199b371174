"""A brick on a USB cable, by pyusb: the same telegrams as over Bluetooth, without the length before each.

libusb blocks, so one thread does what it is given in order; each telegram that wants a reply is followed by reading it.
Source: LEGO MINDSTORMS NXT Bluetooth Developer Kit, Appendix 1 (vendor and product, 64 bytes a packet).
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import Any, Final

import usb.core
import usb.util

from canhelm.errors import BusOff
from drivers.nxt.codes import NO_REPLY
from drivers.nxt.telegrams import MAX_TELEGRAM, Unframer, make_frame

VENDOR_LEGO: Final = 0x0694
PRODUCT_NXT: Final = 0x0002
TIMEOUT_MS: Final = 1000
_REMEDY: Final = "is the brick switched on, and may this user open it (a udev rule for vendor 0694, product 0002)?"


class UsbPort:
    """The first brick on USB; a :class:`drivers.nxt.line.Port`.

    Args:
        on_lost: called with the reason when the connection vanishes, on the loop that made this.

    Attributes:
        host: takes bytes of the brick, each telegram with its length before it, and the time at which they came.

    Raises:
        BusOff: there is no brick, no libusb, or this user may not open it.
    """

    def __init__(self, on_lost: Callable[[str], None]) -> None:
        self.host: Callable[[bytes, float], None] | None = None
        self._on_lost: Callable[[str], None] | None = on_lost
        self._loop = asyncio.get_running_loop()
        self._unframer = Unframer()
        try:
            self._device = _find()
            self._out, self._in = _endpoints(self._device)
        except (usb.core.USBError, usb.core.NoBackendError) as error:
            raise BusOff(f"cannot open a brick on USB: {error}", remedy=_REMEDY) from error
        self._thread = ThreadPoolExecutor(max_workers=1, thread_name_prefix="nxt usb")

    def write(self, data: bytes) -> None:
        """Send telegrams, each with its length before it; closed, they are lost."""
        if self._on_lost is not None:
            for telegram in self._unframer.feed(data):
                self._thread.submit(self._exchange, telegram)

    def close(self) -> None:
        """Let the brick go when what was written is sent; no effect on one that is closed."""
        if self._on_lost is not None:
            self._on_lost = self.host = None
            self._thread.submit(usb.util.dispose_resources, self._device)
            self._thread.shutdown(wait=False)

    def _exchange(self, telegram: bytes) -> None:
        """On the thread."""
        try:
            self._out.write(telegram, TIMEOUT_MS)
            if not telegram[0] & NO_REPLY:
                reply = bytes(self._in.read(MAX_TELEGRAM, TIMEOUT_MS))
                self._loop.call_soon_threadsafe(self._deliver, make_frame(reply))
        except usb.core.USBError as error:
            self._loop.call_soon_threadsafe(partial(self._lose, error.strerror or str(error)))

    def _deliver(self, frame: bytes) -> None:
        if self.host is not None:
            self.host(frame, self._loop.time())

    def _lose(self, reason: str) -> None:
        on_lost = self._on_lost
        self.close()
        if on_lost is not None:
            on_lost(reason)


def _find() -> Any:
    device = usb.core.find(idVendor=VENDOR_LEGO, idProduct=PRODUCT_NXT)
    if device is None:
        raise BusOff("no brick on USB", remedy="plug it in and switch it on")
    device.set_configuration()
    return device


def _endpoints(device: Any) -> tuple[Any, Any]:
    """The bulk endpoints to the brick and from it."""
    interface = device.get_active_configuration()[(0, 0)]
    found = []
    for direction in (usb.util.ENDPOINT_OUT, usb.util.ENDPOINT_IN):
        match = partial(_goes, direction)
        endpoint = usb.util.find_descriptor(interface, custom_match=match)
        if endpoint is None:
            raise BusOff("the brick on USB has no bulk endpoints", remedy="does it run LEGO's firmware?")
        found.append(endpoint)
    return found[0], found[1]


def _goes(direction: int, endpoint: Any) -> bool:
    return bool(usb.util.endpoint_direction(endpoint.bEndpointAddress) == direction)
