"""A serial device on the running loop: raw bytes through a file descriptor, without a thread."""

from __future__ import annotations

import asyncio
import contextlib
import errno
import fcntl
import os
import stat
import termios
import tty
from collections.abc import Callable
from pathlib import Path

from canhelm.errors import BusOff, UsageError

BAUD_RATES = {rate: getattr(termios, f"B{rate}") for rate in (9600, 19200, 38400, 57600, 115200)}
"""Rates of object 0x2002 that a terminal has, too; 14400 bit/s it has not."""
DEVICES = Path("/sys/dev/char")
"""Where the kernel tells what kind of device a number is; pseudo terminals are not listed."""
_READ_SIZE = 4096
_IFLAG, _CFLAG, _ISPEED, _OSPEED = 0, 2, 4, 5


def require_serial_device(path: str) -> None:
    """Raise UsageError for what can never be a serial line; a device that is missing may still be plugged in."""
    remedy = "give the path of a serial device, as rs232:/dev/ttyUSB0"
    try:
        found = os.stat(path)
    except OSError:
        if "/" in path:
            return
        remedy += "; `canhelm simulate --bus rs232:pty` prints that of a simulated one"
        raise UsageError(f"{path!r} is no path of a device", value=path, remedy=remedy) from None
    kind = DEVICES / f"{os.major(found.st_rdev)}:{os.minor(found.st_rdev)}" / "subsystem"
    if not stat.S_ISCHR(found.st_mode) or (kind.exists() and kind.resolve().name != "tty"):
        raise UsageError(f"{path} is no serial device", value=path, remedy=remedy)


class SerialTty:
    """One terminal device or pseudo terminal.

    Args:
        device: its path.
        baud: bit/s.

    Attributes:
        host: takes what comes and the loop time at which it did.
        on_lost: called once, with the reason, when the device vanishes.
    """

    def __init__(self, device: str, baud: int) -> None:
        if baud not in BAUD_RATES:
            known = ", ".join(str(rate) for rate in BAUD_RATES)
            raise UsageError(f"a serial line has no {baud} bit/s", value=baud, remedy=f"give one of {known}")
        self.device = device
        self.baud = baud
        self.host: Callable[[bytes, float], None] | None = None
        self.on_lost: Callable[[str], None] | None = None
        self._fd = -1
        self._unsent = b""

    def open(self) -> None:
        """Open the device on the running loop: 8N1, raw, no flow control; what it had received is thrown away.

        Raises:
            BusOff: there is no such device, it is no terminal, or this user may not open it.
        """
        self._loop = asyncio.get_running_loop()
        try:
            self._fd = os.open(self.device, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK | os.O_CLOEXEC)
            self._set_up()
        except (OSError, termios.error) as error:
            self.close()
            raise BusOff(
                f"cannot open serial device {self.device}: {error.args[-1]}",
                remedy="is the adapter plugged in, and may this user open it (group dialout)?",
            ) from error
        self._loop.add_reader(self._fd, self._on_readable)

    def _set_up(self) -> None:
        try:
            fcntl.flock(self._fd, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise OSError(errno.EBUSY, "another program uses it") from None
        tty.setraw(self._fd, termios.TCSANOW)
        settings = termios.tcgetattr(self._fd)
        settings[_IFLAG] &= ~(termios.IXOFF | termios.IXANY)
        settings[_CFLAG] &= ~(termios.CSTOPB | termios.CRTSCTS)
        settings[_CFLAG] |= termios.CLOCAL | termios.CREAD
        settings[_ISPEED] = settings[_OSPEED] = BAUD_RATES[self.baud]
        termios.tcsetattr(self._fd, termios.TCSANOW, settings)
        termios.tcflush(self._fd, termios.TCIOFLUSH)
        with contextlib.suppress(OSError):
            _hurry(self._fd)

    def close(self) -> None:
        """Close the device; no effect on one that is closed."""
        if self._fd >= 0:
            self._loop.remove_reader(self._fd)
            self._loop.remove_writer(self._fd)
            os.close(self._fd)
            self._fd = -1
        self._unsent = b""

    def write(self, data: bytes) -> None:
        """Send bytes; what the device has no room for is sent as soon as it has. Closed: they are lost."""
        if self._fd < 0:
            return
        waiting, self._unsent = bool(self._unsent), self._unsent + data
        if not waiting:
            self._send_unsent()

    def _send_unsent(self) -> None:
        try:
            self._unsent = self._unsent[os.write(self._fd, self._unsent) :]
        except BlockingIOError:
            pass
        except OSError as error:
            self._lose(error)
            return
        if self._unsent:
            self._loop.add_writer(self._fd, self._send_unsent)
        else:
            self._loop.remove_writer(self._fd)

    def _on_readable(self) -> None:
        try:
            data = os.read(self._fd, _READ_SIZE)
        except BlockingIOError:
            return
        except OSError as error:
            self._lose(error)
            return
        if not data:
            self._lose(OSError(errno.EIO, "the line was hung up"))
        elif self.host is not None:
            self.host(data, self._loop.time())

    def _lose(self, error: OSError) -> None:
        """Tell the owner on the loop's next turn: whoever is writing just now does not expect to hear of it."""
        self.close()
        if self.on_lost is not None:
            on_lost, self.on_lost = self.on_lost, None
            self._loop.call_soon(on_lost, error.strerror or str(error))


_TIOCGSERIAL, _TIOCSSERIAL = 0x541E, 0x541F  # linux/tty.h: struct serial_struct, its flags are the fifth int
_FLAGS = slice(16, 20)
_ASYNC_LOW_LATENCY = 1 << 13


def _hurry(fd: int) -> None:
    """Let the adapter hand over each byte at once; adapters on USB collect them for 16 ms. Raises OSError where not."""
    settings = bytearray(128)
    fcntl.ioctl(fd, _TIOCGSERIAL, settings)
    settings[_FLAGS] = (int.from_bytes(settings[_FLAGS], "little") | _ASYNC_LOW_LATENCY).to_bytes(4, "little")
    fcntl.ioctl(fd, _TIOCSSERIAL, settings)
