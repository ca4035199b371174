"""The example programs, each run as its page shows it, against a daemon with a simulated robot."""

from __future__ import annotations

import json
import math
import re
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from vcan_tests.daemon.test_processes import PATIENT_PROFILE, TIMEOUT_S, Bench
from vcan_tests.shown import EXAMPLES, ROOT, alike, shown_output

pytestmark = pytest.mark.real_time

MOST_LINES = 40
SLOWEST_HZ = 50
"""What is left of 100 Hz on a machine that has other work for both of its processors."""
TWISTS = """
1 0.3 0 0
5 0.3 0 0.3
0.1 0 0 0.5
"""
"""Straight on, to the left, and on the spot."""
MOST_TURNED_DEG = math.degrees(0.3 * math.tan(math.radians(15.0)) / 0.225 * 5.5)
"""To the left at 0.3 m/s with its pairs at 15 degrees, for 5 s and the half second for which a twist is good."""


@contextmanager
def daemon(folder: Path, profile_text: str = PATIENT_PROFILE) -> Iterator[Bench]:
    """A daemon with a simulated robot, which has gone down in order afterwards."""
    bench = Bench(folder, profile_text=profile_text)
    try:
        yield bench
    finally:
        bench.end()


@pytest.fixture(scope="module")
def max2d(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Bench]:
    with daemon(tmp_path_factory.mktemp("max2d")) as bench:
        yield bench


def run(bench: Bench, *command: str, typed: str = "") -> str:
    """What a program says that ends well."""
    environment = {**bench.environment(), "PYTHONPATH": str(ROOT)}
    program = subprocess.run(
        [sys.executable, *command], input=typed, capture_output=True, text=True, timeout=TIMEOUT_S, env=environment
    )
    assert (program.returncode, program.stderr) == (0, "")
    bench.wait_for(lambda status: status["state"] == "idle")
    return program.stdout


def place(bench: Bench) -> dict[str, float]:
    found: dict[str, float] = bench.status()["vehicle"]["odometry"]
    return found


@pytest.mark.parametrize("path", [path for path in EXAMPLES.iterdir() if path.is_file()], ids=lambda path: path.name)
def test_an_example_can_be_read_at_a_glance(path: Path) -> None:
    assert len(path.read_text().splitlines()) <= MOST_LINES


def test_reading_the_state_says_what_its_page_shows(max2d: Bench) -> None:
    said = run(max2d, "examples/read_state.py")
    assert alike(said, shown_output("python examples/read_state.py"))


def test_reading_the_state_into_head_ends_quietly(max2d: Bench) -> None:
    environment = {**max2d.environment(), "PYTHONPATH": str(ROOT)}
    command = [sys.executable, "examples/read_state.py"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, env=environment) as program:
        assert program.stdout is not None
        assert program.stderr is not None
        program.stdout.readline()
        program.stdout.close()
        assert program.stderr.read() == b""
        assert program.wait(TIMEOUT_S) == 0


def test_the_loop_of_ones_own_drives_its_way_at_100_hz(max2d: Bench) -> None:
    before = place(max2d)
    said = run(max2d, "examples/own_loop.py")
    assert alike(said, shown_output("python examples/own_loop.py"))
    after = place(max2d)
    assert ((after["x_m"] - before["x_m"]) ** 2 + (after["y_m"] - before["y_m"]) ** 2) ** 0.5 == pytest.approx(
        0.5, abs=0.02
    )
    rate_hz = re.search(r"at ([\d.]+) Hz", said)
    assert rate_hz is not None
    assert SLOWEST_HZ < float(rate_hz[1]) < 101


def test_the_shells_program_says_how_it_is_called() -> None:
    called = subprocess.run(["examples/talk.sh"], cwd=ROOT, capture_output=True, text=True, timeout=TIMEOUT_S)
    assert called.returncode == 2
    assert called.stderr.startswith("usage: examples/talk.sh SOCKET")


def test_the_bridge_drives_arcs_as_twists_ask_and_tells_where_the_robot_is(max2d: Bench) -> None:
    before = place(max2d)
    said = run(max2d, "-m", "vcan_tests.fake_ros", "examples/ros2_bridge.py", typed=TWISTS.strip())
    messages = [json.loads(line) for line in said.splitlines()]
    warnings = [message["warning"] for message in messages if "warning" in message]
    assert warnings
    assert all("heading" in warning for warning in warnings)
    poses = [message["message"]["pose"]["pose"] for message in messages if message.get("topic") == "odom"]
    after = place(max2d)
    assert poses[-1]["position"]["x"] == pytest.approx(after["x_m"], abs=0.02)
    turned_deg = after["yaw_deg"] - before["yaw_deg"]
    assert 5 < turned_deg < MOST_TURNED_DEG
    health = [message["message"]["status"][0] for message in messages if message.get("topic") == "diagnostics"]
    assert {state["message"] for state in health} >= {"active"}
    assert {state["level"] for state in health} == {"00"}


@pytest.fixture
def mecanum(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Bench]:
    """A daemon with a vehicle of a kind of one's own."""
    monkeypatch.setenv("PYTHONPATH", f"{EXAMPLES}/own_vehicle")
    with daemon(tmp_path, PATIENT_PROFILE.replace("robots/max2d", f"{EXAMPLES}/own_vehicle/mecanum")) as bench:
        yield bench


def test_the_square_closes_with_a_vehicle_of_ones_own_too(mecanum: Bench) -> None:
    said = run(mecanum, "examples/square.py")
    assert alike(said, shown_output("python examples/square.py"))
    end = place(mecanum)
    assert (end["x_m"], end["y_m"], end["yaw_deg"]) == pytest.approx((0, 0, 0), abs=0.02)
    assert "mecanum:Mecanum of " in mecanum.log.read_text()


def test_a_daemon_whose_python_does_not_know_a_vehicles_class_says_where_it_is_named(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "daemon", "profile", "check", "examples/own_vehicle/mecanum.yaml"]
    checked = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=TIMEOUT_S)
    assert checked.returncode == 7
    assert "examples/own_vehicle/mecanum.yaml:7: vehicle.kind: mecanum:Mecanum cannot be imported" in checked.stderr
