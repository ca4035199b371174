"""A daemon and its command line as a person uses them: real processes, a real socket, real signals."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from canhelm.client import Client
from canhelm.errors import CanhelmError

pytestmark = pytest.mark.timeout(400)

TIMEOUT_S = 150
"""Of wall time: a simulated robot waits for a machine that is busy."""
PATIENT_PROFILE = """
schema_version: 1
name: max2d
extends: robots/max2d
network: {guard_time_ms: 1000, life_time_factor: 4}
"""
"""Guarding that outlives the pauses of a loaded machine; how fast it works is proven on virtual time."""
DRIVE = ("drive", "parallel", "--angle", "0", "--speed", "0.4", "--duration", "30")


class Bench:
    """One running daemon with a simulated robot.

    Attributes:
        process: the daemon.
        socket: its socket.
        log: what it wrote to stderr.
    """

    def __init__(self, folder: Path, bus: str = "simulated", profile_text: str = PATIENT_PROFILE) -> None:
        self.socket = folder / "robot.sock"
        self.log = folder / "daemon.log"
        profile = folder / "max2d.yaml"
        profile.write_text(profile_text)
        arguments = ("run", "--bus", bus, "--profile", str(profile), "--socket", str(self.socket))
        with self.log.open("w") as log:
            self.process = subprocess.Popen([sys.executable, "-m", "daemon", *arguments], stderr=log, stdout=log)
        try:
            self.client = self._connect()
            self.wait_for(lambda status: status["state"] == "idle")
        except BaseException:
            self.process.kill()
            raise

    def _connect(self) -> Client:
        deadline = time.monotonic() + TIMEOUT_S
        while True:
            try:
                return Client(str(self.socket))
            except CanhelmError:
                if time.monotonic() > deadline or self.process.poll() is not None:
                    raise AssertionError(self.log.read_text()) from None
                os.sched_yield()

    def environment(self) -> dict[str, str]:
        """The environment of a person who works with this daemon."""
        return {**os.environ, "CANHELM_SOCKET": str(self.socket)}

    def canhelm(self, *arguments: str) -> subprocess.CompletedProcess[str]:
        """Run one command to its end."""
        command = [sys.executable, "-m", "daemon", *arguments]
        return subprocess.run(command, capture_output=True, text=True, timeout=TIMEOUT_S, env=self.environment())

    def begin(self, *arguments: str) -> subprocess.Popen[str]:
        """Begin one command and go on."""
        command = [sys.executable, "-m", "daemon", *arguments]
        return subprocess.Popen(
            command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=self.environment()
        )

    def drive(self) -> subprocess.Popen[str]:
        """Begin to drive; returns when the robot is at speed."""
        driving = self.begin(*DRIVE)
        self.wait_for(lambda status: speeds(status)[0] > 0.38)
        return driving

    def status(self) -> dict[str, Any]:
        """The daemon's status."""
        status: dict[str, Any] = self.client.call("status")
        return status

    def wait_for(self, condition: Any) -> dict[str, Any]:
        """Ask for the status until a condition holds."""
        deadline = time.monotonic() + TIMEOUT_S
        while not condition(status := self.status()):
            assert time.monotonic() < deadline, status
        return status

    def end(self) -> None:
        """End the daemon as a service manager does; it goes down in order."""
        self.client.close()
        self.process.send_signal(signal.SIGTERM)
        assert self.process.wait(TIMEOUT_S) == 0
        assert "Traceback" not in self.log.read_text()

    def kill(self) -> None:
        """End the daemon at once, whether it still runs or not."""
        self.client.close()
        self.process.kill()
        self.process.wait()


def speeds(status: dict[str, Any]) -> list[float]:
    return [abs(node["speed_m_s"]) for node in status["nodes"] if "speed_m_s" in node]


def at_rest(status: dict[str, Any]) -> bool:
    return max(speeds(status)) < 0.01


SEQUENCE = (
    ("motor enable 2", 0),
    ("motor velocity 2 150 --duration 1", 0),
    ("motor velocity 1 -150 --duration 1", 0),
    ("motor disable 2", 0),
    ("brake release front", 0),
    ("motor velocity 3 100 --duration 1", 6),
    ("brake engage front", 0),
    ("steer front 15", 0),
    ("steer rear -15", 0),
    ("steer front 88", 1),
    ("drive turn --rear -15 --front 15 --speed 0.3 --duration 1", 0),
    ("drive parallel --angle 0 --speed 9 --duration 1", 1),
    ("motor velocity 77 100 --duration 1", 4),
    ("estop", 0),
    ("steer front 0", 6),
    ("reset", 0),
    ("steer front 0", 0),
)
"""What a person types, and the exit codes."""


@pytest.mark.real_time
@pytest.mark.timeout(600)
@pytest.mark.parametrize("bus", ["simulated", "rs232"])
def test_the_same_commands_end_alike_over_can_and_over_a_serial_line(bus: str, tmp_path: Path) -> None:
    bench = Bench(tmp_path, bus)
    try:
        for typed, code in SEQUENCE:
            done = bench.canhelm(*typed.split())
            assert (typed, done.returncode) == (typed, code), done.stderr
        status = bench.wait_for(lambda status: status["state"] == "idle")
        assert [brake["state"] for brake in status["brakes"]] == ["engaged", "engaged"]
        assert status["vehicle"]["heading_deg"]["front"] == pytest.approx(0.0, abs=1.0)
        assert status["vehicle"]["heading_deg"]["rear"] == pytest.approx(-15.0, abs=1.0)
    finally:
        bench.end()


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Bench]:
    bench = Bench(tmp_path_factory.mktemp("bench"))
    yield bench
    bench.end()
    assert not bench.socket.exists()


@pytest.fixture
def rested(bench: Bench) -> Bench:
    """The bench, at rest and without a fault that an earlier test may have left."""
    if bench.status()["state"] != "idle":
        bench.client.call("stop")
        bench.client.call("reset")
        for node in (1, 2, 3, 4):
            bench.client.call("motor.disable", node=node)
    bench.wait_for(lambda status: status["state"] == "idle")
    return bench


def test_a_motor_is_enabled_turned_and_disabled_from_the_shell(rested: Bench) -> None:
    assert rested.canhelm("motor", "enable", "1").returncode == 0
    turned = rested.canhelm("motor", "velocity", "1", "-250", "--duration", "0.5")
    assert turned.returncode == 0
    assert json.loads(turned.stdout)["wheel_travel_m"] > 0.03
    assert rested.canhelm("motor", "disable", "1").returncode == 0


def test_status_piped_is_one_json_object(rested: Bench) -> None:
    status = json.loads(rested.canhelm("status").stdout)
    assert status["state"] == "idle"
    assert len(status["nodes"]) == 6


def test_a_brake_and_a_pair_are_moved_from_the_shell(rested: Bench) -> None:
    assert rested.canhelm("brake", "release", "front").returncode == 0
    assert rested.canhelm("brake", "engage", "front").returncode == 0
    steered = json.loads(rested.canhelm("steer", "front", "20").stdout)
    assert steered["steering_error_deg"] <= 0.2
    assert rested.canhelm("steer", "front", "0").returncode == 0


@pytest.mark.parametrize(
    ("arguments", "code"),
    [
        (("motor", "velocity", "200", "10"), 2),
        (("motor", "velocity", "99", "10", "--duration", "1"), 4),
        (("drive", "rotate", "10"), 1),
        (("steer", "front", "89"), 1),
        (("drive", "parallel", "--angle", "0", "--speed", "9", "--duration", "1"), 1),
    ],
)
def test_refused_commands_have_their_exit_codes(rested: Bench, arguments: tuple[str, ...], code: int) -> None:
    refused = rested.canhelm(*arguments)
    assert refused.returncode == code
    assert refused.stderr.startswith("canhelm: ")
    assert "Traceback" not in refused.stderr


def test_ctrl_c_in_the_middle_of_a_drive_stops_the_robot(rested: Bench) -> None:
    driving = rested.drive()
    driving.send_signal(signal.SIGINT)
    _, said = driving.communicate(timeout=TIMEOUT_S)
    assert driving.returncode == 130
    assert "stopped" in said
    assert at_rest(rested.status())


def test_a_suspended_command_loses_its_lease_and_the_robot_stops(rested: Bench) -> None:
    driving = rested.drive()
    driving.send_signal(signal.SIGSTOP)
    rested.wait_for(at_rest)
    driving.send_signal(signal.SIGCONT)
    _, said = driving.communicate(timeout=TIMEOUT_S)
    assert driving.returncode == 1
    assert "lease" in said


def test_a_killed_command_has_its_motion_stopped(rested: Bench) -> None:
    driving = rested.drive()
    driving.kill()
    driving.communicate(timeout=TIMEOUT_S)
    rested.wait_for(at_rest)


def test_stop_works_from_another_shell_without_a_lease(rested: Bench) -> None:
    driving = rested.drive()
    assert rested.canhelm("stop").returncode == 0
    assert at_rest(rested.status())
    driving.communicate(timeout=TIMEOUT_S)
    assert driving.returncode == 1


def test_the_emergency_stop_is_latched_between_shells(rested: Bench) -> None:
    assert rested.canhelm("estop").returncode == 0
    assert rested.canhelm("steer", "front", "3").returncode == 6
    rested.wait_for(at_rest)
    assert rested.canhelm("reset").returncode == 0
    assert rested.canhelm("steer", "front", "0").returncode == 0


def test_a_drive_that_loses_power_stops_the_robot_and_one_reset_recovers(rested: Bench) -> None:
    driving = rested.drive()
    assert rested.canhelm("sim", "power", "3", "off").returncode == 0
    rested.wait_for(lambda status: status["state"] == "fault" and at_rest(status))
    assert rested.canhelm("sim", "power", "3", "on").returncode == 0
    _, said = driving.communicate(timeout=TIMEOUT_S)
    assert driving.returncode == 1
    assert "front_left" in said
    rested.wait_for(lambda status: all(node["node_state"] == "ready" for node in status["nodes"]))
    assert json.loads(rested.canhelm("reset").stdout)["state"] == "idle"
    again = rested.canhelm("drive", "parallel", "--angle", "0", "--speed", "0.3", "--duration", "0.5")
    assert again.returncode == 0


def test_without_a_daemon_the_exit_code_is_three(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "daemon", "status", "--socket", str(tmp_path / "none.sock")]
    alone = subprocess.run(command, capture_output=True, text=True, timeout=TIMEOUT_S)
    assert alone.returncode == 3
    assert "canhelm run" in alone.stderr


def test_virtual_time_with_a_socket_is_refused() -> None:
    command = [sys.executable, "-m", "daemon", "run", "--simulate", "--profile", "max2d", "--virtual-time"]
    refused = subprocess.run(command, capture_output=True, text=True, timeout=TIMEOUT_S)
    assert refused.returncode == 2
    assert "virtual time" in refused.stderr
