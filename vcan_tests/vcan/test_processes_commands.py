"""Every command that needs a daemon, typed as a person types it, and what candump sees of it."""

from __future__ import annotations

import json
import signal
from collections.abc import Iterator

import pytest
from cyclopts import App

from daemon.cli.main import COMMANDS, SETUP, build_app
from vcan_tests.vcan.bench import Bench, bench, patient

pytestmark = [pytest.mark.vcan, pytest.mark.timeout(120)]

TYPED = (
    ("status", 0, "080#"),
    ("doctor", 0, ""),
    ("record --duration 0.3", 0, "080#"),
    ("motor enable 2", 0, "202#0F00"),
    ("motor velocity 2 150 --duration 0.3", 0, "202#0F0096000000"),
    ("motor position 2 2000 --relative", 0, "602#2F606000"),
    ("motor current 2 300 --duration 0.2", 0, "602#2F606000FD"),
    ("motor step 2 300 --duration 0.3", 0, "202#0F002C010000"),
    ("motor home 2 --method 35", 0, "602#2F98600023"),
    ("motor stop 2", 0, ""),
    ("motor quick-stop 2", 0, ""),
    ("motor reset 2", 0, ""),
    ("motor disable 2", 0, "202#0000"),
    ("brake release front", 0, "603#2B78200100000000"),
    ("brake engage front", 0, "603#2B78200100100000"),
    ("brake status", 0, ""),
    ("steer front 4", 0, "603#2B78200100000000"),
    ("drive parallel --angle 0 --speed 0.3 --duration 0.5", 0, "201#0F00"),
    ("drive turn --rear -4 --front 4 --speed 0.3 --duration 0.5", 0, "201#0F00"),
    ("drive rotate 20", 1, ""),
    ("drive to 1 0", 1, ""),
    ("drive heading 5 --speed 0.2 --duration 0.3", 1, ""),
    ("drive path line --dry-run", 0, ""),
    ("stop", 0, ""),
    ("estop", 0, ""),
    ("steer front 0", 6, ""),
    ("reset", 0, ""),
    ("nodes scan --first 1 --last 8", 0, "608#40001000"),
    ("nodes find", 4, "7E5#51"),
    ("nodes store rear --yes", 0, "605#2310100173617665"),
    ("nodes restore rear --yes", 0, "605#231110016C6F6164"),
    ("nodes set-id rear 7 --yes", 0, "7E5#1107"),
    ("nodes set-id 7 5 --yes", 0, "7E5#1105"),
    ("nodes set-bit-rate rear 1000000 --yes", 0, "7E5#1300"),
    ("nmt stop 3", 0, "000#0203"),
    ("nmt preop 3", 0, "000#8003"),
    ("nmt start 3", 0, "000#0103"),
    ("nmt reset-comm 3", 0, "000#8203"),
    ("nmt reset 3", 0, "000#8103"),
    ("sdo read 1 statusword", 0, "601#40416000"),
    ("sdo write 1 profile_acceleration 4000", 0, "601#23836000A00F0000"),
    ("sdo read 9 statusword", 4, "609#40416000"),
    ("config dump 1 {folder}/node-1.dcf", 0, "601#4083600000000000"),
    ("config diff 1 {folder}/node-1.dcf", 0, "601#4083600000000000"),
    ("config apply 1 {folder}/node-1.dcf", 0, ""),
    ("config backup {folder}/settings", 0, "604#4083600000000000"),
    ("config restore {folder}/settings 1 --yes", 0, ""),
    ("sim power 3 off", 1, ""),
    ("sim input 3 1 low", 1, ""),
    ("sim turn front 5", 1, ""),
    ("sim lift on", 1, ""),
    ("sim hand front_left 10", 1, ""),
    ("sim look", 1, ""),
    ("encoder status front", 0, ""),
    ("encoder zero front --yes", 0, "606#40046000"),
    ("nxt line 0.1", 1, ""),
    ("nxt bend 0.1 0.1", 1, ""),
    ("nxt goto 0.1 0.1", 1, ""),
    ("nxt moves", 1, ""),
    ("nxt stop", 0, ""),
    ("nxt battery", 1, ""),
    ("nxt info", 1, ""),
)
"""What is typed, in this order, its exit code, and the beginning of a frame that it brings."""


@pytest.fixture(scope="module")
def robot(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Bench]:
    with bench(tmp_path_factory.mktemp("commands"), patient()) as made:
        yield made


@pytest.mark.parametrize(("typed", "code", "frame"), TYPED, ids=[typed for typed, _, _ in TYPED])
def test_a_command_ends_with_its_exit_code_and_has_been_on_the_wire(
    robot: Bench, typed: str, code: int, frame: str
) -> None:
    robot.daemon.leave_fault()
    before = len(robot.wire.text())
    done = robot.daemon.canhelm(*typed.format(folder=robot.profile.parent).split())
    assert done.returncode == code, done.stderr
    assert robot.wire.comes_to_show(f" {frame}", begin=before)


def test_the_monitor_shows_one_status_after_the_other_until_ctrl_c(robot: Bench) -> None:
    monitor = robot.daemon.begin("monitor", "--rate", "20")
    assert monitor.stdout is not None
    states = [json.loads(monitor.stdout.readline())["robot"] for _ in range(3)]
    monitor.send_signal(signal.SIGINT)
    monitor.communicate(timeout=30)
    assert (states, monitor.returncode) == (["max2d"] * 3, 130)


def test_a_drive_is_recorded_until_ctrl_c(robot: Bench) -> None:
    path = robot.profile.with_name("driven.csv")
    recording = robot.daemon.begin("drive", "record", str(path))
    assert recording.stderr is not None
    assert "Ctrl-C" in recording.stderr.readline()
    recording.send_signal(signal.SIGINT)
    recording.communicate(timeout=30)
    assert path.exists()


def test_no_command_that_needs_a_daemon_is_left_out() -> None:
    tested = {typed.partition(" -")[0] for typed, _, _ in TYPED} | {"monitor", "drive record"}
    missing = [verb for verb in verbs_for_a_daemon(build_app()) if not any(line.startswith(verb) for line in tested)]
    assert missing == []


def verbs_for_a_daemon(app: App, said: str = "") -> Iterator[str]:
    """The commands that take ``--socket``, but for the one that listens on it."""
    for name in app:
        command = app[name]
        if name.startswith("-") or name in COMMANDS[SETUP]:
            continue
        verb = f"{said} {name}".strip()
        if command.default_command is None:
            yield from verbs_for_a_daemon(command, verb)
        elif any("--socket" in argument.names for argument in command.assemble_argument_collection()):
            yield verb
