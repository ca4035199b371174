"""The command ``canhelm station``: how it begins, ends, and says what is wrong."""

from __future__ import annotations

import importlib.util
import os
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from daemon.api.tokens import SHORTEST
from vcan_tests.daemon.cli.shell import run
from vcan_tests.daemon.cli.test_what_is_loaded import loaded_by


@pytest.fixture
def taken() -> Iterator[int]:
    """A port that somebody listens on."""
    with socket.create_server(("127.0.0.1", 0)) as listener:
        yield int(listener.getsockname()[1])


@pytest.mark.real_time
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_it_tells_its_address_and_ends_when_it_is_told_to(tmp_path: Path, number: signal.Signals) -> None:
    environment = {**os.environ, "XDG_RUNTIME_DIR": str(tmp_path)}
    command = (sys.executable, "-m", "daemon", "station", "--port", "0")
    with subprocess.Popen(command, env=environment, stderr=subprocess.PIPE, text=True) as process:
        assert process.stderr is not None
        told = process.stderr.readline()
        process.send_signal(number)
        rest = process.stderr.read()
    assert told.startswith("canhelm: the control station is at http://127.0.0.1:")
    assert (process.returncode, rest) == (0, "")


@pytest.mark.real_time
def test_a_port_that_is_taken_is_told(taken: int, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(f"station --port {taken}") == 7
    assert f"cannot listen on 127.0.0.1 port {taken}: Address already in use - choose" in capsys.readouterr().err


@pytest.mark.real_time
@pytest.mark.parametrize("host", ["192.0.2.1", "none.invalid"])
def test_an_address_that_this_machine_has_not_is_told(
    host: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    tokens = tmp_path / "tokens"
    tokens.touch(mode=0o600)
    tokens.write_text(f"watch {'w' * SHORTEST}")
    assert run(f"station --host {host} --tokens {tokens}") == 7
    told = capsys.readouterr().err
    assert f"cannot listen on {host} port 8137" in told
    assert "give --host an address of this machine" in told


@pytest.mark.parametrize("host", ["0.0.0.0", "::", "192.0.2.1", "lab1"])
def test_another_address_than_the_loopback_wants_tokens(host: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(f"station --host {host}") == 2
    assert "--tokens" in capsys.readouterr().err


def test_a_file_of_tokens_that_is_missing_is_told(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("station --tokens /nonexistent") == 7
    assert "/nonexistent cannot be read" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("options", "told"),
    [
        ("--port 65536", "no port"),
        ("--robot ../x", "not a robot's name"),
        ("--port x", "port"),
        ("--host=", "names no address"),
    ],
)
def test_options_that_make_no_sense_are_refused(options: str, told: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(f"station {options}") == 2
    assert told in capsys.readouterr().err


def test_without_its_extra_it_says_what_to_install(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    assert run("station") == 2
    assert f"{sys.executable} -m pip install 'canhelm[web]'" in capsys.readouterr().err


def test_the_other_commands_do_without_aiohttp() -> None:
    assert "aiohttp" not in loaded_by("completion bash")
