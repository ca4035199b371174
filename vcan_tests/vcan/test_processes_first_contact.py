"""A daemon without a profile on the kernel's bus: it finds a drive, explains it and switches it on."""

from __future__ import annotations

import json
import os
import subprocess
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import pytest

from vcan_tests.vcan.bench import COMMAND, TIMEOUT_S, Simulator, write_profile

pytestmark = [pytest.mark.vcan, pytest.mark.timeout(120)]


@pytest.fixture
def socket(tmp_path: Path) -> Iterator[str]:
    path, log = str(tmp_path / "bench.sock"), tmp_path / "bench.txt"
    simulator = Simulator(write_profile(tmp_path), nodes="2")
    with log.open("w") as file:
        daemon = subprocess.Popen(
            [*COMMAND, "run", "--bus", "socketcan:vcan0", "--socket", path],
            stderr=file,
            preexec_fn=partial(os.nice, -10),
        )
    yield path
    daemon.terminate()
    assert daemon.wait(TIMEOUT_S) == 0
    simulator.end()
    assert "Traceback" not in log.read_text()


def canhelm(socket: str, *arguments: str) -> subprocess.CompletedProcess[str]:
    """One command to the daemon."""
    command = [*COMMAND, *arguments, "--socket", socket, "--json"]
    return subprocess.run(command, capture_output=True, text=True, timeout=TIMEOUT_S)


def test_a_drive_without_a_profile_is_found_and_obeys(socket: str) -> None:
    for _ in range(20):
        told = canhelm(socket, "status")
        if told.returncode == 0 and json.loads(told.stdout)["state"] == "idle":
            break
    status = json.loads(told.stdout)
    assert [(row["name"], row["firmware"]) for row in status["found"]] == [("node_2", "2011")]
    enabled = canhelm(socket, "motor", "enable", "node_2")
    assert json.loads(enabled.stdout)["state"] == "enabled"
    assert canhelm(socket, "motor", "velocity", "node_2", "502", "--duration", "1").returncode == 1
