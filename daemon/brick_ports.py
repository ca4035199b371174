"""How a brick is reached: ``serial:/dev/rfcomm0`` for Bluetooth (or any terminal), ``usb`` for the cable."""

from __future__ import annotations

from functools import partial
from typing import Final

from canhelm.errors import BusOff, UsageError
from drivers.devices import Connect
from drivers.epos.serial_tty import SerialTty, require_serial_device
from drivers.nxt.brick import OnLost
from drivers.nxt.line import Port

SERIAL: Final = "serial:"
USB: Final = "usb"
BAUD: Final = 115200
"""A terminal wants a rate; Bluetooth does not care which."""


def is_brick_port(spec: str) -> bool:
    """Whether a text names a way to a brick."""
    return spec == USB or spec.startswith(SERIAL)


def brick_port(spec: str) -> Connect:
    """What opens the port that a text names; it raises BusOff where there is none to be had.

    Args:
        spec: ``serial:DEVICE`` or ``usb``.

    Raises:
        UsageError: it means nothing.
    """
    if spec == USB:
        return _open_usb
    device = spec.removeprefix(SERIAL)
    if not (spec.startswith(SERIAL) and device):
        remedy = f"give {SERIAL}/dev/rfcomm0, or {USB}"
        raise UsageError(f"{spec!r} is no way to an NXT brick", value=spec, remedy=remedy)
    require_serial_device(device)
    return partial(open_terminal, device)


def open_terminal(device: str, on_lost: OnLost) -> Port:
    """A brick on a terminal. Raises BusOff."""
    port = SerialTty(device, BAUD)
    port.on_lost = on_lost
    port.open()
    return port


def _open_usb(on_lost: OnLost) -> Port:
    try:
        from drivers.nxt.usb_port import UsbPort
    except ImportError as error:
        raise BusOff("pyusb is missing, the way to a brick over USB", remedy="pip install 'canhelm[usb]'") from error
    return UsbPort(on_lost)
