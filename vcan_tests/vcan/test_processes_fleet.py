"""Two robots on two buses, each with its simulator and its daemon."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from vcan_tests.vcan.bench import COMMAND, TIMEOUT_S, Daemon, Simulator, patient, write_profile
from vcan_tests.vcan.witness import Witness, candump

pytestmark = [pytest.mark.vcan, pytest.mark.timeout(120)]

INTERFACES = {"alpha": "vcan0", "beta": "vcan1"}


class Fleet:
    """Two robots on two buses.

    Attributes:
        daemons: of the robots, by name.
        wires: witnesses of their buses, by name.
    """

    def __init__(self, runtime: Path, stack: ExitStack) -> None:
        self.daemons: dict[str, Daemon] = {}
        self.wires: dict[str, Witness] = {}
        self._runtime = runtime
        folder = runtime / "canhelm"
        folder.mkdir()
        for name, interface in INTERFACES.items():
            profile = write_profile(folder, patient(cycle_hz=20), name)
            self.wires[name] = stack.enter_context(candump(interface, folder / f"{name}.log"))
            stack.callback(Simulator(profile, f"socketcan:{interface}").end)
            self.daemons[name] = Daemon(profile, f"socketcan:{interface}")
            stack.callback(self.daemons[name].end)
        for daemon in self.daemons.values():
            daemon.wait_for_state("idle")

    def canhelm(self, *arguments: str) -> subprocess.CompletedProcess[str]:
        """Run one command as the user whose daemons these are."""
        environment = {**os.environ, "XDG_RUNTIME_DIR": str(self._runtime)}
        return subprocess.run(
            [*COMMAND, *arguments], capture_output=True, text=True, timeout=TIMEOUT_S, env=environment
        )


@pytest.fixture(scope="module")
def fleet(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Fleet]:
    with ExitStack() as stack:
        yield Fleet(tmp_path_factory.mktemp("fleet"), stack)


def test_a_command_for_one_of_two_robots_moves_that_one_alone(fleet: Fleet) -> None:
    before = len(fleet.wires["beta"].text())
    assert fleet.canhelm("steer", "front", "10", "--robot", "alpha").returncode == 0
    headings = [daemon.status()["vehicle"]["heading_deg"]["front"] for daemon in fleet.daemons.values()]
    assert headings == pytest.approx([10.0, 0.0], abs=0.3)
    assert "203#0F00" not in fleet.wires["beta"].text()[before:]


def test_a_command_for_no_robot_in_particular_names_both(fleet: Fleet) -> None:
    asked = fleet.canhelm("steer", "front", "0")
    assert asked.returncode == 2
    assert all(name in asked.stderr for name in INTERFACES)
