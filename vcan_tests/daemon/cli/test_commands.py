"""Commands on a running daemon: what they send, what they print, and their exit codes."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from daemon.api.server import Server
from daemon.cli.main import main
from vcan_tests.daemon import fake_backend
from vcan_tests.daemon.cli.shell import canhelm, run
from vcan_tests.daemon.fake_backend import FakeBackend

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
    ("drive rotate -20 --duration 2 --no-wait", "drive.rotate", {"rate_deg_s": -20.0, "duration_s": 2.0}),
    ("drive to 1 -0.5 --speed 0.4", "drive.to", {"x_m": 1.0, "y_m": -0.5, "heading_deg": None, "speed_m_s": 0.4}),
    ("drive to -1 0 -90 --end-velocity 0.2 -0.1", "drive.to", {"heading_deg": -90.0, "end_vy_m_s": -0.1}),
    ("drive to 1 0 --published", "drive.to", {"planner": "published"}),
    ("nmt reset-comm all", "nmt", {"command": "reset-comm", "node": "all"}),
    ("sdo read 1 0x2078/1", "sdo.read", {"node": 1, "object": "0x2078/1"}),
    ("sdo write 1 0x6083 0x10", "sdo.write", {"value": 16}),
    ("sdo write 1 target_velocity -20", "sdo.write", {"value": -20}),
    ("sim power all off", "simulation.power", {"node": "all", "on": False}),
    ("sim slope 5 --direction 90", "simulation.slope", {"slope_deg": 5.0, "direction_deg": 90.0}),
    ("sim pace 0.25", "simulation.pace", {"factor": 0.25}),
    ("sim turn front 12.5", "simulation.turn", {"node": "front", "angle_deg": 12.5}),
    ("sim turn front", "simulation.turn", {"node": "front", "angle_deg": None}),
    (
        "sim fault silence front_left --for 2",
        "simulation.fault",
        {"kind": "silence", "part": "front_left", "for_s": 2.0},
    ),
    (
        "sim fault lose --cob-id 0x183 --probability 0.1 --at-frame 100",
        "simulation.fault",
        {"kind": "lose", "cob_id": 0x183, "probability": 0.1, "at_frame": 100},
    ),
    (
        "sim fault emcy 3 --code 0x4210 --at 1.5",
        "simulation.fault",
        {"kind": "emcy", "part": 3, "code": 0x4210, "at_s": 1.5},
    ),
    ("sim fault clock_jump --jump -3600", "simulation.fault", {"kind": "clock_jump", "jump_s": -3600.0}),
    (
        "sim fault client_flood --clients 40 --for 5",
        "simulation.fault",
        {"kind": "client_flood", "clients": 40, "for_s": 5.0},
    ),
    ("sim fault clear", "simulation.clear_faults", {"fault": None}),
    ("sim fault clear 2", "simulation.clear_faults", {"fault": 2}),
    ("sim input 3 1 low", "simulation.input", {"node": 3, "input": 1, "level": "low"}),
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
    ("motor position 1 0.5", 2, "0.5"),
    ("motor position 1 0.9 --relative", 2, "0.9"),
    ("motor home 1 --method 1.5", 2, "1.5"),
    ("demo --seed 1.9", 2, "1.9"),
    ("steer front inf", 2, "angle_deg is inf: not a finite number"),
    ("steer front 1e30", 2, "angle_deg (1e+30) is not a number from -1e15 to 1e15"),
    ("motor position 1 9876543210", 2, "give -2147483648 to 2147483647 qc"),
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


TAKEN = [
    "steer front 3 --takeover --no-wait",
    "motor velocity 1 5 --duration 0.01 --takeover",
    "drive parallel --angle 0 --speed 0.3 --duration 0.01 --takeover",
]


@pytest.mark.usefixtures("server")
@pytest.mark.parametrize("line", TAKEN)
def test_a_motion_takes_the_robot_over_where_a_person_says_so(
    backend: FakeBackend, capsys: pytest.CaptureFixture[str], line: str
) -> None:
    assert run(line) == 0
    assert capsys.readouterr().err == "canhelm: taken over from somebody\n"
    assert backend.taken == [backend.calls[0][2]]


@pytest.mark.usefixtures("server")
def test_a_motion_takes_nothing_over_unasked(backend: FakeBackend) -> None:
    assert run("steer front 3 --no-wait") == 0
    assert backend.taken == []


@pytest.mark.usefixtures("server")
def test_an_empty_argument_is_named_as_what_it_is(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["steer", "", "3"]) == 2
    assert "pair ('') is not a string of 1 to 256 printable characters - pair: front or rear" in capsys.readouterr().err


@pytest.mark.usefixtures("nobody")
@pytest.mark.parametrize("line", ["status", "stop", "motor velocity 1 5", "monitor", "sdo read 1 0x6041"])
def test_without_a_daemon_the_exit_code_is_3(capsys: pytest.CaptureFixture[str], line: str) -> None:
    assert run(line) == 3
    assert "canhelm run" in capsys.readouterr().err


def test_a_daemon_that_is_gone_from_its_socket_is_exit_code_3(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("status --socket /nonexistent/robot.sock") == 3
    assert "/nonexistent/robot.sock" in capsys.readouterr().err


@pytest.mark.parametrize("noun", ["drive", "motor", "sdo"])
def test_a_noun_alone_shows_its_help_and_is_wrong_usage(capsys: pytest.CaptureFixture[str], noun: str) -> None:
    assert run(noun) == 2
    assert f"Usage: canhelm {noun} COMMAND" in capsys.readouterr().out


@pytest.mark.usefixtures("server")
def test_an_option_that_is_empty_in_the_environment_counts_as_not_given(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CANHELM_JSON", "")
    assert run("status") == 0


@pytest.mark.parametrize("command", ["stop", "estop"])
def test_nothing_in_the_environment_keeps_anybody_from_stopping(
    server: Server, backend: FakeBackend, monkeypatch: pytest.MonkeyPatch, command: str
) -> None:
    monkeypatch.setenv("CANHELM_JSON", "maybe")
    assert (run("status"), run(command)) == (2, 0)
    assert [method for method, _, _ in backend.calls] == [command]


def test_a_long_reason_of_several_lines_still_stops_the_robot(server: Server, backend: FakeBackend) -> None:
    assert main(["estop", "--reason", "a person\n\x1b[1m" + "!" * 500]) == 0
    reason = backend.calls[-1][1]["reason"]
    assert (reason[:9], len(reason), reason.isprintable()) == ("a person ", 256, True)


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


def test_a_motion_without_an_end_says_so_on_a_terminal(
    server: Server, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    monkeypatch.setattr(fake_backend, "ENDLESS_S", 0.1)
    assert main(["drive", "rotate", "90"]) == 0
    assert "rate_deg_s 90: without --duration this goes on until Ctrl-C or" in capsys.readouterr().err
    assert main(["drive", "rotate", "90", "--duration", "1"]) == 0
    assert "without --duration" not in capsys.readouterr().err


def test_follow_streams_json_lines_and_ends_quietly_with_its_reader(server: Server) -> None:
    with canhelm("status --follow --rate 50") as process:
        assert process.stdout is not None
        assert process.stderr is not None
        lines = [json.loads(process.stdout.readline()) for _ in range(3)]
        process.stdout.close()
        assert (process.wait(10), process.stderr.read()) == (0, "")
    assert {line["robot"] for line in lines} == {"fake"}


@pytest.mark.parametrize("line", ["--help", "completion bash"])
def test_a_full_disk_is_one_sentence(line: str) -> None:
    with open("/dev/full", "w") as full:
        done = subprocess.run([sys.executable, "-m", "daemon", *line.split()], stdout=full, stderr=subprocess.PIPE)
    assert done.returncode == 1
    assert done.stderr.decode() == "canhelm: cannot write the output: No space left on device\n"


def test_who_reads_only_the_first_line_of_the_help_gets_no_failure(tmp_path: Path) -> None:
    reading, writing = os.pipe()
    os.close(reading)
    done = subprocess.run([sys.executable, "-m", "daemon", "--help"], stdout=writing, stderr=subprocess.PIPE)
    os.close(writing)
    assert (done.returncode, done.stderr) == (0, b"")


@pytest.mark.parametrize("closed", [">&-", "2>&-"])
def test_closed_outputs_fail_nothing(server: Server, backend: FakeBackend, closed: str) -> None:
    done = subprocess.run(f"{sys.executable} -m daemon stop {closed}", shell=True, capture_output=True)
    assert (done.returncode, done.stderr) == (0, b"")
    assert backend.calls[-1][0] == "stop"
