"""The kernel that runs this process, where it has vcan and we may bring it up."""

from __future__ import annotations

import os
import socket
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager

from vcan_tests.kernel.errors import MissingTool

BUSES = ("vcan0", "vcan1")


def has_vcan() -> bool:
    """Whether this process can open CAN sockets and make CAN interfaces."""
    if os.geteuid() != 0:
        return False
    try:
        socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW).close()
    except OSError:
        return False
    probe = f"canhelm{os.getpid() % 10000}"
    if not _ip("link", "add", "dev", probe, "type", "vcan"):
        return False
    return _ip("link", "delete", "dev", probe)


@contextmanager
def buses_up() -> Iterator[None]:
    """vcan0 and vcan1, up; those that were not there before are gone again afterwards.

    Raises:
        MissingTool: one of them is there and can't be brought up.
    """
    made = [bus for bus in BUSES if _ip("link", "add", "dev", bus, "type", "vcan")]
    try:
        for bus in BUSES:
            if not _ip("link", "set", "dev", bus, "txqueuelen", "1000", "up"):
                raise MissingTool(f"{bus} can't be brought up; look at it with: ip -details link show {bus}")
        yield
    finally:
        for bus in made:
            _ip("link", "delete", "dev", bus)


def _ip(*arguments: str) -> bool:
    return subprocess.run(["ip", *arguments], capture_output=True).returncode == 0
