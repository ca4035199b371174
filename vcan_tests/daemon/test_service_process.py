"""A daemon as the service manager starts it: a real process with inherited sockets and a manager that listens."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from canhelm.client import Client
from canhelm.errors import LimitExceeded
from vcan_tests.manager import Manager

TIMEOUT_S = 30.0
PROFILE = "schema_version: 1\nextends: robots/max2d\nnetwork: {guard_time_ms: 1000, life_time_factor: 4}\n"
START = (
    "import fcntl, os, sys\n"
    "found = [fcntl.fcntl(int(fd), fcntl.F_DUPFD, 100) for fd in sys.argv[1].split(',')]\n"
    "for number, fd in enumerate(found): os.dup2(fd, 3 + number)\n"
    "os.environ['LISTEN_PID'] = os.environ['WATCHDOG_PID'] = str(os.getpid())\n"
    "os.execv(sys.executable, [sys.executable, '-m', 'daemon', *sys.argv[2:]])\n"
)
"""Becomes the daemon with its sockets at the descriptors 3 and 4."""


class Service:
    """One daemon under a service manager.

    Attributes:
        profile: its profile's file.
        socket: path of its API.
        process: the daemon.
        manager: what the service manager hears.
    """

    def __init__(self, folder: Path) -> None:
        self.socket = folder / "lab1.sock"
        self.gateway = folder / "lab1.309.sock"
        self.profile = folder / "lab1.yaml"
        self.profile.write_text(PROFILE)
        self.manager = Manager(folder / "notify")
        self.log = folder / "log"
        self._listeners = [_listen(path) for path in (self.gateway, self.socket)]
        fds = [listener.fileno() for listener in self._listeners]
        environment = {
            **os.environ,
            "NOTIFY_SOCKET": str(self.manager.path),
            "WATCHDOG_USEC": "2000000",
            "LISTEN_FDS": "2",
        }
        arguments = ["run", "--simulate", "--profile", str(self.profile)]
        with self.log.open("w") as log:
            self.process = subprocess.Popen(
                [sys.executable, "-c", START, ",".join(map(str, fds)), *arguments],
                pass_fds=fds,
                env=environment,
                stderr=log,
            )

    def hear(self, word: str) -> list[str]:
        """Wait for a message with this line or its beginning; all lines since the last call."""
        deadline = time.monotonic() + TIMEOUT_S
        lines: list[str] = []
        while not any(line.startswith(word) for line in lines):
            assert self.manager.hears(deadline - time.monotonic()), (word, lines, self.log.read_text())
            lines += [line for message in self.manager.heard() for line in message]
        return lines

    def close(self) -> None:
        """End whatever is left."""
        self.process.kill()
        self.process.wait()
        self.manager.close()
        for listener in self._listeners:
            listener.close()


def _listen(path: Path) -> socket.socket:
    listener = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    listener.bind(str(path))
    listener.listen()
    return listener


@pytest.fixture
def service(tmp_path: Path) -> Iterator[Service]:
    service = Service(tmp_path)
    yield service
    service.close()


@pytest.mark.real_time
def test_a_client_that_came_before_the_daemon_is_answered(service: Service) -> None:
    with Client(str(service.socket)) as client:
        assert client.call("hello")["robot"] == "lab1"


@pytest.mark.real_time
def test_the_other_inherited_socket_is_the_gateway(service: Service) -> None:
    service.hear("READY=1")
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as tool:
        tool.settimeout(TIMEOUT_S)
        tool.connect(str(service.gateway))
        tool.sendall(b"[1] info version\r\n")
        assert tool.recv(100).startswith(b"[1] ")


@pytest.mark.real_time
def test_an_orderly_end_is_announced_and_leaves_the_sockets_to_their_owner(service: Service) -> None:
    service.hear("STATUS=idle")
    service.process.send_signal(signal.SIGTERM)
    service.hear("STOPPING=1")
    assert service.process.wait(TIMEOUT_S) == 0
    assert service.socket.exists()
    assert service.gateway.exists()


@pytest.mark.real_time
def test_a_hang_up_reloads_and_a_mistake_changes_nothing(service: Service) -> None:
    service.hear("STATUS=idle")
    service.profile.write_text(PROFILE + "limits: {speed_m_s: 0.5}\n")
    service.process.send_signal(signal.SIGHUP)
    assert "RELOADING=1" in service.hear("READY=1")
    service.hear("STATUS=idle")
    service.profile.write_text(PROFILE + "limits: {speed_m_s: fast}\n")
    service.process.send_signal(signal.SIGHUP)
    service.hear("STATUS=idle - reload refused: profile ")
    with Client(str(service.socket)) as client, pytest.raises(LimitExceeded, match=r"0\.6 m/s"):
        client.call("drive.parallel", angle_deg=0.0, speed_m_s=0.6, duration_s=1.0)


@pytest.mark.real_time
def test_the_watchdog_is_fed_until_the_daemon_hangs(service: Service) -> None:
    service.hear("STATUS=idle")
    service.hear("WATCHDOG=1")
    service.process.send_signal(signal.SIGSTOP)
    service.manager.heard()
    assert not service.manager.hears(within_s=1.2)


@pytest.mark.real_time
def test_a_hung_daemon_that_is_aborted_tells_where_it_hung(service: Service) -> None:
    service.hear("STATUS=idle")
    service.process.send_signal(signal.SIGABRT)
    assert service.process.wait(TIMEOUT_S) == -signal.SIGABRT
    assert 'asyncio/runners.py"' in service.log.read_text()
