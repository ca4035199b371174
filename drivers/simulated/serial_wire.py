"""A simulated RS-232 cable: the time that bytes take on it, what noise does to them, and the device that a host opens.

A byte is a start bit, eight data bits and a stop bit. As on the simulated CAN bus, everything carries the time at which
its last bit has passed: virtual time delivers it then, and a real loop that wakes up late makes up for it, because an
answer counts from the stamp of what it answers.
"""

from __future__ import annotations

import asyncio
import os
import termios
import tty
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from random import Random

BITS_PER_BYTE = 10
READ_SIZE = 4096
_INPUT_SPEED, _OUTPUT_SPEED = 4, 5
"""Places in the settings of a terminal (termios.tcgetattr)."""

Receiver = Callable[[bytes, float], None]
"""Takes bytes and the time at which the last of them ended."""


@dataclass(frozen=True, slots=True)
class SerialNoise:
    """What happens to the bytes on a bad line; shares are 0 to 1 and independent of each other.

    Attributes:
        lose: share that does not arrive.
        flip: share with one wrong bit.
        duplicate: share that arrives twice.
        delay: share before which the line pauses.
        longest_delay_s: pauses are evenly spread up to this.
    """

    lose: float = 0.0
    flip: float = 0.0
    duplicate: float = 0.0
    delay: float = 0.0
    longest_delay_s: float = 0.02


QUIET = SerialNoise()


class SerialWire:
    """One direction of the cable.

    Args:
        baud: bit/s.
        deliver: gets what arrives.
        noise: what happens to the bytes.
        random: decides to which ones.

    Attributes:
        sent: bytes sent.
        disturbed: bytes that noise lost, changed, doubled or delayed.
        noise: as given; another one may be set at any time.
    """

    def __init__(self, baud: int, deliver: Receiver, noise: SerialNoise, random: Random) -> None:
        self.sent = 0
        self.disturbed = 0
        self._byte_s = BITS_PER_BYTE / baud
        self._deliver = deliver
        self.noise = noise
        self._random = random
        self._free_s = 0.0
        self._queue: deque[tuple[float, bytes]] = deque()
        self._timer: asyncio.TimerHandle | None = None

    def send(self, data: bytes, at_s: float) -> float:
        """Send bytes without a gap, from ``at_s`` or as soon as the wire is free; the time at which the last ends."""
        self.sent += len(data)
        self._free_s = max(at_s, self._free_s)
        if self.noise == QUIET:
            self._put(data, len(data))
        else:
            for byte in data:
                self._send_disturbed(byte)
        return self._free_s

    def _put(self, data: bytes, duration: int) -> None:
        """Let ``data`` arrive after the time of ``duration`` bytes."""
        self._free_s += duration * self._byte_s
        self._queue.append((self._free_s, data))
        if self._timer is None:
            self._timer = asyncio.get_running_loop().call_at(self._queue[0][0], self._on_end)

    def _send_disturbed(self, byte: int) -> None:
        noise, happens = self.noise, self._random.random
        lost, flipped = happens() < noise.lose, happens() < noise.flip
        doubled, delayed = happens() < noise.duplicate, happens() < noise.delay
        self.disturbed += lost or flipped or doubled or delayed
        if delayed:
            self._free_s += happens() * noise.longest_delay_s
        if flipped:
            byte ^= 1 << self._random.randrange(8)
        for _ in range(1 + doubled):
            self._put(b"" if lost else bytes((byte,)), 1)

    def _on_end(self) -> None:
        queue, loop = self._queue, asyncio.get_running_loop()
        now_s = max(loop.time(), queue[0][0])
        while queue and queue[0][0] <= now_s:
            end_s, data = queue.popleft()
            if data:
                self._deliver(data, end_s)
        self._timer = loop.call_at(queue[0][0], self._on_end) if queue else None

    def clear(self) -> None:
        """Lose everything that has not arrived yet."""
        self._queue.clear()
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None


class SerialCable:
    """The cable between a host in this process and a simulated drive.

    Args:
        baud: bit/s.
        device: gets what the host writes.
        noise: what happens to the bytes, both ways.
        seed: of the noise.

    Attributes:
        baud: bit/s.
        host: gets what the drive sends; set by the host.
        to_host, to_device: its two directions.
        pulled: set it to True to pull the cable: bytes are lost both ways.
    """

    def __init__(self, baud: int, device: Receiver, noise: SerialNoise = QUIET, seed: int = 0) -> None:
        random = Random(seed)
        self.baud = baud
        self.host: Receiver | None = None
        self.pulled = False
        self._device = device
        self.to_host = SerialWire(baud, self._to_host, noise, random)
        self.to_device = SerialWire(baud, self._to_device, noise, random)

    def write(self, data: bytes) -> None:
        """Send bytes of the host, from now on."""
        self.to_device.send(data, asyncio.get_running_loop().time())

    def _to_device(self, data: bytes, end_s: float) -> None:
        if not self.pulled:
            self._device(data, end_s)

    def _to_host(self, data: bytes, end_s: float) -> None:
        if self.host is not None and not self.pulled:
            self.host(data, end_s)


class SerialPty:
    """The host's end of a cable as a pseudo terminal that any program can open like a serial port.

    It has the cable's baud rate at first. Where a host sets another one, both sides get garbage, as on a real line.

    Args:
        cable: the cable; this becomes its host.

    Attributes:
        device: path of the terminal.
        lost: bytes for which the terminal had no room, because no host reads them.
    """

    def __init__(self, cable: SerialCable) -> None:
        self._cable = cable
        self._near, self._far = os.openpty()  # the far end stays open here, so that hosts may come and go
        tty.setraw(self._far)
        self._speed = getattr(termios, f"B{cable.baud}", None)  # terminals have no 14400 bit/s
        self._set_speed()
        self._garbage = Random(cable.baud)
        os.set_blocking(self._near, False)
        self.device = os.ttyname(self._far)
        self.lost = 0
        cable.host = self._to_host
        asyncio.get_running_loop().add_reader(self._near, self._on_readable)

    def _set_speed(self) -> None:
        if self._speed is not None:
            settings = termios.tcgetattr(self._far)
            settings[_INPUT_SPEED] = settings[_OUTPUT_SPEED] = self._speed
            termios.tcsetattr(self._far, termios.TCSANOW, settings)

    def _as_heard(self, data: bytes) -> bytes:
        """What the other side makes of these bytes at its own baud rate."""
        agreed = self._speed in (None, termios.tcgetattr(self._far)[_OUTPUT_SPEED])
        return data if agreed else self._garbage.randbytes(len(data))

    def _on_readable(self) -> None:
        self._cable.write(self._as_heard(os.read(self._near, READ_SIZE)))

    def _to_host(self, data: bytes, _: float) -> None:
        try:
            self.lost += len(data) - os.write(self._near, self._as_heard(data))
        except BlockingIOError:
            self.lost += len(data)

    def close(self) -> None:
        """Pull the cable out of the host: whoever has the terminal open is hung up on, and its path vanishes."""
        self._cable.host = None
        asyncio.get_running_loop().remove_reader(self._near)
        for fd in (self._near, self._far):
            os.close(fd)
