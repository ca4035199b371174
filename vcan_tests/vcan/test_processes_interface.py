"""An interface that fails while a robot drives: it goes down, or its controller goes bus-off."""

from __future__ import annotations

import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

from vcan_tests.kernel.slcan_adapter import SlcanAdapter
from vcan_tests.vcan.bench import Bench, Daemon, Simulator, Status, bench, patient, write_profile

pytestmark = [pytest.mark.vcan, pytest.mark.timeout(120)]


def link(interface: str, state: str) -> None:
    subprocess.run(["ip", "link", "set", interface, state], check=True)


def all_ready(status: Status) -> bool:
    return {node["node_state"] for node in status["nodes"]} == {"ready"}


def drives(daemon: Daemon) -> bool:
    """Whether it drives when told to."""
    driven = daemon.canhelm("drive", "parallel", "--angle", "0", "--speed", "0.2", "--duration", "0.3")
    return driven.returncode == 0


@pytest.fixture(scope="module")
def broken(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Bench]:
    """A robot whose interface went down while it drove."""
    with bench(tmp_path_factory.mktemp("down"), patient()) as made:
        made.drive(0.3)
        link("vcan0", "down")
        try:
            yield made
        finally:
            link("vcan0", "up")


def test_an_interface_that_goes_down_is_named_with_the_line_that_mends_it(broken: Bench) -> None:
    status = broken.daemon.wait_for(lambda status: status["state"] == "fault")
    assert status["bus"]["down"] == "Network is down"
    assert "ip link set vcan0 up" in status["bus"]["remedy"]


def test_a_command_meanwhile_is_refused_with_that_reason(broken: Bench) -> None:
    refused = broken.daemon.canhelm("steer", "front", "5")
    assert refused.returncode != 0
    assert "vcan0" in refused.stderr


def test_when_it_is_up_again_the_robot_boots_by_itself_and_drives_after_a_reset(broken: Bench) -> None:
    link("vcan0", "up")
    broken.daemon.wait_for(lambda status: "down" not in status["bus"] and all_ready(status))
    assert broken.daemon.canhelm("reset").returncode == 0
    assert drives(broken.daemon)


def test_a_robot_behind_an_adapter_that_went_bus_off_drives_again_after_restart_and_reset(tmp_path: Path) -> None:
    profile = write_profile(tmp_path, patient(cycle_hz=20))
    with SlcanAdapter(bit_rate=1_000_000, carries_to="vcan1") as adapter:
        simulator, daemon = Simulator(profile, "socketcan:vcan1"), Daemon(profile, "socketcan:can0")
        try:
            daemon.wait_for_state("idle")
            daemon.begin("drive", "parallel", "--angle", "0", "--speed", "0.2", "--duration", "60")
            daemon.wait_for_state("active")
            adapter.report_state("bus-off", tx_errors=255)
            status = daemon.wait_for(lambda status: status["bus"].get("down") == "bus-off")
            assert status["bus"]["bus_offs"] == 1
            daemon.wait_for_state("fault")
            adapter.down()
            adapter.up()
            daemon.wait_for(lambda status: "down" not in status["bus"] and all_ready(status))
            assert daemon.canhelm("reset").returncode == 0
            assert drives(daemon)
        finally:
            daemon.end()
            simulator.end()
