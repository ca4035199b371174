"""What the commands of a page are run on: the command line and a daemon in one process, on virtual time.

The command line's own client speaks to the daemon's own connection; only the socket between them is made up. Time
goes on while the client waits, and only then.
"""

from __future__ import annotations

import asyncio
import contextlib
import io
import re
import shlex
import socket
import sys
import types
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import pytest

import canhelm.client
import daemon.cli.record
from canhelm import protocol
from daemon.api.connection import Connection
from daemon.api.server import Server
from daemon.app import App
from daemon.cli.main import build_app, main
from daemon.runs.store import RunStore
from daemon.runtime.clock import VirtualTimeLoop
from profiles.loader import load
from vcan_tests.robot import Robot

TYPING_S = 0.5
"""How long a person takes to type a command."""
BOOT_S = 20.0
"""How long a robot may take to be ready; one that something is wrong with stays as it is then."""
RUNS, RUNS_BYTES = "runs", 50_000_000
T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class Answer:
    """What a command did."""

    code: int
    out: str
    err: str


async def _called(call: Callable[[], T]) -> T:
    return call()


class _Server(Server):
    """A server without a socket of its own."""

    def admit(self, connection: Connection) -> None:
        self.connections.add(connection)


class _Transport(asyncio.Transport):
    """The daemon's end of a made-up socket."""

    def __init__(self, peer: socket.socket) -> None:
        super().__init__({"socket": peer})
        self.sent = bytearray()
        self._told: asyncio.Event | None = None

    def write(self, data: bytes | bytearray | memoryview) -> None:
        self.sent += data
        if self._told:
            self._told.set()

    async def wait(self, timeout_s: float) -> None:
        """Let time go on until something was sent, or for this long."""
        if not self.sent:
            self._told = asyncio.Event()
            with contextlib.suppress(TimeoutError):
                await asyncio.wait_for(self._told.wait(), timeout_s)

    def get_write_buffer_size(self) -> int:
        return 0

    def is_closing(self) -> bool:
        return False

    def pause_reading(self) -> None:
        pass

    def resume_reading(self) -> None:
        pass


class _Socket:
    """The client's end: waiting for bytes lets time go on."""

    def __init__(self, loop: VirtualTimeLoop, server: Server) -> None:
        self._loop = loop
        self._timeout_s = 0.0
        ours, self._theirs = socket.socketpair()
        ours.close()
        self._transport = _Transport(self._theirs)
        self._connection = self._within(lambda: Connection(server))
        self._within(lambda: self._connection.connection_made(self._transport))

    def _within(self, call: Callable[[], T]) -> T:
        return self._loop.run_until_complete(_called(call))

    def settimeout(self, timeout_s: float) -> None:
        self._timeout_s = timeout_s

    def sendall(self, data: bytes) -> None:
        self._within(lambda: self._connection.data_received(data))

    def recv(self, size: int) -> bytes:
        transport = self._transport
        self._loop.run_until_complete(transport.wait(self._timeout_s))
        if not transport.sent:
            raise TimeoutError
        data = bytes(transport.sent[:size])
        del transport.sent[:size]
        return data

    def close(self) -> None:
        self._within(lambda: self._connection.connection_lost(None))
        self._theirs.close()


class Playground:
    """A folder, and the robot whose daemon runs there, if any.

    Args:
        folder: where commands are run.
        patch: what makes the command line's client come here.
    """

    def __init__(self, folder: Path, patch: pytest.MonkeyPatch) -> None:
        self._loop = VirtualTimeLoop()
        self._app: App | None = None
        self._server: Server | None = None
        self._socket = folder / "robot.sock"
        clock = types.SimpleNamespace(monotonic=self._loop.time)
        patch.chdir(folder)
        for module in (canhelm.client, daemon.cli.record):
            patch.setattr(module, "time", clock)
        patch.setattr(protocol, "open_socket", lambda path: _Socket(self._loop, self._running()))
        patch.setattr(protocol, "find_sockets", lambda: [self._socket] if self._server else [])
        patch.setattr(protocol, "is_live", lambda path: self._server is not None)
        for name, value in {"RUNS": RUNS, "JSON": "false"}.items():
            patch.setenv(f"CANHELM_{name}", value)
        patch.setenv("COLUMNS", "200")

    def _running(self) -> Server:
        assert self._server is not None
        return self._server

    def run(self, text: str, answers: str = "") -> Answer:
        """Carry out one command as a shell would.

        Args:
            text: as typed, with a comment or ``&`` at its end.
            answers: what the person types meanwhile.
        """
        words = words_of(text)
        assert words[0] == "canhelm", f"no command of canhelm: {text}"
        self._loop.run_until_complete(asyncio.sleep(TYPING_S))
        out, err = io.StringIO(), io.StringIO()
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err), _typing(answers):
            code = self._start(words[2:]) if words[1] == "run" else main(words[1:])
        return Answer(code, out.getvalue(), err.getvalue())

    def _start(self, words: list[str]) -> int:
        """``canhelm run`` without its terminal: a robot that has had time to boot; the one before it ends."""
        self.end()
        _, given, _ = build_app().parse_args(["run", *words], exit_on_error=False, print_error=False)
        options: dict[str, Any] = given.arguments
        loaded = load(options["profile"])
        built = load(options["miswire"]).profile if options.get("miswire") else None
        runs = RunStore(Path(RUNS), RUNS_BYTES)
        bus, file = options.get("bus") or "simulated", loaded.path.resolve()
        app = self._within(lambda: App(loaded.profile, bus, built=built, runs=runs, profile_file=file))
        self._app, self._server = app, _Server(app.service, self._socket)
        self._loop.run_until_complete(app.start())
        with contextlib.suppress(TimeoutError):
            self._loop.run_until_complete(Robot(app).until(lambda: app.service.state == "idle", BOOT_S))
        return 0

    def _within(self, make: Callable[[], T]) -> T:
        return self._loop.run_until_complete(_called(make))

    def end(self) -> None:
        """End the daemon that runs, if any."""
        if self._app is not None:
            self._loop.run_until_complete(self._app.close())
        self._app = self._server = None

    def close(self) -> None:
        """End everything."""
        self.end()
        self._loop.close()


def without_comment(text: str) -> str:
    """A command line up to its comment."""
    return re.sub(r"\s+#.*", "", text)


def words_of(text: str) -> list[str]:
    """The words of a command line, without a comment or ``&`` at its end."""
    words = shlex.split(without_comment(text))
    return words[:-1] if words and words[-1] == "&" else words


class _Person(io.StringIO):
    def isatty(self) -> bool:
        return True


@contextlib.contextmanager
def _typing(answers: str) -> Iterator[None]:
    """Somebody at the terminal, where there is something to be typed; nobody otherwise."""
    before, sys.stdin = sys.stdin, _Person(answers) if answers else io.StringIO()
    try:
        yield
    finally:
        sys.stdin = before


def parse(text: str) -> None:
    """Have the parser read a command without carrying it out. Raises CycloptsError where it makes no sense."""
    build_app().parse_args(words_of(text)[1:], exit_on_error=False, print_error=False)
