"""What the kernel tells of a CAN interface: bit rate, state of its controller, restart delay.

Sources: netlink(7), rtnetlink(7); linux/if_link.h, linux/can/netlink.h.
"""

from __future__ import annotations

import socket
import struct
from dataclasses import dataclass

_HEADER = struct.Struct("=IHHII")
_INTERFACE = struct.Struct("=BxHiII")
_ATTRIBUTE = struct.Struct("=HH")
_U32 = struct.Struct("=I")
_NEW_LINK, _GET_LINK = 16, 18
_REQUEST = 1
_NAME, _LINK_INFO, _INFO_DATA = 3, 18, 2
_BIT_TIMING, _STATE, _RESTART_MS = 1, 4, 6
_TYPE_MASK = 0x3FFF
IS_BUS_OFF = "BUS-OFF"
_STATES = ("ERROR-ACTIVE", "ERROR-WARNING", "ERROR-PASSIVE", IS_BUS_OFF, "STOPPED", "SLEEPING")
_LONGEST_BYTES = 65536
_ANSWER_S = 1.0


@dataclass(frozen=True, slots=True)
class CanLink:
    """One interface; what it does not have, such as a virtual one, is None.

    Attributes:
        bit_rate: bit/s.
        state: of its controller, as ``ip`` calls it.
        restart_ms: time until the kernel restarts a controller that is bus-off; 0 for never.
    """

    bit_rate: int | None = None
    state: str | None = None
    restart_ms: int | None = None


def read_link(name: str) -> CanLink:
    """Ask the kernel for an interface; nothing is known of one that is not there, or where nobody may ask."""
    try:
        with socket.socket(socket.AF_NETLINK, socket.SOCK_RAW, socket.NETLINK_ROUTE) as kernel:
            kernel.settimeout(_ANSWER_S)
            kernel.send(make_get_link(name))
            return parse_link(kernel.recv(_LONGEST_BYTES))
    except OSError:
        return CanLink()


def make_get_link(name: str) -> bytes:
    """The request for an interface by its name (RTM_GETLINK)."""
    text = name.encode() + b"\0"
    attribute = _ATTRIBUTE.pack(_ATTRIBUTE.size + len(text), _NAME) + text + bytes(-len(text) % 4)
    body = _INTERFACE.pack(0, 0, 0, 0, 0) + attribute
    return _HEADER.pack(_HEADER.size + len(body), _GET_LINK, _REQUEST, 1, 0) + body


def parse_link(message: bytes) -> CanLink:
    """The answer to :func:`make_get_link`; nothing is known after any other message."""
    if len(message) < _HEADER.size or _HEADER.unpack_from(message)[1] != _NEW_LINK:
        return CanLink()
    link = _attributes(message[_HEADER.size + _INTERFACE.size :])
    controller = _attributes(_attributes(link.get(_LINK_INFO, b"")).get(_INFO_DATA, b""))
    state = _number(controller, _STATE)
    return CanLink(
        bit_rate=_number(controller, _BIT_TIMING),
        state=_STATES[state] if state is not None and state < len(_STATES) else None,
        restart_ms=_number(controller, _RESTART_MS),
    )


def _attributes(data: bytes) -> dict[int, bytes]:
    """The attributes in a row, by type."""
    found: dict[int, bytes] = {}
    while len(data) >= _ATTRIBUTE.size:
        length, kind = _ATTRIBUTE.unpack_from(data)
        if length < _ATTRIBUTE.size:
            break
        found[kind & _TYPE_MASK] = data[_ATTRIBUTE.size : length]
        data = data[length + -length % 4 :]
    return found


def _number(attributes: dict[int, bytes], kind: int) -> int | None:
    """An attribute that begins with a number of 32 bits; the bit rate is the first of the bit timing."""
    value = attributes.get(kind, b"")
    return int(_U32.unpack_from(value)[0]) if len(value) >= _U32.size else None
