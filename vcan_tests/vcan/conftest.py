"""What tests of SocketCAN begin with: two back ends, a raw socket, and an interface to take away."""

from __future__ import annotations

import socket
import subprocess
from collections.abc import AsyncIterator, Iterator

import pytest

from drivers.bus.socketcan import SocketCanBus
from vcan_tests.vcan.socketcan_bench import ip, opened


@pytest.fixture
async def one() -> AsyncIterator[SocketCanBus]:
    async with opened() as bus:
        yield bus


@pytest.fixture
async def two() -> AsyncIterator[SocketCanBus]:
    async with opened() as bus:
        yield bus


@pytest.fixture
def raw() -> Iterator[socket.socket]:
    """A socket of nobody's back end, for frames that ours would not send."""
    with socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW) as sender:
        sender.bind(("vcan0",))
        yield sender


@pytest.fixture
def spare() -> Iterator[str]:
    """An interface that a test may take down and away."""
    ip("link", "add", "spare0", "type", "vcan")
    ip("link", "set", "spare0", "up")
    yield "spare0"
    subprocess.run(["ip", "link", "delete", "spare0"], check=False, capture_output=True)
