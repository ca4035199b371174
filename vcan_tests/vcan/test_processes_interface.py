"""An interface that fails while a robot drives: it goes down, or vanishes, or its controller goes bus-off."""

from __future__ import annotations

import subprocess
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

import pytest

from vcan_tests.kernel.slcan_adapter import SlcanAdapter
from vcan_tests.vcan.bench import Bench, Daemon, Simulator, Status, bench, patient, write_profile
from vcan_tests.vcan.pauses import PauseWatch, watched_for_pauses
from vcan_tests.vcan.stethoscope import (
    DRIVES,
    LIFE_GUARDING,
    at_rest_after,
    emergencies_after,
    listen,
    stop_s,
)
from vcan_tests.vcan.witness import Witness, candump

pytestmark = [pytest.mark.vcan, pytest.mark.timeout(120)]

SPEED_M_S = 0.3
GUARDED = "network: {guard_time_ms: 250, life_time_factor: 4, boot_deadline_s: 20, sdo_timeout_s: 1, cycle_hz: 10}\n"
LIFE_TIME_S, MARGIN_S = 1.0, 0.3
"""Longer than a machine's pauses."""
LISTENED_S = 2.0
RESET_S = 30.0


def link(interface: str, state: str) -> None:
    subprocess.run(["ip", "link", "set", interface, state], check=True)


def all_ready(status: Status) -> bool:
    return {node["node_state"] for node in status["nodes"]} == {"ready"}


def reset_when_ready(daemon: Daemon) -> None:
    """Reset as soon as all nodes are ready again, and once more where one restarts just then, as the answer says."""
    deadline_s = time.monotonic() + RESET_S
    while True:
        daemon.wait_for(lambda status: "down" not in status["bus"] and all_ready(status))
        done = daemon.canhelm("reset")
        if done.returncode == 0:
            return
        assert time.monotonic() < deadline_s, done.stderr


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
    reset_when_ready(broken.daemon)
    assert drives(broken.daemon)


@dataclass(frozen=True)
class Failure:
    """One way to lose a CAN controller in mid-drive.

    Attributes:
        cause: what the status calls it.
        remedy: part of what the status tells to do.
        strike: lets it happen.
        mend: does what mends it.
    """

    cause: str
    remedy: str
    strike: Callable[[SlcanAdapter], None]
    mend: Callable[[SlcanAdapter, ExitStack], object]


def plug_in(stack: ExitStack) -> SlcanAdapter:
    """An adapter that makes the interface can0; the network behind it is on vcan1."""
    return stack.enter_context(SlcanAdapter(bit_rate=1_000_000, carries_to="vcan1"))


def restart(adapter: SlcanAdapter) -> None:
    """Take the interface down and up again."""
    adapter.down()
    adapter.up()


FAILURES = {
    "interface down": Failure(
        "Network is down", "ip link set can0 up", SlcanAdapter.down, lambda adapter, _: adapter.up()
    ),
    "interface gone": Failure(
        "No such device", "ip link set can0 up", SlcanAdapter.unplug, lambda _, stack: plug_in(stack)
    ),
    "bus-off": Failure(
        "bus-off",
        "ip link set can0 down; sudo ip link set can0 up",
        lambda adapter: adapter.report_state("bus-off", tx_errors=255),
        lambda adapter, _: restart(adapter),
    ),
}


@dataclass
class AdapterBench:
    """A robot that drives, by way of an adapter.

    Attributes:
        adapter: between daemon and drives.
        daemon: of the robot.
        wire: what is on the drives' side of the adapter.
        pauses: of the machine; what it stands still is no delay of the drives.
    """

    adapter: SlcanAdapter
    daemon: Daemon
    wire: Witness
    pauses: PauseWatch

    def require_stop(self, since_s: float) -> None:
        """Each drive has missed its master since then, said so, and stood in time."""
        frames, paused_s = self.wire.frames(since_s), sum(self.pauses.between(since_s, since_s + LISTENED_S))
        for node in DRIVES:
            assert [code for code, _ in emergencies_after(frames, node, since_s)] == [LIFE_GUARDING]
            assert at_rest_after(frames, node, since_s) < stop_s(SPEED_M_S, LIFE_TIME_S) + MARGIN_S + paused_s


def begin_drive(folder: Path, stack: ExitStack) -> AdapterBench:
    """Build a robot behind an adapter and let it drive, until the stack closes."""
    profile = write_profile(folder, GUARDED)
    adapter = plug_in(stack)
    wire = stack.enter_context(candump("vcan1", folder / "candump.log"))
    pauses = stack.enter_context(watched_for_pauses(folder / "pauses"))
    simulator = Simulator(profile, "socketcan:vcan1")
    stack.callback(simulator.end)
    daemon = Daemon(profile, "socketcan:can0")
    stack.callback(daemon.end)
    daemon.wait_for_state("idle")
    Bench(profile, simulator, daemon, wire).drive(SPEED_M_S)
    return AdapterBench(adapter, daemon, wire, pauses)


@pytest.mark.parametrize("name", FAILURES)
def test_drives_behind_a_failed_interface_stop_by_life_guarding_and_drive_again_once_the_named_cause_is_mended(
    name: str, tmp_path: Path
) -> None:
    failure = FAILURES[name]
    with ExitStack() as stack:
        drive = begin_drive(tmp_path, stack)
        since_s = time.time()
        failure.strike(drive.adapter)
        listen(LISTENED_S, "vcan1")
        drive.require_stop(since_s)
        status = drive.daemon.status()
        assert (status["state"], status["bus"]["down"]) == ("fault", failure.cause)
        assert failure.remedy in status["bus"]["remedy"]
        failure.mend(drive.adapter, stack)
        reset_when_ready(drive.daemon)
        assert drives(drive.daemon)
