"""A daemon on virtual time, in a thread of its own, for clients that know nothing of it.

Its time stands still while a command thinks, and passes while one waits for an answer; between two commands a person
takes a moment. Each client has one end of a pair of sockets, so that command, client, wire format and connection are
those of a real daemon, and what they print is the same each time.
"""

from __future__ import annotations

import array
import asyncio
import contextlib
import fcntl
import select
import socket
import termios
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

from canhelm import protocol
from daemon.api.connection import Connection
from daemon.api.server import Server
from daemon.app import App
from daemon.runtime.clock import run_virtual
from vcan_tests.robot import Robot

MOMENT_S = 0.5
"""What a person takes between two commands."""
BOOT_S = 20.0
"""How long a robot may take to be ready; one that something is wrong with stays as it is then."""
LOOK_S = 0.01
PATIENCE_S = 60.0
"""Of wall time, until a command's client has gone."""
READING_S = 1.0
"""Of wall time, until a client that listens has read what it was told."""
GLANCE_S = 0.0002
RENEW_S = 0.5
RENEWAL = protocol.make_request(0, "lease.renew", {}).replace(b'"id":0,', b"")


class Wire(asyncio.Transport):
    """The daemon's end of a client's connection."""

    def __init__(self, end: socket.socket) -> None:
        super().__init__({"socket": end})
        self.end = end
        self._closing = False
        self._told = False

    def write(self, data: bytes | bytearray | memoryview) -> None:
        with contextlib.suppress(OSError):
            self.end.sendall(data)
            self._told = True

    def let_read(self) -> None:
        """Wait until the client has read what was written, and let its thread begin to think about it."""
        deadline_s = time.monotonic() + READING_S
        while self._told and time.monotonic() < deadline_s:
            self._told = _unread(self.end) > 0
            select.select([], [], [], GLANCE_S)

    def is_closing(self) -> bool:
        return self._closing

    def close(self) -> None:
        self._closing = True

    abort = close

    def get_write_buffer_size(self) -> int:
        return 0

    def pause_reading(self) -> None:
        """Nothing is read unasked."""

    resume_reading = pause_reading


def _unread(end: socket.socket) -> int:
    """Bytes that the other end has yet to read."""
    count = array.array("i", [0])
    fcntl.ioctl(end, termios.TIOCOUTQ, count)
    return count[0]


class OpenServer(Server):
    """Takes in whoever it is handed; it listens nowhere."""

    def admit(self, connection: Connection) -> None:
        self.connections.add(connection)


class VirtualDaemon:
    """A daemon that lives on virtual time as long as its clients wait.

    Args:
        make_app: makes it, on its loop.
        begin_s: virtual time at which it begins.

    Attributes:
        app: what was made.
        now_s: its time.
    """

    app: App

    def __init__(self, make_app: Callable[[], App], begin_s: float) -> None:
        self._make_app = make_app
        self._begin_s = begin_s
        self.now_s = 0.0
        self._arrived: list[socket.socket] = []
        self._bell, self._waiting = socket.socketpair()
        self._clients: dict[socket.socket, Connection] = {}
        self._wires: list[Wire] = []
        self._ready = threading.Event()
        self._counted = threading.Condition()
        self._count = 0
        self._ended = False
        self._failure: BaseException | None = None
        self._thread = threading.Thread(target=self._live, name="daemon")
        self._thread.start()
        self._ready.wait()

    def connect(self, timeout_s: float) -> socket.socket:
        """A client's end."""
        theirs, ours = socket.socketpair()
        theirs.settimeout(timeout_s)
        self._arrived.append(ours)
        with self._counted:
            self._count += 1
        self._bell.send(b"!")
        return theirs

    @contextlib.contextmanager
    def command(self) -> Iterator[None]:
        """Around a command; over when its clients have gone, and the moment after it."""
        others = self._count
        yield
        with self._counted:
            assert self._counted.wait_for(lambda: self._count <= others, PATIENCE_S), "a client does not go"

    def end(self) -> None:
        """Ctrl-C. Raises what the daemon failed with."""
        self._ended = True
        self._bell.send(b"!")
        self._thread.join()
        for end in (self._bell, self._waiting):
            end.close()
        if self._failure is not None:
            raise self._failure

    def _live(self) -> None:
        try:
            run_virtual(self._serve())
        except BaseException as error:  # handed to the test's thread  # noqa: BLE001
            self._failure = error
        finally:
            self._ready.set()

    @property
    def _held(self) -> str | None:
        """The lease of a setup, whose client renews while its person looks and thinks."""
        return self.app.supervisor.setup_lease

    async def _serve(self) -> None:
        await asyncio.sleep(self._begin_s)
        self.app = self._make_app()
        server = OpenServer(self.app.service, Path("virtual"))
        await self.app.start()
        with contextlib.suppress(TimeoutError):
            await Robot(self.app).until(lambda: self.app.service.state == "idle", BOOT_S)
        self._ready.set()
        while not self._ended:
            self.now_s = asyncio.get_running_loop().time()
            with self._counted:
                self._count = len(self._clients) + len(self._arrived)
                self._counted.notify_all()
            for wire in self._wires:
                wire.let_read()
            busy = [each for each in self._clients.values() if each._pending or each.subscribed]
            for end in select.select([self._waiting, *self._clients], [], [], 0 if busy else None)[0]:
                await self._hear(end, server)
            if busy:
                holding = [each for each in self._clients.values() if each._lease and each._lease == self._held]
                self._renew([*busy, *(each for each in holding if each not in busy)])
                await asyncio.sleep(LOOK_S)
        for end in (*self._clients, *self._arrived):
            end.close()
        await self.app.close()

    def _renew(self, busy: list[Connection]) -> None:
        if self.now_s % RENEW_S < LOOK_S:
            for each in busy:
                each.data_received(RENEWAL)

    async def _hear(self, end: socket.socket, server: Server) -> None:
        try:
            data = end.recv(65_536)
        except ConnectionResetError:
            data = b""
        if end is self._waiting:
            self._admit(server)
        elif data:
            self._clients[end].data_received(data)
        else:
            self._clients.pop(end).connection_lost(None)
            self._wires = [wire for wire in self._wires if wire.end is not end]
            end.close()
            await asyncio.sleep(MOMENT_S)

    def _admit(self, server: Server) -> None:
        while self._arrived:
            end = self._arrived.pop()
            self._clients[end] = connection = Connection(server)
            self._wires.append(Wire(end))
            connection.connection_made(self._wires[-1])
