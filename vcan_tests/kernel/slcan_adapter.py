"""A CAN adapter on a pseudo-terminal, for the kernel's slcan driver: the interface made of it has a true error state.

The test decides what the adapter reports (Lawicel's ASCII protocol with the kernel's additions: Linux,
drivers/net/can/slcan/slcan-core.c). The frames can be carried on to another CAN interface, so that a robot simulated
there stands behind this one.
"""

from __future__ import annotations

import fcntl
import os
import select
import socket
import struct
import subprocess
import threading
from contextlib import ExitStack
from types import TracebackType

N_SLCAN = 17
SIOCGIFNAME = 0x8910
TIOCSETD = 0x5423
CAN_FRAME = struct.Struct("=IB3x8s")


class SlcanAdapter:
    """An adapter, plugged in while the ``with`` block lasts.

    Args:
        interface: The network interface that the kernel is to make of it.
        bit_rate: In bit/s, one of those that Lawicel's protocol has: 10_000 to 1_000_000.
        carries_to: A CAN interface that stands for what is wired to the adapter; frames go both ways.

    Attributes:
        commands: What the kernel told the adapter to do, such as ``["C", "S4", "O"]``.
        frames: The frames that the kernel sent, as they came (``"t1232AABB"``).
    """

    def __init__(self, interface: str = "can0", *, bit_rate: int = 125_000, carries_to: str | None = None) -> None:
        self.interface = interface
        self.commands: list[str] = []
        self.frames: list[str] = []
        self._bit_rate = bit_rate
        self._wire = _raw_socket(carries_to) if carries_to else None
        self._bus_off = False
        self._adapter, self._tty = os.openpty()
        self._unplugged = threading.Event()
        self._stop_reader, self._stop_writer = os.pipe()
        self._thread = threading.Thread(target=self._carry, name=f"slcan {interface}", daemon=True)

    def __enter__(self) -> SlcanAdapter:
        self._thread.start()
        with ExitStack() as undo:
            undo.callback(self.unplug)
            self._plug_in()
            undo.pop_all()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self.unplug()

    def up(self) -> None:
        """Brings the interface up: the kernel opens the adapter, and the controller is error active again."""
        _ip("link", "set", "dev", self.interface, "txqueuelen", "1000", "up")

    def down(self) -> None:
        """Takes the interface down."""
        _ip("link", "set", "dev", self.interface, "down")

    def unplug(self) -> None:
        """Pulls the adapter out: the interface vanishes."""
        if self._unplugged.is_set():
            return
        self._unplugged.set()
        os.write(self._stop_writer, b".")
        self._thread.join()
        for end in (self._tty, self._adapter, self._stop_reader, self._stop_writer):
            os.close(end)
        if self._wire:
            self._wire.close()

    def report_state(self, state: str, *, rx_errors: int = 0, tx_errors: int = 0) -> None:
        """Reports the controller's error state, one of ``active``, ``warning``, ``passive``, ``bus-off``, and counters.

        A controller that is bus-off neither sends nor receives until the interface has been down.
        """
        letter = {"active": "a", "warning": "w", "passive": "p", "bus-off": "b"}[state]
        self._bus_off = state == "bus-off"
        self._tell(f"s{letter}{rx_errors:03}{tx_errors:03}")

    def report_errors(self, kinds: str) -> None:
        """Reports errors on the wire.

        Args:
            kinds: Letters: ``a`` no acknowledge, ``b`` bit 0, ``B`` bit 1, ``c`` CRC, ``f`` form, ``s`` stuff,
                ``o`` overrun of the receiver, ``O`` of the sender.
        """
        self._tell(f"e{len(kinds)}{kinds}")

    def receive(self, cob_id: int, data: bytes = b"") -> None:
        """Hands the kernel a data frame as if it came from the wire."""
        self._tell(f"t{cob_id:03X}{len(data)}{data.hex().upper()}")

    def _plug_in(self) -> None:
        fcntl.ioctl(self._tty, TIOCSETD, struct.pack("i", N_SLCAN))
        made = fcntl.ioctl(self._tty, SIOCGIFNAME, bytes(16)).rstrip(b"\0").decode()
        if made != self.interface:
            _ip("link", "set", "dev", made, "name", self.interface)
        _ip("link", "set", "dev", self.interface, "type", "can", "bitrate", str(self._bit_rate))
        self.up()

    def _tell(self, line: str) -> None:
        os.write(self._adapter, line.encode() + b"\r")

    def _carry(self) -> None:
        """The adapter's own life: takes what the kernel says, and carries frames between it and the wire.

        It stands for a device, which waits for no program, so it goes before them.
        """
        os.setpriority(os.PRIO_PROCESS, threading.get_native_id(), -20)
        unfinished = b""
        wire = self._wire.fileno() if self._wire else -1
        sources = [source for source in (self._adapter, self._stop_reader, wire) if source >= 0]
        while True:
            ready, _, _ = select.select(sources, [], [])
            if self._stop_reader in ready:
                return
            if self._wire and wire in ready:
                self._from_wire(self._wire.recv(CAN_FRAME.size))
            if self._adapter in ready:
                *lines, unfinished = (unfinished + os.read(self._adapter, 65536)).split(b"\r")
                for line in lines:
                    self._from_kernel(line.decode())

    def _from_wire(self, frame: bytes) -> None:
        can_id, length, data = CAN_FRAME.unpack(frame)
        if self._bus_off or can_id & (socket.CAN_EFF_FLAG | socket.CAN_ERR_FLAG):
            return
        if can_id & socket.CAN_RTR_FLAG:
            self._tell(f"r{can_id & socket.CAN_SFF_MASK:03X}{length}")
        else:
            self.receive(can_id, data[:length])

    def _from_kernel(self, line: str) -> None:
        if line[:1] not in ("t", "r"):
            self.commands.append(line)
            self._bus_off = self._bus_off and line != "C"
            return
        self.frames.append(line)
        if self._wire and not self._bus_off:
            remote = socket.CAN_RTR_FLAG if line[0] == "r" else 0
            self._wire.send(CAN_FRAME.pack(int(line[1:4], 16) | remote, int(line[4]), bytes.fromhex(line[5:])))


def _raw_socket(interface: str) -> socket.socket:
    wire = socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
    wire.bind((interface,))
    return wire


def _ip(*arguments: str) -> None:
    subprocess.run(["ip", *arguments], check=True)
