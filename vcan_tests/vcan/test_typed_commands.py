"""Each command that needs a daemon is typed on the kernel's bus: told here, where none is needed."""

from __future__ import annotations

from collections.abc import Iterator

from cyclopts import App

from daemon.cli.main import COMMANDS, SETUP, build_app
from vcan_tests.vcan.typed_commands import TYPED

TYPED_BY_THEMSELVES = {"monitor", "drive record"}
"""Those that go on until Ctrl-C: test_processes_commands.py types them, too."""


def test_no_command_that_needs_a_daemon_is_left_out() -> None:
    tested = {typed for typed, _, _ in TYPED} | TYPED_BY_THEMSELVES
    verbs = verbs_for_a_daemon(build_app())
    assert [verb for verb in verbs if not any(f"{line} ".startswith(f"{verb} ") for line in tested)] == []


def verbs_for_a_daemon(app: App, said: str = "") -> Iterator[str]:
    """The commands that take ``--socket``, but for the one that listens on it."""
    for name in app:
        command = app[name]
        if name.startswith("-") or name in COMMANDS[SETUP]:
            continue
        verb = f"{said} {name}".strip()
        if command.default_command is None:
            yield from verbs_for_a_daemon(command, verb)
        elif any("--socket" in argument.names for argument in command.assemble_argument_collection()):
            yield verb
