"""The service with a robot behind a serial port: its sandbox lets it to the port by the drop-in, and not without."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from vcan_tests.systemd.bench import PROFILE, SERVICE, SETTINGS, Journal, Robot, tell, told, until

pytestmark = [pytest.mark.systemd, pytest.mark.timeout(240)]

PORT, FAR_END = "/dev/ttyS0", "/dev/ttyS1"
EXAMPLE = Path("/usr/share/doc/canhelm/examples/serial.conf")
DROP_INS = Path("/etc/systemd/system/canhelm@.service.d")
LINE = "serial-line.service"
CARRY = """
import os, select, sys, tty
ends = [os.open(name, os.O_RDWR | os.O_NOCTTY) for name in sys.argv[1:]]
for end in ends:
    tty.setraw(end)
while True:
    for end in select.select(ends, [], [])[0]:
        os.write(ends[1 - ends.index(end)], os.read(end, 4096))
"""
"""Joins the far end of the cable with the pseudo terminal of a simulated robot."""


@pytest.fixture
async def port() -> Path:
    """A serial port with a robot at its other end, for the group dialout as udev has it; the service is set to it."""
    robot = Robot()
    robot.clear()
    tell("systemctl", "stop", LINE)
    told("sh", "-c", f"echo CANHELM_BUS=rs232:{PORT} >{SETTINGS}")
    told("sh", "-c", f"echo 'network: {{guard_time_ms: 5000}}' >>{PROFILE}; sed -i /cycle_hz/d {PROFILE}")
    told("chgrp", "dialout", PORT)
    told("chmod", "660", PORT)
    journal = Journal("simulator.service")
    robot.simulate(bus="rs232:pty")
    await journal.has("the network runs")
    (terminal,) = re.findall(r"--bus rs232:(\S+)@", journal.read())
    told("systemd-run", "--quiet", "--collect", f"--unit={LINE}", sys.executable, "-c", CARRY, FAR_END, terminal)
    return Path(PORT)


@pytest.fixture
def drop_in(port: Path) -> Iterator[Path]:
    """The drop-in, as people put it in."""
    told("install", "-D", "--mode=644", str(EXAMPLE), str(DROP_INS / EXAMPLE.name))
    told("systemctl", "daemon-reload")
    yield DROP_INS / EXAMPLE.name
    tell("systemctl", "stop", SERVICE)  # first: a closed serial port of a guest that is written to goes deaf
    told("rm", "--recursive", str(DROP_INS))
    told("systemctl", "daemon-reload")


@pytest.mark.usefixtures("drop_in")
async def test_with_the_drop_in_a_robot_behind_a_serial_port_drives_and_is_stopped() -> None:
    robot, journal = Robot(), Journal()
    told("systemctl", "start", SERVICE)
    await robot.until_state("idle")
    told("canhelm", "drive", "parallel", "--angle", "0", "--speed", "0.1", "--duration", "0.5")
    told("systemctl", "stop", SERVICE)
    await journal.has("4 of 4 drives are stopped and off, their brakes engaged")


async def test_without_the_drop_in_the_port_is_named_with_what_to_look_for(port: Path) -> None:
    told("systemctl", "start", SERVICE)
    await until(lambda: f"cannot open serial device {port}" in Robot().show("StatusText"))
