"""A frame that the kernel sends by itself, again and again: SocketCAN's broadcast manager (linux/can/bcm.h).

Its timer keeps the period while Python is busy. It ends after a number of frames that is renewed, so that a program
which hangs does not go on sending for ever, and with the socket, so that a program which dies sends nothing more.
"""

from __future__ import annotations

import contextlib
import socket
import struct

from drivers.bus.socketcan_frames import make_frame

_TX_SETUP = 1
_TX_DELETE = 2
_SET_TIMER = 1
_START_TIMER = 2
_HEAD = struct.Struct("@3I4l2I")
"""``struct bcm_msg_head``: opcode, flags, count, two intervals in s and µs, identifier, number of frames."""
_ALIGNMENT = 8
"""The frames after the head begin at a multiple of it."""


def make_setup(flags: int, can_id: int, data: bytes, period_s: float, count: int) -> bytes:
    """TX_SETUP: send a frame ``count`` times with a period in s, in whole µs."""
    seconds, microseconds = divmod(round(period_s * 1e6), 1_000_000)
    return _head(_TX_SETUP, flags, count, seconds, microseconds, can_id, 1) + make_frame(can_id, data)


def make_delete(can_id: int) -> bytes:
    """TX_DELETE: send that frame no more."""
    return _head(_TX_DELETE, 0, 0, 0, 0, can_id, 0)


def _head(opcode: int, flags: int, count: int, seconds: int, microseconds: int, can_id: int, frames: int) -> bytes:
    head = _HEAD.pack(opcode, flags, count, seconds, microseconds, 0, 0, can_id, frames)
    return head + bytes(-len(head) % _ALIGNMENT)


def kernel_repeats() -> bool:
    """Whether this kernel has a broadcast manager."""
    try:
        socket.socket(socket.AF_CAN, socket.SOCK_DGRAM, socket.CAN_BCM).close()
    except (AttributeError, OSError):
        return False
    return True


class RepeatedFrame:
    """One frame that the kernel repeats on one interface.

    Args:
        channel: name of the interface.
        can_id, data: the frame.
        period_s: its period.
        count: after how many frames it ends unless it is renewed.
    """

    def __init__(self, channel: str, can_id: int, data: bytes, period_s: float, count: int) -> None:
        self._channel = channel
        self._start = make_setup(_SET_TIMER | _START_TIMER, can_id, data, period_s, count)
        self._renewal = make_setup(_SET_TIMER, can_id, data, period_s, count)
        self._delete = make_delete(can_id)
        self._socket: socket.socket | None = None

    def start(self) -> bool:
        """Send the first frame now and the others by the period; False where the kernel cannot at the moment."""
        try:
            self._connected().send(self._start)
        except OSError:  # the interface is gone, or another one has its name now: it is looked up the next time
            self.close()
            return False
        return True

    def renew(self) -> None:
        """Count anew; the period goes on as it is, and what has ended stays ended."""
        self._command(self._renewal)

    def stop(self) -> None:
        """Send no more until the next start."""
        self._command(self._delete)

    def close(self) -> None:
        """Send no more, and let the interface go."""
        if self._socket is not None:
            self._socket.close()
            self._socket = None

    def _connected(self) -> socket.socket:
        if self._socket is None:
            self._socket = socket.socket(socket.AF_CAN, socket.SOCK_DGRAM, socket.CAN_BCM)
            self._socket.setblocking(False)
            self._socket.connect((self._channel,))
        return self._socket

    def _command(self, message: bytes) -> None:
        if self._socket is not None:
            with contextlib.suppress(OSError):  # the interface is gone, and with it what was to be repeated
                self._socket.send(message)
