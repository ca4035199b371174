"""A person's terminal beside a robot on virtual time: what is typed goes through the whole command line.

The daemon runs in a thread of its own. Its time stands still while a command thinks, and passes while one waits for
an answer; between two commands a person takes a moment. Each client has one end of a pair of sockets, so that command,
client, wire format and connection are those of a real daemon, and what they print is the same each time.
"""

from __future__ import annotations

import asyncio
import contextlib
import io
import logging
import os
import re
import runpy
import select
import shlex
import socket
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable
from pathlib import Path

import pytest

from canhelm import protocol
from daemon.api.connection import Connection
from daemon.api.server import Server
from daemon.app import App
from daemon.cli.main import build_app, main
from daemon.runs.store import RunStore
from daemon.runtime.clock import run_virtual
from profiles.loader import load

MOMENT_S = 0.5
"""What a person takes between two commands."""
BOOT_S, HOUR_S = 3.0, 3600.0
LOOK_S = 0.01
RENEW_S = 0.5
RENEWAL = protocol.make_request(0, "lease.renew", {}).replace(b'"id":0,', b"")
ENVIRONMENT = {"COLUMNS": "120", "LINES": "60", "TERM": "dumb", "CANHELM_SOCKET": "virtual"}
FENCE, PROMPT = "```console\n", "$ "
INDENT = "    "
ELSEWHERE = "    $ "


class Wire(asyncio.Transport):
    """The daemon's end of a client's connection."""

    def __init__(self, end: socket.socket) -> None:
        super().__init__({"socket": end})
        self.end = end
        self._closing = False

    def write(self, data: bytes | bytearray | memoryview) -> None:
        with contextlib.suppress(OSError):
            self.end.sendall(data)

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


class OpenServer(Server):
    """Takes in whoever it is handed; it listens nowhere."""

    def admit(self, connection: Connection) -> None:
        self.connections.add(connection)


class VirtualDaemon:
    """A daemon that lives on virtual time as long as its clients wait.

    Args:
        make_app: makes it, on its loop.
        begin_s: virtual time at which it begins.
    """

    def __init__(self, make_app: Callable[[], App], begin_s: float) -> None:
        self._make_app = make_app
        self._begin_s = begin_s
        self._arrived: list[socket.socket] = []
        self._bell, self._waiting = socket.socketpair()
        self._clients: dict[socket.socket, Connection] = {}
        self._ready = threading.Event()
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
        self._bell.send(b"!")
        return theirs

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

    async def _serve(self) -> None:
        self.app = self._make_app()
        server = OpenServer(self.app.service, Path("virtual"))
        await asyncio.sleep(self._begin_s)
        await self.app.start()
        await asyncio.sleep(BOOT_S)
        self._ready.set()
        while not self._ended:
            busy = [each for each in self._clients.values() if each._pending or each.subscribed]
            for end in select.select([self._waiting, *self._clients], [], [], 0 if busy else None)[0]:
                await self._hear(end, server)
            if busy:
                self._renew(busy)
                await asyncio.sleep(LOOK_S)
        for end in (*self._clients, *self._arrived):
            end.close()
        await self.app.close()

    def _renew(self, busy: list[Connection]) -> None:
        now_s = asyncio.get_running_loop().time()
        if now_s % RENEW_S < LOOK_S:
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
            end.close()
            await asyncio.sleep(MOMENT_S)

    def _admit(self, server: Server) -> None:
        while self._arrived:
            end = self._arrived.pop()
            self._clients[end] = connection = Connection(server)
            connection.connection_made(Wire(end))


class Script:
    """What a page shows below a command: answers to its questions, and what is done meanwhile in another terminal.

    Args:
        lines: of the page.
    """

    def __init__(self, lines: list[str]) -> None:
        self._lines = lines
        self._next = 0

    def answer(self, question: str) -> str:
        """What stands behind the next such question. Raises AssertionError where there is none."""
        for number in range(self._next, len(self._lines)):
            if self._lines[number].startswith(question.rstrip()):
                self._next = number + 1
                return self._lines[number][len(question) :]
        raise AssertionError(f"the page has no answer to {question!r}")

    def meanwhile(self) -> list[str]:
        """Commands that are typed in the other terminal before the last question is answered."""
        commands = []
        while self._next < len(self._lines) and self._lines[self._next].startswith(INDENT):
            if self._lines[self._next].startswith(ELSEWHERE):
                commands.append(self._lines[self._next].removeprefix(ELSEWHERE))
            self._next += 1
        return commands


class Screen(io.StringIO):
    """What a terminal shows.

    Args:
        shown: takes it.
        asked: called with a question, which leaves its line open; None: this is stdout, where tables are drawn.
    """

    def __init__(self, shown: list[str], asked: Callable[[str], None] | None) -> None:
        super().__init__()
        self._shown = shown
        self._asked = asked

    def isatty(self) -> bool:
        return self._asked is None

    def write(self, text: str) -> int:
        self._shown.append(text)
        if self._asked is not None and text.endswith(" "):
            self._asked(text)
        return len(text)


class Typist:
    """Somebody with terminals in one folder.

    Args:
        folder: where the files are.
        patch: of this test.

    Attributes:
        daemon: the one that was started last.
        folder: as above.
    """

    def __init__(self, folder: Path, patch: pytest.MonkeyPatch) -> None:
        self.daemon: VirtualDaemon | None = None
        self._daemons = 0
        self.folder = folder
        self._keys, desk = os.openpty()
        self._desk = os.fdopen(desk)
        patch.chdir(folder)
        patch.setattr(protocol, "open_socket", self._connect)
        patch.setattr(sys, "stdin", self._desk)
        for name, value in ENVIRONMENT.items():
            patch.setenv(name, value)
        patch.setenv("CANHELM_RUNS", str(folder / "runs"))

    def close(self) -> None:
        """Leave; the daemon ends."""
        self._end_daemon()
        self._desk.close()
        os.close(self._keys)

    def types(self, command: str, script: Script) -> list[str]:
        """Type a command.

        Args:
            command: as it is typed.
            script: what the page shows below it.

        Returns:
            The lines that it really shows.
        """
        if command.startswith("canhelm run "):
            self._start_daemon(shlex.split(command)[1:])
            return []
        if not command.startswith(("canhelm ", "python ")):
            return subprocess.run(command, shell=True, check=True, capture_output=True, text=True).stdout.splitlines()
        shown: list[str] = []

        def answer(question: str) -> None:
            answered = script.answer(question)
            shown.append(f"{answered}\n")
            for elsewhere in script.meanwhile():
                told = self.types(elsewhere, Script([]))
                shown.extend(f"{line}\n" for line in (ELSEWHERE + elsewhere, *(INDENT + line for line in told)))
            os.write(self._keys, f"{answered}\n".encode())

        with contextlib.redirect_stdout(Screen(shown, None)), contextlib.redirect_stderr(Screen(shown, answer)):
            program, *arguments = shlex.split(command)
            main(arguments) if program == "canhelm" else runpy.run_path(arguments[0])
        text = "".join(shown).replace(f"{self.folder}/", "~/")
        return [line.rstrip() for line in text.splitlines()]

    def _connect(self, path: str | os.PathLike[str], timeout_s: float = 5.0) -> socket.socket:
        assert self.daemon is not None, "no daemon was started"
        return self.daemon.connect(timeout_s)

    def _start_daemon(self, arguments: list[str]) -> None:
        """What `canhelm run` makes of its arguments, on virtual time."""
        self._end_daemon()
        given = build_app().parse_args(arguments, exit_on_error=False, print_error=False)[1].arguments
        assert given.keys() <= {"profile", "simulate", "miswire", "socket", "runs"}, given
        loaded, runs = load(given["profile"]), RunStore(self.folder / "runs", 10_000_000)
        built = load(given["miswire"]).profile if "miswire" in given else None
        file = loaded.path.resolve()
        self._daemons += 1
        begin_s = self._daemons * HOUR_S
        self.daemon = VirtualDaemon(lambda: App(loaded.profile, built=built, profile_file=file, runs=runs), begin_s)

    def _end_daemon(self) -> None:
        daemon, self.daemon = self.daemon, None
        if daemon is not None:
            daemon.end()


def files_of(page: str) -> dict[str, str]:
    """The files that a page shows, by their names: a block below a line that ends in the file's name."""
    return dict(re.findall(r"`([\w.-]+)`:\n\n```\w+\n(.*?)```", page, re.DOTALL))


def played(page: str, typist: Typist) -> str:
    """A page as it is when its files are there and everything in its console blocks is typed.

    Args:
        page: Markdown; in a block a command stands behind `$ `, and below it what it shows.
        typist: who types.
    """
    for name, text in files_of(page).items():
        (typist.folder / name).write_text(text)
    parts = page.split(FENCE)
    for number in range(1, len(parts)):
        block, end, rest = parts[number].partition("```")
        parts[number] = "".join(f"{line}\n" for line in _played_block(block.splitlines(), typist)) + end + rest
    return FENCE.join(parts)


def _played_block(lines: list[str], typist: Typist) -> list[str]:
    begins = [number for number, line in enumerate(lines) if line.startswith(PROMPT)]
    played: list[str] = []
    for begin, end in zip(begins, [*begins[1:], len(lines)], strict=True):
        shown = lines[begin + 1 : end]
        told = typist.types(lines[begin].removeprefix(PROMPT), Script(shown))
        played += [lines[begin], *(shown if fits(shown, told) else told)]
    return played


def fits(shown: list[str], told: list[str]) -> bool:
    """Whether a page shows what was told, where ``...`` stands for any lines."""
    head, *parts = "\n".join(["", *shown, ""]).split("\n...\n")
    text = "\n".join(["", *told, ""])
    if not parts:
        return text == head
    if not text.startswith(head + "\n"):
        return False
    place = len(head)
    for part in parts:
        place = text.find(f"\n{part}", place) if part.strip() else place
        if place < 0:
            return False
    return not parts[-1].strip() or text.endswith(f"\n{parts[-1]}")


def write_anew(page: Path) -> None:
    """Play a page and write down what its commands show now."""
    with tempfile.TemporaryDirectory() as folder, pytest.MonkeyPatch.context() as patch:
        text, typist = page.read_text(encoding="utf-8"), Typist(Path(folder), patch)
        try:
            told = played(text, typist)
        finally:
            typist.close()
    page.write_text(told, encoding="utf-8")


if __name__ == "__main__":
    logging.getLogger().addHandler(logging.NullHandler())
    write_anew(Path(sys.argv[1]).resolve())
