"""Somebody who types what a page says at a terminal beside a simulated robot, on virtual time.

What is typed goes through the whole command line, to a daemon in a thread of its own; questions are answered as the
page shows it. `python -m vcan_tests.docs.player docs/first-week.md` writes down what the commands of a page show now.
"""

from __future__ import annotations

import contextlib
import inspect
import io
import logging
import os
import re
import runpy
import shlex
import socket
import subprocess
import sys
import tempfile
import time
import types
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from canhelm import protocol
from daemon.app import App
from daemon.cli import record, status
from daemon.cli.main import build_app, main
from daemon.runs.store import RunStore
from profiles.faults import load_faults
from profiles.loader import load
from vcan_tests.docs.pages import Command, blocks
from vcan_tests.docs.virtual_daemon import VirtualDaemon

HOUR_S = 3600.0
ENVIRONMENT = {"COLUMNS": "120", "LINES": "60", "TERM": "dumb"}
RUNS_BYTES = 50_000_000
INDENT = "    "
ELSEWHERE = "    $ "


@dataclass(frozen=True, slots=True)
class Answer:
    """What a command did.

    Attributes:
        code: its exit code.
        shown: the lines on the terminal.
        err: what of them went to stderr.
    """

    code: int
    shown: list[str]
    err: str = ""


class Script:
    """What a page shows below a command: answers to its questions, and what is done meanwhile in another terminal.

    Args:
        lines: of the page.
    """

    def __init__(self, lines: tuple[str, ...]) -> None:
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
        return super().write(text)


class Player:
    """Somebody with terminals in one folder.

    Args:
        folder: where the files are.
        patch: of this test.

    Attributes:
        daemon: the one that was started last.
    """

    def __init__(self, folder: Path, patch: pytest.MonkeyPatch) -> None:
        self.daemon: VirtualDaemon | None = None
        self._daemons = 0
        self._folder = folder
        self._keys, desk = os.openpty()
        self._desk = os.fdopen(desk)
        patch.chdir(folder)
        patch.setattr(protocol, "find_sockets", lambda: [folder / "robot.sock"] if self.daemon else [])
        patch.setattr(protocol, "open_socket", self._connect)
        patch.setattr(record, "time", types.SimpleNamespace(monotonic=lambda: self._running().now_s))
        patch.setattr(status, "time", types.SimpleNamespace(strftime=time.strftime, localtime=time.gmtime))
        patch.setattr(sys, "stdin", self._desk)
        for name, value in {**ENVIRONMENT, "CANHELM_RUNS": str(folder / "runs")}.items():
            patch.setenv(name, value)

    def close(self) -> None:
        """Leave; the daemon ends."""
        self._end_daemon()
        self._desk.close()
        os.close(self._keys)

    def plays(self, page: str) -> Iterator[tuple[Command, Answer]]:
        """Do what a page says: put its files there, and type its commands but for those that no test can carry out.

        Args:
            page: Markdown.

        Yields:
            Each command, and what it did.
        """
        for block in blocks(page):
            if block.file:
                (self._folder / block.file).write_text(block.text, encoding="utf-8")
            elif block.language == "console":
                for line in block.before.splitlines():
                    answer = self.types(line)
                    assert answer.code == 0, f"before line {block.line}: {line}: {answer}"
                for command in [] if block.needs else block.commands():
                    yield command, self.types(command.text, command.shown)

    def types(self, text: str, shown: tuple[str, ...] = ()) -> Answer:
        """Type a command.

        Args:
            text: as it is typed, with a comment or ``&`` at its end.
            shown: what the page shows below it.
        """
        program, *arguments = words_of(text)
        if program == "sed":
            subprocess.run([program, *arguments], check=True)
            return Answer(0, [])
        assert program in ("canhelm", "python"), f"no command of canhelm: {text}"
        if (program, *arguments[:1]) == ("canhelm", "run"):
            self._start_daemon(arguments)
            return Answer(0, [])
        return self._carries_out(program, arguments, Script(shown))

    def _carries_out(self, program: str, arguments: list[str], script: Script) -> Answer:
        shown: list[str] = []

        def answer(question: str) -> None:
            answered = script.answer(question)
            shown.append(f"{answered}\n")
            for elsewhere in script.meanwhile():
                told = self.types(elsewhere).shown
                shown.extend(f"{line}\n" for line in (ELSEWHERE + elsewhere, *(INDENT + line for line in told)))
            os.write(self._keys, f"{answered}\n".encode())

        code, err = 0, Screen(shown, answer)
        moment = self.daemon.command() if self.daemon else contextlib.nullcontext()
        with moment, contextlib.redirect_stdout(Screen(shown, None)), contextlib.redirect_stderr(err):
            if program == "canhelm":
                code = main(arguments)
            else:
                runpy.run_path(arguments[0])
        text = "".join(shown).replace(f"{self._folder}/", "~/")
        return Answer(code, [line.rstrip() for line in text.splitlines()], err.getvalue())

    def _running(self) -> VirtualDaemon:
        assert self.daemon is not None, "no daemon was started"
        return self.daemon

    def _connect(self, path: str | os.PathLike[str], timeout_s: float = 5.0) -> socket.socket:
        return self._running().connect(timeout_s)

    def _start_daemon(self, arguments: list[str]) -> None:
        """What `canhelm run` makes of its arguments, on virtual time; the daemon before it ends."""
        self._end_daemon()
        given: dict[str, Any] = _parsed(arguments).arguments
        assert given.keys() <= {"profile", "bus", "simulate", "miswire", "faults", "runs"}, given
        loaded, runs = load(given["profile"]), RunStore(Path(given["runs"]), RUNS_BYTES)
        built = load(given["miswire"]).profile if "miswire" in given else None
        bus, file = given.get("bus", "simulated"), loaded.path.resolve()
        faults = load_faults(given["faults"], loaded.profile) if "faults" in given else ()
        self._daemons += 1
        begin_s = self._daemons * HOUR_S
        make_app = partial(App, loaded.profile, bus, built=built, profile_file=file, runs=runs, faults=faults)
        self.daemon = VirtualDaemon(make_app, begin_s)

    def _end_daemon(self) -> None:
        ended, self.daemon = self.daemon, None
        if ended is not None:
            ended.end()


def _parsed(arguments: list[str]) -> inspect.BoundArguments:
    return build_app().parse_args(arguments, exit_on_error=False, print_error=False)[1]


def parse(text: str) -> None:
    """Have the parser read a command without carrying it out. Raises CycloptsError where it makes no sense."""
    _parsed(words_of(text)[1:])


def without_comment(text: str) -> str:
    """A command line up to its comment."""
    return re.sub(r"\s+#.*", "", text)


def words_of(text: str) -> list[str]:
    """The words of a command line, without a comment or ``&`` at its end."""
    words = shlex.split(without_comment(text))
    return words[:-1] if words and words[-1] == "&" else words


def fits(shown: tuple[str, ...], told: list[str]) -> bool:
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


def told_anew(page: str, player: Player) -> str:
    """A page as it is when its commands have been typed: with what they show now, where that does not fit."""
    lines = page.splitlines()
    for command, answer in reversed(list(player.plays(page))):
        if not fits(command.shown, answer.shown):
            lines[command.line : command.line + len(command.shown)] = answer.shown
    return "\n".join([*lines, ""])


def write_anew(page: Path) -> None:
    """Play a page and write down what its commands show now."""
    with tempfile.TemporaryDirectory() as folder, pytest.MonkeyPatch.context() as patch:
        player = Player(Path(folder), patch)
        try:
            text = told_anew(page.read_text(encoding="utf-8"), player)
        finally:
            player.close()
    page.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    logging.getLogger().addHandler(logging.NullHandler())
    write_anew(Path(sys.argv[1]).resolve())
