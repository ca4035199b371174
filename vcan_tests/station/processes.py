"""Simulated robots and a control station in processes of their own, in a runtime folder of their own."""

from __future__ import annotations

import os
import re
import select
import signal
import socket
import subprocess
import sys
import threading
import time
import urllib.request
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from canhelm.client import Client
from canhelm.errors import CanhelmError

TIMEOUT_S = 60.0
REST_M_S = 0.01
LEASE_S = 1.5
RAMP_S = 0.8
"""From the speeds that are driven here by hand, by the ramp of a drive."""
UNHELD_S = LEASE_S + RAMP_S
"""Within which a robot stands that is not held any more, whatever has become of the page and the station."""
COMMAND = (sys.executable, "-m", "daemon")
ERROR = re.compile(r"^\S+ \S+ (?:ERROR|CRITICAL) (.*)$", re.MULTILINE)
"""A line of a daemon's log that tells of an event of severity error, or of a defect."""
Status = dict[str, Any]


def environment(folder: Path) -> dict[str, str]:
    """The environment of a person whose runtime and state folders are in this one."""
    kept = {name: value for name, value in os.environ.items() if not name.startswith(("CANHELM_", "XDG_"))}
    return {**kept, "XDG_RUNTIME_DIR": str(folder), "XDG_STATE_HOME": str(folder / "state"), "HOME": str(folder)}


class Child:
    """One of our commands, with its log in a file.

    Attributes:
        process: the present one.
        log: what it wrote.
    """

    def __init__(self, folder: Path, name: str, words: Sequence[str]) -> None:
        self.log = folder / f"{name}.log"
        self._folder, self._words = folder, (*COMMAND, *words)
        self.process = self._begin()

    def _begin(self) -> subprocess.Popen[bytes]:
        with self.log.open("ab") as log:
            return subprocess.Popen(self._words, stdout=log, stderr=log, env=environment(self._folder))

    def begin_again(self) -> None:
        """Start it anew, after it has ended."""
        assert self.process.poll() is not None
        self.process = self._begin()

    def wait_for(self, happened: Callable[[], bool]) -> None:
        """Look again and again until something is so. Raises AssertionError where it ends, or takes too long."""
        deadline = time.monotonic() + TIMEOUT_S
        while not happened():
            if self.process.poll() is not None or time.monotonic() > deadline:
                raise AssertionError(self.log.read_text())
            select.select([], [], [], 0.02)

    @contextmanager
    def suspended(self) -> Iterator[None]:
        """It does nothing while the ``with`` block lasts."""
        self.process.send_signal(signal.SIGSTOP)
        try:
            yield
        finally:
            self.process.send_signal(signal.SIGCONT)

    def kill(self) -> None:
        """End it at once, as a crash does."""
        self.process.kill()
        self.process.wait()

    def end(self) -> None:
        """End it as a service manager does; nothing may have gone wrong within it."""
        self.process.send_signal(signal.SIGTERM)
        self.process.wait(TIMEOUT_S)
        assert "Traceback" not in self.log.read_text(), self.log.read_text()

    def processor_s(self) -> float:
        """Seconds of a processor that it has used."""
        words = Path(f"/proc/{self.process.pid}/stat").read_text().rpartition(")")[2].split()
        return (int(words[11]) + int(words[12])) / os.sysconf("SC_CLK_TCK")

    def memory_bytes(self) -> int:
        """Its resident memory."""
        return int(Path(f"/proc/{self.process.pid}/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")


class Robot(Child):
    """A daemon with the simulated robot of a shipped profile.

    Attributes:
        name: of the robot.
        socket: its socket.
    """

    def __init__(self, folder: Path, name: str, options: Sequence[str] = ()) -> None:
        self.name = name
        self.socket = folder / "canhelm" / f"{name}.sock"
        super().__init__(folder, name, ("run", "--simulate", "--profile", name, *options))
        self.wait_until_ready()

    def wait_until_ready(self) -> None:
        """Wait until it answers and could drive."""
        self.wait_for(lambda: self._answers() and self.status()["state"] == "idle")

    def _answers(self) -> bool:
        try:
            Client(self.socket).close()
        except CanhelmError:
            return False
        return True

    def call(self, method: str, **params: Any) -> dict[str, Any]:
        """Call a method beside the page."""
        with Client(self.socket) as client:
            return client.call(method, **params)

    def status(self) -> Status:
        """What ``canhelm status`` shows."""
        return self.call("status")

    def comes_to(self, condition: Callable[[Status], bool], within_s: float = TIMEOUT_S) -> Status:
        """Watch until a condition holds; the status in which it did.

        Args:
            condition: that is waited for.
            within_s: by the robot's clock, which leaves out what a busy machine lets its daemon wait.
        """
        begun_s: float | None = None
        with Client(self.socket) as client:
            for method, status in client.notifications(rate_hz=50.0):
                if method != "status":
                    continue
                if condition(status):
                    return status
                begun_s = begun_s or status["time_s"]
                assert status["time_s"] - begun_s < within_s, (status["state"], status["message"], speeds(status))
        raise AssertionError("it hung up")

    def comes_to_rest(self, within_s: float) -> None:
        """Watch until every wheel stands."""
        self.comes_to(at_rest, within_s)

    def stays_at_rest(self, for_s: float = 0.5) -> None:
        """Watch that every wheel stands, for some time by the robot's clock."""
        begun_s = self.status()["time_s"]

        def over(status: Status) -> bool:
            assert at_rest(status), speeds(status)
            return bool(status["time_s"] - begun_s > for_s)

        self.comes_to(over)

    @contextmanager
    def watched(self) -> Iterator[SpeedWatch]:
        """A look at its speed all the time while the ``with`` block lasts."""
        watch = SpeedWatch(self.socket)
        watch.start()
        try:
            yield watch
        finally:
            watch.over.set()
            watch.join()

    def errors_since(self, begin: int) -> list[str]:
        """What its log tells of errors behind a place in it."""
        return ERROR.findall(self.log.read_text()[begin:])

    def tidy(self) -> None:
        """As after its start, wherever a test has left it."""
        with Client(self.socket) as client:
            client.call("simulation.clear_faults")
            client.call("simulation.pace", factor=1.0)
            client.call("simulation.slope", slope_deg=0.0)
            client.call("stop")
            if client.call("status")["state"] in ("estop", "fault"):
                client.call("reset")
        self.comes_to(lambda status: status["state"] == "idle")


class SpeedWatch(threading.Thread):
    """Watches how fast a robot is, in a thread of its own.

    Attributes:
        speed_m_s: of the fastest wheel up to now.
        over: set when it is to end.
    """

    def __init__(self, socket: Path) -> None:
        super().__init__()
        self.speed_m_s = 0.0
        self.over = threading.Event()
        self._socket = socket

    def run(self) -> None:
        """Look 50 times a second."""
        with Client(self._socket) as client:
            for method, status in client.notifications(rate_hz=50.0):
                if method == "status":
                    self.speed_m_s = max(self.speed_m_s, *speeds(status))
                if self.over.is_set():
                    return


class Station(Child):
    """A control station on a free port of the loopback interface.

    Attributes:
        port: where it listens.
        url: of its page.
    """

    def __init__(self, folder: Path, options: Sequence[str] = (), name: str = "station") -> None:
        self.port = free_port()
        self.url = f"http://127.0.0.1:{self.port}/"
        super().__init__(folder, name, ("station", "--port", str(self.port), *options))
        self.wait_for(self._answers)

    def _answers(self) -> bool:
        try:
            with urllib.request.urlopen(f"{self.url}session", timeout=5.0) as answer:
                return bool(answer.status == 200)
        except OSError:
            return False


@dataclass
class Fleet:
    """Robots and the station in front of them.

    Attributes:
        folder: with all their files.
        robots: by their names.
        station: the station.
    """

    folder: Path
    robots: dict[str, Robot]
    station: Station

    @property
    def children(self) -> list[Child]:
        """All its processes."""
        return [*self.robots.values(), self.station]


@contextmanager
def running_fleet(folder: Path, names: Sequence[str], options: Sequence[str] = ()) -> Iterator[Fleet]:
    """Robots that are ready to drive and a station; all have ended in order afterwards.

    Args:
        folder: for all their files; its path is short enough for a socket's.
        names: of the profiles.
        options: of the station.
    """
    with ExitStack() as stack:
        robots = {}
        for name in names:
            robots[name] = Robot(folder, name)
            stack.callback(robots[name].end)
        station = Station(folder, options)
        stack.callback(station.end)
        yield Fleet(folder, robots, station)


def speeds(status: Status) -> list[float]:
    """Speeds of the wheels [m/s]."""
    return [abs(node["speed_m_s"]) for node in status["nodes"] if node.get("speed_m_s") is not None]


def at_rest(status: Status) -> bool:
    """Whether every wheel stands."""
    return max(speeds(status)) < REST_M_S


def free_port() -> int:
    """A port of the loopback interface that nobody listens on."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])
