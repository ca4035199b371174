"""A socket pair in the place of the kernel's CAN: one end for a bus, the other for the simulated side."""

from __future__ import annotations

import socket
from typing import Any

_OWN = int(socket.MSG_DONTROUTE) | 0x800
"""Flags of a frame that this very socket has sent; the second one is MSG_CONFIRM."""
_MARK_AT, _MARK = 5, b"\1"
"""Padding of ``struct can_frame`` that marks a frame which is handed back to its sender."""


class Link(socket.socket):
    """One end, which does what a raw CAN socket does: where that is asked for, it hands own frames back.

    Args:
        end: of the pair; it is taken over.
        far: the other end, through which own frames come back.
    """

    def __init__(self, end: socket.socket, far: socket.socket) -> None:
        super().__init__(end.family, end.type, fileno=end.detach())
        self._far = far
        self._hand_back(False)

    def bind(self, address: Any) -> None:
        """Nothing: it is bound to the other end."""

    def setsockopt(self, level: int, option: int, value: Any) -> None:  # type: ignore[override]
        """Filters are of no use where every frame is for the one at this end."""
        if level != socket.SOL_CAN_RAW:
            super().setsockopt(level, option, value)
        elif option == socket.CAN_RAW_RECV_OWN_MSGS:
            self._hand_back(bool(value))

    def _hand_back(self, wanted: bool) -> None:
        """Where no own frames are wanted nothing of this class costs any time, as the kernel's own socket does not."""
        self.send = self._send_and_hand_back if wanted else super().send  # type: ignore[assignment]
        self.recvmsg = self._receive_flagged if wanted else super().recvmsg  # type: ignore[assignment]

    def _send_and_hand_back(self, data: bytes) -> int:
        self._far.send(data[:_MARK_AT] + _MARK + data[_MARK_AT + 1 :])
        return super().send(data)

    def _receive_flagged(self, size: int, ancillary_size: int) -> Any:
        """A frame, with the flags that the kernel sets at an own one."""
        data, ancillary, flags, address = super().recvmsg(size, ancillary_size)
        return data, ancillary, flags | _OWN if data[_MARK_AT] else flags, address


def make_pair() -> tuple[socket.socket, socket.socket]:
    """Both ends of a pair that keeps the borders of frames."""
    return socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
