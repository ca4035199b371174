"""One robot whose nodes live in two processes, as real nodes and simulated ones do on one bus."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

import pytest

from vcan_tests.vcan.bench import TIMEOUT_S, Daemon, Simulator, patient, speeds, write_profile

pytestmark = [pytest.mark.vcan, pytest.mark.timeout(120)]


@dataclass
class Mixed:
    """Who makes up the robot: the process that plays node 1, the one that plays the others, and the daemon."""

    first: Simulator
    others: Simulator
    daemon: Daemon


@pytest.fixture
def robot(tmp_path: Path) -> Iterator[Mixed]:
    profile = write_profile(tmp_path, patient())
    with ExitStack() as stack:
        first, others = Simulator(profile, nodes="1"), Simulator(profile, nodes="2,3,4,5,6")
        stack.callback(first.end)
        stack.callback(others.end)
        daemon = Daemon(profile)
        stack.callback(daemon.end)
        daemon.wait_for_state("idle")
        yield Mixed(first, others, daemon)


def test_nodes_of_two_processes_drive_together_and_stop_when_one_process_dies(robot: Mixed) -> None:
    driving = robot.daemon.begin("drive", "parallel", "--angle", "0", "--speed", "0.2", "--duration", "60")
    robot.daemon.wait_for(lambda status: min(speeds(status)) > 0.19)
    robot.first.process.kill()
    assert "node 1 (rear_right)" in robot.daemon.wait_for_state("fault")
    robot.daemon.wait_for(lambda status: max(speeds(status)[1:]) < 0.01)
    assert driving.wait(TIMEOUT_S) == 1
