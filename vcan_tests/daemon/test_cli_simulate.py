"""``canhelm simulate``: a process of its own on a pseudo terminal, and nodes on an interface of python-can."""

from __future__ import annotations

import asyncio
import json
import os
import select
import signal
import subprocess
import sys
from collections.abc import Iterator

import can
import pytest

from daemon.cli import simulate
from daemon.cli.main import main
from drivers.epos.serial_frames import make_read_object
from profiles.loader import load

TIMEOUT_S = 20
STATUSWORD, ENCODER_POSITION = make_read_object(1, 0x6041, 0), make_read_object(5, 0x6004, 0)
ARGUMENTS = ("simulate", "--profile", "max2d", "--bus")


@pytest.fixture
def network() -> Iterator[subprocess.Popen[str]]:
    command = [sys.executable, "-m", "daemon", *ARGUMENTS, "rs232:pty@57600", "--nodes", "1,5"]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    yield process
    process.kill()
    process.communicate()


def device_of(network: subprocess.Popen[str]) -> str:
    assert network.stdout is not None
    said = json.loads(network.stdout.readline())
    assert said | {"device": ""} == {"device": "", "baud": 57600, "gateway": "rear_right", "node": 1}
    return str(said["device"])


def read(fd: int, count: int, limit_s: float = 2.0) -> bytes:
    data = b""
    while len(data) < count and select.select([fd], [], [], limit_s)[0]:
        data += os.read(fd, count - len(data))
    return data


def ask(fd: int, frame: bytes) -> bytes:
    """The answer to a read; a drive that still boots is asked again."""
    acknowledge = b""
    for _ in range(20):
        os.write(fd, frame[:1])
        acknowledge = read(fd, 1, limit_s=0.3)
        if acknowledge:
            break
    assert acknowledge == b"O"
    os.write(fd, frame[1:])
    assert read(fd, 2) == b"O\0"
    os.write(fd, b"O")
    answer = read(fd, 11)
    os.write(fd, b"O")
    return answer


def test_another_process_reads_objects_through_the_terminal(network: subprocess.Popen[str]) -> None:
    fd = os.open(device_of(network), os.O_RDWR | os.O_NOCTTY)
    assert ask(fd, STATUSWORD).hex() == "03000000004001" + "00005d46"
    assert ask(fd, ENCODER_POSITION)[:5] == b"\3\0\0\0\0"
    os.close(fd)


def test_sigterm_ends_it_and_hangs_up(network: subprocess.Popen[str]) -> None:
    fd = os.open(device_of(network), os.O_RDWR | os.O_NOCTTY)
    network.send_signal(signal.SIGTERM)
    assert network.wait(TIMEOUT_S) == 0
    with pytest.raises(OSError, match="Input/output error"):
        os.write(fd, b"\x10")
    os.close(fd)


@pytest.mark.real_time
async def test_chosen_nodes_boot_on_a_can_interface_and_answer_there() -> None:
    profile = load("max2d").profile
    with can.Bus(interface="virtual", channel="simulate-test", receive_own_messages=False) as host:
        simulation = asyncio.create_task(simulate._on_interface(profile, "2,rear", "virtual:simulate-test", 0))
        boots = {await asyncio.to_thread(next_id, host) for _ in range(2)}
        assert boots == {0x702, 0x705}
        host.send(can.Message(arbitration_id=0x605, data=bytes.fromhex("4018100400000000"), is_extended_id=False))
        assert await asyncio.to_thread(next_id, host) == 0x585
        simulation.cancel()
        with pytest.raises(asyncio.CancelledError):
            await simulation


def next_id(host: can.BusABC) -> int:
    message = host.recv(5.0)
    assert message is not None
    return message.arbitration_id


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        (("simulated",), "nobody could reach"),
        (("rs232:/dev/ttyS0",), "rs232:pty"),
        (("rs232:pty@1234",), "115200"),
        (("rs232:pty", "--gateway", "rear"), "rear_right"),
        (("rs232:pty", "--nodes", "2,3"), "--nodes"),
        (("rs232:pty", "--nodes", "1,99"), "no node 99"),
        (("rs232:pty", "--lose", "2"), "0 to 1"),
        (("virtual:x", "--lose", "0.1"), "serial line"),
        (("nonsense:x",), "socketcan"),
    ],
)
def test_what_cannot_be_simulated_is_refused_with_a_remedy(
    arguments: tuple[str, ...], word: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([*ARGUMENTS, *arguments]) == 2
    said = capsys.readouterr().err
    assert word in said
    assert " - " in said
