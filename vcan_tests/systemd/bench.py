"""A robot as a service in the guest: its unit under systemd, its simulated network as another, and who looks on."""

from __future__ import annotations

import asyncio
import math
import os
import shutil
import signal
import socket
import struct
import subprocess
import time
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import canhelm
from canhelm.client import Client
from drivers.epos.objects import OBJECTS
from drivers.epos.state_machine import state_of
from profiles.loader import load

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT / "dist" / f"canhelm_{canhelm.__version__}_amd64.deb"
BUS = "vcan0"
BUS_SPEC = f"socketcan:{BUS}"
SERVICE = "canhelm@max2d.service"
SOCKET_UNIT = "canhelm@max2d.socket"
SIMULATOR = "simulator.service"
SOCKET = Path("/run/canhelm/max2d.sock")
PROFILE = Path("/etc/canhelm/robots/max2d.yaml")
SETTINGS = Path("/etc/canhelm/max2d.env")
PATIENT = """\
schema_version: 1
extends: robots/max2d
network: {cycle_hz: 10, guard_time_ms: 1000, life_time_factor: 4, boot_deadline_s: 20, sdo_timeout_s: 1}
"""
"""Few cycles, and patience that outlives the pauses of a loaded machine: after one, a simulated network has to compute
what has happened meanwhile, and answers late. How fast it works is proven elsewhere."""
WITHIN_S = 60.0
"""Time that anything may take, on a machine that has other work as well."""


def tell(*command: str, user: str = "root") -> subprocess.CompletedProcess[str]:
    """Run a command to its end, whatever that is."""
    switch = () if user == "root" else ("runuser", "-u", user, "--")
    return subprocess.run([*switch, *command], capture_output=True, text=True, timeout=WITHIN_S)


def told(*command: str) -> str:
    """What a command prints that has to succeed."""
    ended = tell(*command)
    assert ended.returncode == 0, (command, ended.stdout, ended.stderr)
    return ended.stdout.strip()


async def until(condition: Callable[[], object], within_s: float = WITHIN_S) -> None:
    """Wait for what other processes do."""
    loop = asyncio.get_running_loop()
    deadline = loop.time() + within_s
    while not condition():
        assert loop.time() < deadline, told("journalctl", "--unit", SERVICE, "--lines=40", "--output=cat")
        await asyncio.sleep(0.1)


class Journal:
    """What a unit has said, and systemd about it, since this object was made."""

    def __init__(self, unit: str = SERVICE) -> None:
        self._unit = unit
        self._since = f"--since=@{time.time():.6f}"

    def read(self, *options: str) -> str:
        """The lines, without time and host unless the options say otherwise."""
        told("journalctl", "--sync")
        return told("journalctl", "--unit", self._unit, self._since, "--quiet", "--output=cat", *options)

    async def has(self, text: str, *options: str) -> None:
        """Wait until it was said; what a service writes reaches the journal a little later."""
        await until(lambda: text in self.read(*options))


class Robot:
    """The robot max2d as a service, on ``vcan0``, with its simulated network beside it."""

    async def make_idle(self) -> None:
        """Up, with all nodes, at rest, nothing latched; begins anew unless it is so already."""
        if not (self._as_installed() and self._is_idle()):
            self._set_up()
            await self.begin()

    async def begin(self) -> None:
        """Switch the motor power on, if it is not, and start the service; returns when it is idle."""
        if not self._has_all_nodes():
            self.switch_off()
            self.simulate()
        told("systemctl", "start", SERVICE)
        self._watch_until_idle()
        await self.until_state("idle")

    def _watch_until_idle(self) -> None:
        """Listen to the daemon: to ask systemd again and again would keep the one processor from what is waited for."""
        deadline_s = time.monotonic() + WITHIN_S
        with Client(SOCKET) as client:
            for method, status in client.notifications():
                if method == "status" and status["state"] == "idle":
                    return
                assert time.monotonic() < deadline_s, (method, status)

    def clear(self) -> None:
        """Neither service nor network run; package, settings and profile are as they should be."""
        self.switch_off()
        self._set_up()

    def _set_up(self) -> None:
        if not self._as_installed():
            self.switch_off()
            told("dpkg", "--install", str(PACKAGE))
        tell("systemctl", "stop", SERVICE, SOCKET_UNIT)
        tell("systemctl", "reset-failed")
        PROFILE.write_text(PATIENT)
        SETTINGS.write_text(f"CANHELM_BUS={BUS_SPEC}\n")

    def _as_installed(self) -> bool:
        version = tell("dpkg-query", "--show", "--showformat=${db:Status-Status} ${Version}", "canhelm").stdout
        return version == f"installed {canhelm.__version__}" and shutil.which("canhelm") is not None

    def _is_idle(self) -> bool:
        if not PROFILE.exists() or PROFILE.read_text() != PATIENT or self.show("ActiveState") != "active":
            return False
        return self.show("StatusText") == "idle" and self.show("ActiveState", SIMULATOR) == "active"

    def _has_all_nodes(self) -> bool:
        return (self.show("ActiveState", SIMULATOR), self.show("Description", SIMULATOR)) == ("active", _described())

    # -- the network ----------------------------------------------------------------------------------------------

    def simulate(self, *options: str, bus: str = BUS_SPEC) -> None:
        """Switch the motor power on: the nodes begin to boot."""
        properties = ("--property=Nice=-10", f"--property=Description={_described(*options, bus=bus)}")
        run = ("systemd-run", "--quiet", "--collect", f"--unit={SIMULATOR}", *properties)
        told(*run, "/usr/bin/canhelm", "simulate", "--profile", "max2d", "--bus", bus, *options)

    def switch_off(self) -> None:
        """Take the motor power away."""
        tell("systemctl", "kill", "--signal=KILL", SIMULATOR)
        tell("systemctl", "stop", SIMULATOR)

    def read(self, node: int, name: str) -> int:
        """An object of a drive, read over the bus as anybody could."""
        entry = OBJECTS[name]
        with socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW) as bus:
            bus.setsockopt(socket.SOL_CAN_RAW, socket.CAN_RAW_FILTER, struct.pack("=II", 0x580 + node, 0x7FF))
            bus.bind((BUS,))
            bus.settimeout(WITHIN_S)
            request = struct.pack("<BHB4x", 0x40, entry.index, entry.sub)
            bus.send(struct.pack("=IB3x8s", 0x600 + node, 8, request))
            return int.from_bytes(bus.recv(16)[12:16], "little")

    def powered(self) -> list[str]:
        """Drives whose power stages are on, by their own words."""
        states = {name: state_of(self.read(drive.node, "statusword")) for name, drive in _MAX2D.drives.items()}
        return [name for name, state in states.items() if state is None or state.power_stage_on]

    def released(self) -> list[str]:
        """Steering brakes whose coils are energised: an output sinks current where its bit is 0."""
        words = {
            name: self.read(_MAX2D.drives[brake.drive].node, "digital_output_functions_state")
            for name, brake in _MAX2D.brakes.items()
        }
        return [name for name, word in words.items() if not word >> _MAX2D.brakes[name].output_bit & 1]

    # -- the service ----------------------------------------------------------------------------------------------

    def show(self, what: str, unit: str = SERVICE) -> str:
        """A property of a unit."""
        return told("systemctl", "show", "--property", what, "--value", unit)

    @property
    def pid(self) -> int:
        """The daemon's process."""
        return int(self.show("MainPID"))

    @property
    def restarts(self) -> int:
        """How often systemd has started it again by itself."""
        return int(self.show("NRestarts"))

    def entered_active_s(self) -> float:
        """When it became ready last, wall-clock time [s]."""
        micros = tell("systemctl", "show", "--property=ActiveEnterTimestamp", "--timestamp=us+utc", "--value", SERVICE)
        return datetime.strptime(micros.stdout.strip(), "%a %Y-%m-%d %H:%M:%S.%f UTC").replace(tzinfo=UTC).timestamp()

    def send(self, number: signal.Signals) -> None:
        """Send the daemon a signal, and nobody else."""
        os.kill(self.pid, number)

    def call(self, method: str, **params: Any) -> dict[str, Any]:
        """Call a method of its API."""
        with Client(SOCKET) as client:
            return client.call(method, **params)

    def status(self) -> dict[str, Any]:
        """What `canhelm status` gets."""
        return self.call("status")

    async def until_state(self, state: str) -> None:
        """Wait for a state of the vehicle."""
        await until(lambda: self.show("StatusText") == state)

    async def drive(self, speed_m_s: float = 0.3) -> None:
        """Begin to drive for a long time; returns at speed."""
        self.call("drive.parallel", angle_deg=0.0, speed_m_s=speed_m_s, duration_s=600.0, wait=False)
        await until(lambda: self.speed_m_s() > 0.9 * speed_m_s)

    async def turn_front_pair(self) -> None:
        """Begin to turn a pair of wheels by much, away from where it stands; returns while it turns."""
        heading_deg = self.status()["vehicle"]["heading_deg"]["front"]
        self.call("steer", pair="front", angle_deg=math.copysign(80.0, -heading_deg), wait=False)
        await until(self._turns_a_pair)

    def _turns_a_pair(self) -> bool:
        status = self.status()
        return _fastest_m_s(status) > 0.02 and "released" in _brakes(status)

    def brakes(self) -> list[str]:
        """States of the steering brakes, by the daemon's words."""
        return _brakes(self.status())

    def speed_m_s(self) -> float:
        """The fastest wheel's speed."""
        return _fastest_m_s(self.status())


def _brakes(status: dict[str, Any]) -> list[str]:
    return [brake["state"] for brake in status["brakes"]]


def _fastest_m_s(status: dict[str, Any]) -> float:
    return max(abs(float(node["speed_m_s"])) for node in status["nodes"] if "speed_m_s" in node)


def _described(*options: str, bus: str = BUS_SPEC) -> str:
    """The description of the unit in which a network is simulated."""
    return " ".join((*options, "max2d on", bus))


_MAX2D = load("max2d").profile


class Witness:
    """``candump`` on ``vcan0``, with the kernel's times; its frames can be read when it has ended.

    Attributes:
        frames: wall-clock time [s], identifier and data of each.
    """

    def __init__(self, folder: Path) -> None:
        self.frames: list[tuple[float, int, bytes]] = []
        self._log = folder / "witness.log"

    def __enter__(self) -> Witness:
        with self._log.open("w") as log:
            self._process = subprocess.Popen(["candump", "-L", BUS], stdout=log)
        return self

    def __exit__(self, *_: object) -> None:
        self._process.terminate()
        self._process.wait()
        for line in self._log.read_text().splitlines():
            stamp, _interface, frame = line.split()
            can_id, _hash, data = frame.partition("#")
            if not data.startswith("R"):
                self.frames.append((float(stamp.strip("()")), int(can_id, 16), bytes.fromhex(data)))

    def answered_s(self, node: int, name: str, after_s: float) -> list[float]:
        """When a drive confirmed that an object was written, by SDO; later than a moment."""
        entry = OBJECTS[name]
        confirmation = struct.pack("<BHB", 0x60, entry.index, entry.sub)
        return [
            stamp_s
            for stamp_s, can_id, data in self.frames
            if can_id == 0x580 + node and data.startswith(confirmation) and stamp_s > after_s
        ]

    def written(self, node: int, name: str, before_s: float) -> int:
        """The value last written to an object of a drive, by SDO, before a moment."""
        entry = OBJECTS[name]
        address = struct.pack("<HB", entry.index, entry.sub)
        values = [
            int.from_bytes(data[4:], "little")
            for stamp_s, can_id, data in self.frames
            if can_id == 0x600 + node and data[:1] != b"\x40" and data[1:4] == address and stamp_s < before_s
        ]
        return values[-1]
