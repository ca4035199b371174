"""``canhelm nxt``: what its commands send; a simulated brick as a process; what is refused."""

from __future__ import annotations

import asyncio
import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import msgspec
import pytest

from canhelm.errors import UsageError
from daemon.cli.main import main
from daemon.cli.make_safe import stop_bricks
from daemon.wires import make_wire
from drivers.bus.no_bus import NoBus
from drivers.nxt import requests
from drivers.nxt.codes import Output, OutputMode, Regulation, RunState
from drivers.simulated.nxt_link import simulated_brick
from profiles.loader import load
from vcan_tests.daemon.fake_backend import FakeBackend, served

NXT, MAX2D = load("nxt").profile, load("max2d").profile
TIMEOUT_S = 20


@pytest.fixture
def backend(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[FakeBackend]:
    made = FakeBackend()
    with served(made, tmp_path / "robot.sock") as server:
        monkeypatch.setenv("CANHELM_SOCKET", os.fspath(server.path))
        yield made


SENT: list[tuple[list[str], str, dict[str, Any]]] = [
    (["line", "-0.5", "--power", "30"], "nxt.line", {"distance_m": -0.5, "power": 30.0, "feedback": False}),
    (["line", "1", "--feedback", "--speed", "0.1"], "nxt.line", {"feedback": True, "speed_m_s": 0.1}),
    (["bend", "0.2", "90"], "nxt.bend", {"radius_m": 0.2, "angle_deg": 90.0, "side": "left", "backward": False}),
    (["bend", "0", "45", "--right", "--backward"], "nxt.bend", {"side": "right", "backward": True}),
    (["goto", "0.1", "-0.1", "-90"], "nxt.goto", {"y_m": -0.1, "heading_deg": -90.0, "feedback": True}),
    (["goto", "1", "0", "--open-loop", "--compensate"], "nxt.goto", {"feedback": False, "compensate": True}),
    (["goto", "1", "0", "--gains", "report", "--timeout", "5"], "nxt.goto", {"gains": "report", "timeout_s": 5.0}),
    (["goto", "1", "0", "--tolerance", "0.01", "--tolerance-deg", "5"], "nxt.goto", {"tolerance_deg": 5.0}),
    (["moves", "line 0.5", "bend 0.2 90 right"], "nxt.moves", {"moves": ["line 0.5", "bend 0.2 90 right"]}),
    (["stop"], "stop", {}),
    (["battery"], "nxt.battery", {"brick": None}),
    (["info", "hand"], "nxt.info", {"brick": "hand"}),
]


@pytest.mark.parametrize(("words", "method", "params"), SENT, ids=[" ".join(words) for words, _, _ in SENT])
def test_a_command_sends_its_method(
    backend: FakeBackend, words: list[str], method: str, params: dict[str, Any]
) -> None:
    assert main(["nxt", *words]) == 0
    sent, given, _ = backend.calls[-1]
    assert sent == method
    assert params.items() <= given.items()


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["line", "1", "--tolerance", "0.01"], "--tolerance has no effect open loop"),
        (["goto", "1", "0", "--open-loop", "--timeout", "5"], "--timeout has no effect open loop"),
        (["moves", "line 1", "--gains", "report"], "--gains has no effect open loop"),
        (["bend", "0.2", "90", "--feedback", "--compensate"], "--compensate has no effect under feedback"),
        (["goto", "1", "0", "--power", "30"], "--power has no effect under feedback"),
    ],
)
def test_an_option_without_effect_is_wrong_usage(
    backend: FakeBackend, capsys: pytest.CaptureFixture[str], words: list[str], told: str
) -> None:
    assert main(["nxt", *words]) == 2
    assert told in capsys.readouterr().err
    assert not backend.calls


# Ways to a brick


@pytest.mark.parametrize("spec", ["serial:/dev/rfcomm9", "usb", "none"])
def test_a_robot_of_a_brick_only_needs_no_can(spec: str) -> None:
    wire = make_wire(spec, NXT, 0)
    assert isinstance(wire.bus, NoBus)
    assert set(wire.bricks) == {"nxt"}


@pytest.mark.parametrize(
    ("spec", "robot", "reason"),
    [
        ("serial:/dev/rfcomm0", "max2d", "has nodes on one"),
        ("none", "max2d", "has nodes on one"),
        ("serial:", "nxt", "is no way to an NXT brick"),
        ("serial:/dev/null", "nxt", "is no serial device"),
        ("rs232:/dev/ttyS9", "nxt", "no EPOS"),
    ],
)
def test_a_way_that_does_not_fit_the_robot_is_refused(spec: str, robot: str, reason: str) -> None:
    with pytest.raises(UsageError, match=reason) as refused:
        make_wire(spec, load(robot).profile, 0)
    assert refused.value.remedy


def test_one_way_to_two_bricks_is_refused() -> None:
    motor = msgspec.structs.replace(NXT.bricks["nxt"].motors["right"], output="A")
    other = msgspec.structs.replace(NXT.bricks["nxt"], motors={"arm": motor})
    two = msgspec.structs.replace(NXT, bricks={**NXT.bricks, "other": other})
    with pytest.raises(UsageError, match="there are 2"):
        make_wire("usb", two, 0)
    assert set(make_wire("none", two, 0).bricks) == {"nxt", "other"}


# A brick without its daemon


async def test_motors_that_a_killed_daemon_has_left_running_are_stopped(capsys: pytest.CaptureFixture[str]) -> None:
    twin = simulated_brick(NXT, "nxt", 0)
    twin.power_on()
    order = requests.SetOutputState(Output.B, 50, OutputMode.MOTOR_ON, Regulation.IDLE, 0, RunState.RUNNING, 0)
    twin.brick.motors[Output.B].set_output(order)
    await asyncio.sleep(1.0)
    await stop_bricks({"nxt": twin.link.connect})
    await asyncio.sleep(0.5)
    twin.brick.catch_up()
    assert abs(twin.brick.motors[Output.B].speed_rad_s) < 0.05
    assert "motors of brick nxt are stopped" in capsys.readouterr().err


async def test_a_brick_that_is_out_of_reach_does_not_hold_up_the_clean_up(capsys: pytest.CaptureFixture[str]) -> None:
    await stop_bricks({"nxt": simulated_brick(NXT, "nxt", 0).link.connect})
    assert "cannot be reached" in capsys.readouterr().err


# canhelm simulate


def test_a_simulated_brick_runs_as_a_process_of_its_own() -> None:
    command = [sys.executable, "-m", "daemon", "simulate", "--profile", "nxt", "--bus", "serial:pty"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        said = json.loads(process.stdout.readline())
        fd = os.open(said["device"], os.O_RDWR | os.O_NOCTTY)
        os.write(fd, bytes.fromhex("0200000b"))
        assert os.read(fd, 7) == bytes.fromhex("0500020b00") + (8000).to_bytes(2, "little")
        os.close(fd)
        process.send_signal(signal.SIGTERM)
        assert process.wait(TIMEOUT_S) == 0


def test_a_robot_without_a_brick_has_no_terminal_for_one(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["simulate", "--profile", "max2d", "--bus", "serial:pty"]) == 2
    assert "has 0 NXT bricks" in capsys.readouterr().err
