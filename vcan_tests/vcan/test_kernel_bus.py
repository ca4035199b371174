"""The bus that the other tests here stand on, looked at without a line of canhelm's own drivers."""

from __future__ import annotations

import json
import socket
import struct
import subprocess
import time
from collections.abc import Iterator
from contextlib import ExitStack
from itertools import pairwise
from statistics import median
from typing import Any

import pytest

from vcan_tests.kernel.slcan_adapter import CAN_FRAME, SlcanAdapter

pytestmark = pytest.mark.vcan

CAN_RAW_ERR_FILTER = 2  # linux/can/raw.h
SO_RCVBUFFORCE = 33  # asm-generic/socket.h
SO_TIMESTAMPNS = 35  # asm-generic/socket.h
TIMESPEC = struct.Struct("@2l")
BCM_HEAD = struct.Struct("@3I4l2I0q")  # linux/can/bcm.h: opcode, flags, count, two intervals, can_id, nframes
BCM_TX_SETUP, BCM_SETTIMER, BCM_STARTTIMER = 1, 0x1, 0x2
ANY_ERROR = socket.CAN_ERR_MASK
BUS_OFF = socket.CAN_ERR_FLAG | 0x40  # linux/can/error.h: CAN_ERR_BUSOFF
CONTROLLER = socket.CAN_ERR_FLAG | 0x4  # CAN_ERR_CRTL; the counters are in data[6] (sending) and data[7]


@pytest.fixture
def sockets() -> Iterator[ExitStack]:
    """Closes the sockets of a test."""
    with ExitStack() as stack:
        yield stack


def raw(stack: ExitStack, interface: str, errors: int = 0) -> socket.socket:
    """A raw socket that waits at most five seconds."""
    bus = stack.enter_context(socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW))
    bus.setsockopt(socket.SOL_CAN_RAW, CAN_RAW_ERR_FILTER, errors)
    bus.settimeout(5.0)
    bus.bind((interface,))
    return bus


def cyclic(stack: ExitStack, interface: str, frame: bytes, period_us: int) -> None:
    """Has the broadcast manager send a frame again and again until the stack closes."""
    manager = stack.enter_context(socket.socket(socket.AF_CAN, socket.SOCK_DGRAM, socket.CAN_BCM))
    manager.connect((interface,))
    can_id = CAN_FRAME.unpack(frame)[0]
    start = BCM_SETTIMER | BCM_STARTTIMER
    manager.send(BCM_HEAD.pack(BCM_TX_SETUP, start, 0, 0, 0, 0, period_us, can_id, 1) + frame)


def frame(can_id: int, data: bytes = b"") -> bytes:
    """A frame as the kernel has it (linux/can.h: struct can_frame)."""
    return CAN_FRAME.pack(can_id, len(data), data)


def frames_until(bus: socket.socket, last: int) -> list[tuple[int, bytes]]:
    """The frames up to one whose id has all the bits of ``last``."""
    seen: list[tuple[int, bytes]] = []
    while not seen or seen[-1][0] & last != last:
        can_id, _, data = CAN_FRAME.unpack(bus.recv(CAN_FRAME.size))
        seen.append((can_id, data))
    return seen


def link(interface: str) -> dict[str, Any]:
    """What the kernel tells of an interface."""
    shown = subprocess.run(["ip", "-json", "-details", "link", "show", interface], capture_output=True, check=True)
    found: dict[str, Any] = json.loads(shown.stdout)[0]
    return found


def controller_state(interface: str) -> str:
    """The error state of an interface's CAN controller."""
    return str(link(interface)["linkinfo"]["info_data"]["state"])


def test_a_frame_crosses_the_bus_with_the_kernels_time_stamp(sockets: ExitStack) -> None:
    sender, receiver = raw(sockets, "vcan0"), raw(sockets, "vcan0")
    receiver.setsockopt(socket.SOL_SOCKET, SO_TIMESTAMPNS, 1)
    before = time.clock_gettime_ns(time.CLOCK_REALTIME)
    sender.send(frame(0x123, b"\xaa\xbb"))
    got, ancillary, _, _ = receiver.recvmsg(CAN_FRAME.size, 64)
    after = time.clock_gettime_ns(time.CLOCK_REALTIME)
    seconds, nanoseconds = TIMESPEC.unpack(ancillary[0][2])
    assert got == frame(0x123, b"\xaa\xbb")
    assert before <= seconds * 1_000_000_000 + nanoseconds <= after


def test_a_frame_stays_on_its_bus(sockets: ExitStack) -> None:
    sender, other = raw(sockets, "vcan0"), raw(sockets, "vcan1")
    sender.send(frame(0x123))
    raw(sockets, "vcan1").send(frame(0x456))
    assert other.recv(CAN_FRAME.size) == frame(0x456)


def test_the_broadcast_manager_keeps_a_period_of_10_ms_that_candump_sees(sockets: ExitStack) -> None:
    cyclic(sockets, "vcan0", frame(0x080), 10_000)
    log = subprocess.run(["candump", "-L", "-n", "51", "vcan0"], capture_output=True, text=True, timeout=20, check=True)
    stamps = [float(line.split(")")[0].lstrip("(")) for line in log.stdout.splitlines() if "vcan0 080#" in line]
    assert len(stamps) == 51
    assert median(after - before for before, after in pairwise(stamps)) == pytest.approx(0.010, abs=0.001)


def test_the_broadcast_manager_stops_when_its_socket_is_closed(sockets: ExitStack) -> None:
    listener = raw(sockets, "vcan0")
    with ExitStack() as briefly:
        cyclic(briefly, "vcan0", frame(0x080), 10_000)
        assert listener.recv(CAN_FRAME.size) == frame(0x080)
    listener.settimeout(0.1)
    with pytest.raises(TimeoutError):
        frames_until(listener, BUS_OFF)


def test_a_gateway_rule_forwards_from_one_bus_to_the_other(sockets: ExitStack) -> None:
    sender, listener = raw(sockets, "vcan0"), raw(sockets, "vcan1")
    rule = ["-s", "vcan0", "-d", "vcan1", "-e"]
    subprocess.run(["cangw", "-A", *rule], check=True)
    sockets.callback(subprocess.run, ["cangw", "-D", *rule], check=True)
    sender.send(frame(0x701, b"\x05"))
    assert listener.recv(CAN_FRAME.size) == frame(0x701, b"\x05")


def test_a_burst_of_1000_frames_fits_into_a_large_receive_buffer(sockets: ExitStack) -> None:
    sender, receiver = raw(sockets, "vcan0"), raw(sockets, "vcan0")
    receiver.setsockopt(socket.SOL_SOCKET, SO_RCVBUFFORCE, 4 << 20)
    for number in range(1000):
        sender.send(frame(0x181, number.to_bytes(2, "little")))
    numbers = [int.from_bytes(CAN_FRAME.unpack(receiver.recv(CAN_FRAME.size))[2][:2], "little") for _ in range(1000)]
    assert numbers == list(range(1000))


def test_the_kernel_opens_the_adapter_at_its_bit_rate() -> None:
    with SlcanAdapter() as adapter:
        assert link("can0")["linkinfo"]["info_data"]["bittiming_bitrate"] == 125_000
    assert adapter.commands[:3] == ["C", "S4", "O"]


def test_an_adapter_carries_frames_to_the_bus_behind_it_and_back(sockets: ExitStack) -> None:
    with SlcanAdapter(carries_to="vcan1"):
        near, far = raw(sockets, "can0"), raw(sockets, "vcan1")
        near.send(frame(0x601, b"\x40\x00\x10"))
        assert far.recv(CAN_FRAME.size) == frame(0x601, b"\x40\x00\x10")
        far.send(frame(0x701 | socket.CAN_RTR_FLAG))
        assert near.recv(CAN_FRAME.size) == frame(0x701 | socket.CAN_RTR_FLAG)


def test_the_controller_goes_through_its_error_states_into_bus_off(sockets: ExitStack) -> None:
    with SlcanAdapter() as adapter:
        bus = raw(sockets, "can0", ANY_ERROR)
        adapter.report_state("warning", rx_errors=96)
        (_, warned), *_ = frames_until(bus, CONTROLLER)
        adapter.report_state("passive", tx_errors=128)
        (_, passive), *_ = frames_until(bus, CONTROLLER)
        adapter.report_state("bus-off", tx_errors=256)
        frames_until(bus, BUS_OFF)
        assert (warned[6], warned[7], passive[6], passive[7]) == (0, 96, 128, 0)
        assert controller_state("can0") == "BUS-OFF"


def test_a_controller_is_error_active_again_after_its_interface_has_been_down(sockets: ExitStack) -> None:
    with SlcanAdapter(carries_to="vcan1") as adapter:
        bus, behind = raw(sockets, "can0", ANY_ERROR), raw(sockets, "vcan1")
        adapter.report_state("bus-off", tx_errors=256)
        frames_until(bus, BUS_OFF)
        adapter.down()
        adapter.up()
        assert controller_state("can0") == "ERROR-ACTIVE"
        raw(sockets, "can0").send(frame(0x080))
        assert behind.recv(CAN_FRAME.size) == frame(0x080)


def test_errors_on_the_wire_reach_a_socket_that_asks_for_them(sockets: ExitStack) -> None:
    with SlcanAdapter() as adapter:
        bus = raw(sockets, "can0", ANY_ERROR)
        adapter.report_errors("a")
        no_acknowledge = socket.CAN_ERR_FLAG | 0x20  # CAN_ERR_ACK
        assert frames_until(bus, no_acknowledge)


def test_an_adapter_that_cant_be_set_up_leaves_nothing_behind() -> None:
    with pytest.raises(subprocess.CalledProcessError), SlcanAdapter(bit_rate=123_456):
        pass
    assert "can0" not in [name for _, name in socket.if_nameindex()]


def test_the_interface_vanishes_with_its_adapter() -> None:
    with SlcanAdapter() as adapter:
        adapter.unplug()
        assert "can0" not in [name for _, name in socket.if_nameindex()]
