"""A robot behind the serial line of one of its drives, on a pseudo terminal, beside another one on the kernel's CAN."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass

import pytest

from vcan_tests.vcan.bench import TIMEOUT_S, Bench, Daemon, Simulator, bench, patient, write_profile

pytestmark = [pytest.mark.vcan, pytest.mark.timeout(180)]

LONG_GUARDING = "network: {guard_time_ms: 5000}\n"


@dataclass
class Neighbours:
    """The daemon of a robot behind a serial line, and a robot on CAN."""

    serial: Daemon
    can: Bench


@pytest.fixture(scope="module")
def robots(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Neighbours]:
    with ExitStack() as stack:
        can = stack.enter_context(bench(tmp_path_factory.mktemp("can"), patient(cycle_hz=10)))
        profile = write_profile(tmp_path_factory.mktemp("serial"), LONG_GUARDING)
        simulator = Simulator(profile, "rs232:pty")
        stack.callback(simulator.end)
        serial = Daemon(profile, bus_of(simulator))
        stack.callback(serial.end)
        serial.wait_for_state("idle")
        yield Neighbours(serial, can)


def bus_of(simulator: Simulator) -> str:
    """The bus that the simulator tells people to use."""
    named = re.search(r"--bus (rs232:\S+)`", simulator.said)
    assert named is not None
    return named[1]


TURN_A_WHEEL = ("motor", "velocity", "rear_left", "150", "--duration", "0.5")


def test_wheels_of_both_robots_turn_at_the_same_time(robots: Neighbours) -> None:
    on_can = robots.can.daemon.begin(*TURN_A_WHEEL)
    on_line = robots.serial.canhelm(*TURN_A_WHEEL)
    assert (on_line.returncode, on_can.wait(TIMEOUT_S)) == (0, 0), on_line.stderr
    assert json.loads(on_line.stdout)["wheel_travel_m"] > 0.01


def test_what_goes_over_the_serial_line_is_not_on_the_bus_beside_it(robots: Neighbours) -> None:
    before = len(robots.can.wire.text())
    assert robots.serial.canhelm("sdo", "read", "front_left", "0x6083").returncode == 0
    assert "603#4083600000000000" not in robots.can.wire.text()[before:]
