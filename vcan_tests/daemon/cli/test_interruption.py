"""Ctrl-C and SIGTERM in the middle of a command."""

from __future__ import annotations

import signal
import subprocess
import sys

import pytest

from daemon.api.server import Server
from vcan_tests.daemon.cli.shell import canhelm
from vcan_tests.daemon.fake_backend import FakeBackend


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupted_motion_is_stopped_and_said_so(
    server: Server, backend: FakeBackend, number: signal.Signals
) -> None:
    with canhelm("motor velocity 1 -250") as process:
        assert backend.called.wait(10)
        process.send_signal(number)
        out, err = process.communicate(timeout=10)
    assert (process.returncode, out) == (130, "")
    assert "the motion was stopped" in err
    assert backend.stopped == ["lease-1"]


def test_an_interrupted_monitor_leaves_the_robot_alone(server: Server, backend: FakeBackend) -> None:
    with canhelm("monitor --rate 50") as process:
        assert process.stdout is not None
        process.stdout.readline()
        process.send_signal(signal.SIGINT)
        assert process.wait(10) == 130
    assert not backend.calls


@pytest.mark.parametrize("line", ["status --follow --rate 50", "monitor --rate 50"])
def test_sigterm_ends_a_command_in_order(server: Server, line: str) -> None:
    with canhelm(line) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        process.stdout.readline()
        process.terminate()
        assert (process.wait(10), process.stderr.read()) == (130, "canhelm: interrupted\n")


def test_an_interruption_while_the_command_is_loaded_is_no_traceback(capsys: pytest.CaptureFixture[str]) -> None:
    code = (
        "import builtins, signal, sys\n"
        "from daemon.__main__ import main\n"
        "load = builtins.__import__\n"
        "def interrupt(name, *rest):\n"
        "    if name.startswith('cyclopts'): signal.raise_signal(signal.SIGINT)\n"
        "    return load(name, *rest)\n"
        "builtins.__import__ = interrupt\n"
        "sys.exit(main())\n"
    )
    done = subprocess.run([sys.executable, "-c", code, "status"], capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (130, "")
