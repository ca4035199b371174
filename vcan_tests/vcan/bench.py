"""Robots in processes of their own on a kernel's CAN: ``canhelm simulate``, ``canhelm run``, and commands to it.

Simulator and daemon have a higher priority than the commands, whose start would keep the one processor of a guest from
them for longer than drives wait for their master.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from canhelm.client import Client
from daemon.demo import Figure
from vcan_tests.manager import Manager
from vcan_tests.vcan.witness import Witness, candump

TIMEOUT_S = 40.0
COMMAND = (sys.executable, "-m", "daemon")


def patient(cycle_hz: int = 20) -> str:
    """More of a profile for tests that are not about time: it outlives the pauses of a loaded machine."""
    return (
        f"network: {{cycle_hz: {cycle_hz}, guard_time_ms: 500, life_time_factor: 20, "
        f"boot_deadline_s: 20, sdo_timeout_s: 1}}\n"
    )


Status = dict[str, Any]


def write_profile(folder: Path, more: str = "", name: str = "max2d") -> Path:
    """The shipped robot with something else in it."""
    profile = folder / f"{name}.yaml"
    profile.write_text(f"schema_version: 1\nname: {name}\nextends: robots/max2d\n{more}")
    return profile


class Simulator:
    """``canhelm simulate``; it runs when this object is made.

    Attributes:
        process: the simulator.
        said: its first line on stderr.
    """

    def __init__(self, profile: Path, bus: str = "socketcan:vcan0", nodes: str | None = None) -> None:
        chosen = ("--nodes", nodes) if nodes else ()
        self.process = subprocess.Popen(
            [*COMMAND, "simulate", "--profile", str(profile), "--bus", bus, *chosen],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            preexec_fn=partial(os.nice, -15),
        )
        assert self.process.stderr is not None
        self.said = self.process.stderr.readline()
        assert "the network runs" in self.said, self.said

    def end(self) -> None:
        """Ctrl-C, or what is left of one that was killed."""
        self.process.terminate()
        _, said = self.process.communicate(timeout=TIMEOUT_S)
        assert "Traceback" not in said, said


class Daemon:
    """``canhelm run``; it can be asked when this object is made.

    Attributes:
        process: the daemon.
        socket: its socket.
        log: what it wrote to stderr.
    """

    def __init__(
        self,
        profile: Path,
        bus: str = "socketcan:vcan0",
        options: Sequence[str] = (),
        command: Sequence[str] = COMMAND,
        niceness: int = -10,
    ) -> None:
        self.socket = profile.with_suffix(".sock")
        self.log = profile.with_suffix(".txt")
        self._begun: list[subprocess.Popen[str]] = []
        manager = Manager(profile.with_suffix(".notify"))
        with self.log.open("a") as log:
            self.process = subprocess.Popen(
                [*command, "run", "--profile", str(profile), "--bus", bus, "--socket", str(self.socket), *options],
                stdout=log,
                stderr=log,
                env={**os.environ, "NOTIFY_SOCKET": str(manager.path)},
                preexec_fn=partial(os.nice, niceness),
            )
        assert manager.hears(TIMEOUT_S), self.log.read_text()
        assert "READY=1" in manager.heard()[0], self.log.read_text()
        manager.close()
        manager.path.unlink()

    def canhelm(self, *arguments: str) -> subprocess.CompletedProcess[str]:
        """Run one command to its end."""
        return subprocess.run(
            [*COMMAND, *arguments], capture_output=True, text=True, timeout=TIMEOUT_S, env=self.environment()
        )

    def begin(self, *arguments: str) -> subprocess.Popen[str]:
        """Begin one command and go on; it ends with the daemon."""
        command = subprocess.Popen(
            [*COMMAND, *arguments],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            env=self.environment(),
        )
        self._begun.append(command)
        return command

    def environment(self) -> dict[str, str]:
        """The environment of a person who works with this daemon."""
        return {**os.environ, "CANHELM_SOCKET": str(self.socket)}

    def status(self) -> Status:
        """What ``canhelm status`` shows."""
        with Client(self.socket) as client:
            return client.status()

    def wait_for(self, condition: Callable[[Status], bool]) -> Status:
        """Watch the status until a condition holds."""
        deadline = time.monotonic() + TIMEOUT_S
        with Client(self.socket) as client:
            for method, status in client.notifications(rate_hz=10.0):
                if method != "status":
                    continue
                if condition(status):
                    return status
                assert time.monotonic() < deadline, (status["message"], status)
        raise AssertionError("it hung up")

    def wait_for_state(self, state: str) -> str:
        """Wait until the vehicle is in that state; why it is."""
        return str(self.wait_for(lambda status: status["state"] == state)["message"])

    def leave_fault(self) -> None:
        """Reset a robot that a pause of the machine has stopped in an earlier try."""
        if self.status()["state"] == "fault":
            assert self.canhelm("reset").returncode == 0

    def signal(self, number: signal.Signals) -> float:
        """Send a signal; the wall-clock time at which."""
        now_s = time.time()
        self.process.send_signal(number)
        return now_s

    def end(self) -> None:
        """SIGTERM, or what is left of one that was killed; nothing may have gone wrong within it."""
        self.process.terminate()
        self.process.send_signal(signal.SIGCONT)
        self.process.wait(TIMEOUT_S)
        for command in self._begun:
            command.kill()
            command.communicate()
        assert "Traceback" not in self.log.read_text(), self.log.read_text()


@dataclass
class Bench:
    """A simulated robot on an interface, its daemon, and a witness of what goes between them.

    Attributes:
        profile: the robot's profile.
        simulator, daemon: the present ones.
        wire: what candump saw.
    """

    profile: Path
    simulator: Simulator
    daemon: Daemon
    wire: Witness

    def drive(self, speed_m_s: float) -> subprocess.Popen[str]:
        """Drive straight on; returns when the robot is at speed."""
        driving = self.daemon.begin("drive", "parallel", "--angle", "0", "--speed", str(speed_m_s), "--duration", "60")
        self._moving(lambda status: min(speeds(status)) > 0.98 * speed_m_s)
        return driving

    def turn_pair(self, speed_m_s: float) -> subprocess.Popen[str]:
        """Steer the front pair far; returns while its wheels turn it, which they do at that speed."""
        steering = self.daemon.begin("steer", "front", "80")
        self._moving(lambda status: max(speeds(status)) > 0.9 * speed_m_s)
        return steering

    def _moving(self, fast_enough: Callable[[Status], bool]) -> None:
        status = self.daemon.wait_for(lambda status: fast_enough(status) or status["state"] == "fault")
        assert status["state"] == "active", status["message"]


@contextmanager
def bench(folder: Path, more: str = "", interface: str = "vcan0", options: Sequence[str] = ()) -> Iterator[Bench]:
    """A robot that is ready to drive; simulator and daemon have ended in order afterwards.

    Args:
        folder: for its files.
        more: what its profile has beside the shipped one.
        interface: where it lives.
        options: more of them for the daemon.
    """
    profile = write_profile(folder, more)
    with candump(interface, folder / "candump.log") as wire:
        simulator = Simulator(profile, f"socketcan:{interface}")
        made = Bench(profile, simulator, Daemon(profile, f"socketcan:{interface}", options), wire)
        try:
            made.daemon.wait_for_state("idle")
            yield made
        finally:
            made.daemon.end()
            made.simulator.end()


def words_of(figure: Figure) -> list[str]:
    """The command that drives a published manoeuvre."""
    method, parameters = figure.request()
    return [*method.split("."), *(f"--{name.partition('_')[0]}={value}" for name, value in parameters.items())]


def speeds(status: Status) -> list[float]:
    """Speeds of the wheels [m/s]."""
    return [abs(node["speed_m_s"]) for node in status["nodes"] if "speed_m_s" in node]
