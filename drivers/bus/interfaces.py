"""The CAN interface that a specification names: the kernel's by its socket, all others through python-can."""

from __future__ import annotations

from canhelm.errors import UsageError
from drivers.bus.contract import Bus
from drivers.bus.socketcan import SocketCanBus

KERNEL = "socketcan"
FORMS = "give INTERFACE:CHANNEL, such as socketcan:can0; rs232:/dev/ttyS0@115200 for a serial line; or simulated"


def open_bus(spec: str, bit_rate: int) -> Bus:
    """The bus that a specification names; it is opened by its :meth:`~drivers.bus.contract.Bus.open`.

    Args:
        spec: ``INTERFACE:CHANNEL``, for instance ``socketcan:can0`` or ``slcan:/dev/ttyUSB0``.
        bit_rate: bit/s; interfaces that the system configures (SocketCAN) keep theirs.

    Raises:
        UsageError: the specification is not of that form, or there is no such interface.
    """
    interface, colon, channel = spec.partition(":")
    if not (interface and colon and channel):
        raise UsageError(f"{spec!r} names no bus", value=spec, remedy=FORMS)
    if interface == KERNEL:
        return SocketCanBus(channel, bit_rate)
    from drivers.bus.python_can import python_can_bus  # here, so that SocketCAN does not wait for python-can

    return python_can_bus(interface, channel, bit_rate)
