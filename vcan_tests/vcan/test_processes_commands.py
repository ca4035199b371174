"""Every command that needs a daemon, typed as a person types it, and what candump sees of it."""

from __future__ import annotations

import json
import signal
from collections.abc import Iterator

import pytest

from vcan_tests.vcan.bench import Bench, bench, patient
from vcan_tests.vcan.typed_commands import TYPED

pytestmark = [pytest.mark.vcan, pytest.mark.timeout(120)]


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
