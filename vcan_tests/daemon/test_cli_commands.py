"""Commands on a running daemon: what they send, what they print, and their exit codes."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from canhelm import protocol
from daemon.api.server import Server
from daemon.cli.main import main
from vcan_tests.daemon.fake_backend import FakeBackend, served


@pytest.fixture
def backend() -> FakeBackend:
    return FakeBackend()


@pytest.fixture
def server(backend: FakeBackend, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Server]:
    with served(backend, tmp_path / "robot.sock") as server:
        monkeypatch.setenv("CANHELM_SOCKET", os.fspath(server.path))
        yield server


@pytest.fixture
def nobody(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """No daemon runs anywhere."""
    monkeypatch.delenv("CANHELM_SOCKET", raising=False)
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    monkeypatch.setattr(protocol, "SYSTEM_FOLDER", tmp_path / "no-system")


def run(line: str) -> int:
    return main(line.split())


def canhelm(line: str) -> subprocess.Popen[str]:
    command = [sys.executable, "-m", "daemon", *line.split()]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


# -- what is sent -----------------------------------------------------------------------------------------------------

SENT: list[tuple[str, str, dict[str, Any]]] = [
    ("stop", "stop", {}),
    ("estop --reason test", "estop", {"reason": "test"}),
    ("reset", "reset", {}),
    ("motor enable 1", "motor.enable", {"node": 1}),
    ("motor disable front_left", "motor.disable", {"node": "front_left"}),
    ("motor quick-stop 0x03", "motor.quick_stop", {"node": 3}),
    ("motor velocity 1 -250 --duration 0.01", "motor.velocity", {"velocity_rpm": -250.0, "duration_s": 0.01}),
    ("motor velocity 1 -0.3 --wheel --duration 0.01", "motor.velocity", {"wheel_speed_m_s": -0.3}),
    ("motor velocity 1 5 --duration 2 --no-wait", "motor.velocity", {"wait": False}),
    ("motor position 1 -2000 --relative --no-wait", "motor.position", {"position_qc": -2000, "relative": True}),
    ("motor current 1 -300 --duration 0.01", "motor.current", {"current_ma": -300.0}),
    ("motor home 1 --method -3 --no-wait", "motor.home", {"method": -3}),
    ("motor step 1 -500 --duration 0.01", "motor.step", {"velocity_rpm": -500.0, "duration_s": 0.01}),
    ("brake engage", "brake.engage", {"pair": "all"}),
    ("brake release front", "brake.release", {"pair": "front", "force": False}),
    ("steer front -30.5 --no-wait", "steer", {"pair": "front", "angle_deg": -30.5}),
    (
        "drive turn --rear -10 --front 1e1 --speed -.3 --duration 0.01",
        "drive.turn",
        {"rear_deg": -10.0, "front_deg": 10.0, "speed_m_s": -0.3},
    ),
    ("drive parallel --angle -5 --speed 0.3 --duration 0.01", "drive.parallel", {"angle_deg": -5.0}),
    ("drive rotate -20 --no-wait", "drive.rotate", {"rate_deg_s": -20.0}),
    ("nmt reset-comm all", "nmt", {"command": "reset-comm", "node": "all"}),
    ("sdo read 1 0x2078/1", "sdo.read", {"node": 1, "object": "0x2078/1"}),
    ("sdo write 1 0x6083 0x10", "sdo.write", {"value": 16}),
    ("sdo write 1 target_velocity -20", "sdo.write", {"value": -20}),
    ("sim power all off", "simulation.power", {"node": "all", "on": False}),
]


@pytest.mark.parametrize(("line", "method", "params"), SENT, ids=[line for line, _, _ in SENT])
def test_a_command_sends_its_method(
    server: Server, backend: FakeBackend, line: str, method: str, params: dict[str, Any]
) -> None:
    assert run(line) == 0
    sent, given, _ = backend.calls[-1]
    assert sent == method
    assert params.items() <= given.items()


# -- exit codes -------------------------------------------------------------------------------------------------------

CODES = [
    ("motor enable 8", 1, "9000 rpm is beyond the limit (limit: 8000 rpm) - ask for less"),
    ("motor reset 1", 1, "failed inside the daemon"),
    ("motor enable 0", 2, "node id 0 is out of range"),
    ("motor enable 200", 2, "1 to 127"),
    ("motor enable -5", 2, "node id -5"),
    ("motor enable 1.5", 2, "no node"),
    ("motor velocity 1", 2, "VALUE"),
    ("motor velocity 1 fast", 2, "fast"),
    ("motor velocity 1 nan", 2, "finite"),
    ("motor velocity 1 5 --no-wait", 2, "cannot be handed over"),
    ("motr", 2, "motor"),
    ("drive turn --speed 1", 2, "--rear"),
    ("steer front 500", 2, "-180"),
    ("nmt start 0", 2, "1 to 127"),
    ("status --colour", 2, "--colour"),
    ("motor enable 7", 4, "node 7 does not answer - check its power"),
    ("motor enable 9", 6, "emergency stop"),
]


@pytest.mark.parametrize(("line", "code", "told"), CODES, ids=[line for line, _, _ in CODES])
def test_a_failure_has_its_exit_code_and_a_sentence_on_stderr(
    server: Server, capsys: pytest.CaptureFixture[str], line: str, code: int, told: str
) -> None:
    assert run(line) == code
    out, err = capsys.readouterr()
    assert (out, told in err, "Traceback" in err) == ("", True, False)


@pytest.mark.usefixtures("nobody")
@pytest.mark.parametrize("line", ["status", "stop", "motor velocity 1 5", "monitor", "sdo read 1 0x6041"])
def test_without_a_daemon_the_exit_code_is_3(capsys: pytest.CaptureFixture[str], line: str) -> None:
    assert run(line) == 3
    assert "canhelm run" in capsys.readouterr().err


def test_a_daemon_that_is_gone_from_its_socket_is_exit_code_3(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("status --socket /nonexistent/robot.sock") == 3
    assert "/nonexistent/robot.sock" in capsys.readouterr().err


# -- what is printed --------------------------------------------------------------------------------------------------


def test_status_off_a_terminal_is_one_json_object(server: Server, capsys: pytest.CaptureFixture[str]) -> None:
    run("status")
    status = json.loads(capsys.readouterr().out)
    assert (status["robot"], status["nodes"][0]["velocity_rpm"]) == ("fake", None)


def test_json_can_be_asked_for_by_the_environment(
    server: Server, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("CANHELM_JSON", "false")
    run("status")
    assert "rear_right" in capsys.readouterr().out.splitlines()[2]


def test_a_command_that_is_handed_over_prints_the_id(server: Server, capsys: pytest.CaptureFixture[str]) -> None:
    run("motor velocity 1 5 --duration 2 --no-wait")
    assert json.loads(capsys.readouterr().out) == {"motion": "1"}


def test_follow_streams_json_lines_and_ends_quietly_with_its_reader(server: Server) -> None:
    with canhelm("status --follow --rate 50") as process:
        assert process.stdout is not None
        assert process.stderr is not None
        lines = [json.loads(process.stdout.readline()) for _ in range(3)]
        process.stdout.close()
        assert (process.wait(10), process.stderr.read()) == (0, "")
    assert {line["robot"] for line in lines} == {"fake"}


def test_status_loads_none_of_the_daemons_libraries(server: Server) -> None:
    code = "import sys; from daemon.cli.main import main; main(['status']); print(*sys.modules, file=sys.stderr)"
    told = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stderr
    loaded = {name.split(".")[0] for name in told.split()}
    assert not loaded & {"can", "canopen", "numpy", "msgspec", "yaml", "rich", "drivers", "profiles"}


# -- interruption -----------------------------------------------------------------------------------------------------


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


# -- help -------------------------------------------------------------------------------------------------------------

NOUNS = ("motor", "brake", "drive", "nmt", "sdo", "sim")
WITH_EXAMPLES = {" ".join(line.split()[: 1 + (line.split()[0] in NOUNS)]) for line, _, _ in SENT}
WITH_EXAMPLES |= {"status", "monitor", "doctor", "version", "completion", "explain", "run", "demo"}


@pytest.mark.parametrize("command", sorted(WITH_EXAMPLES))
def test_every_command_helps_with_an_example(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(f"{command} --help") == 0
    assert f"Example: canhelm {command}" in capsys.readouterr().out


def test_day_to_day_verbs_come_first_in_the_help(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("-h") == 0
    text = capsys.readouterr().out
    assert "Stop everything now" in text
    assert text.index("stop") < text.index("status") < text.index("steer") < text.index("nmt") < text.index("demo")


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_completion_knows_the_verbs(shell: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(f"completion {shell}") == 0
    assert "quick-stop" in capsys.readouterr().out


def test_version_names_the_api(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("version") == 0
    assert json.loads(capsys.readouterr().out)["api_version"] == protocol.API_VERSION
