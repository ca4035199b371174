"""What SocketCAN needs of the kernel beside frames: its timer for repeated ones, its counters, and that it is there."""

from __future__ import annotations

import errno
import socket
import struct
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from canhelm.errors import BusOff, UsageError
from drivers.bus.broadcast_manager import RepeatedFrame, kernel_repeats, make_setup
from drivers.bus.contract import Bus
from drivers.bus.interface_load import InterfaceLoad, wire_bits
from drivers.bus.interfaces import open_bus
from drivers.bus.python_can import PythonCanBus
from drivers.bus.socketcan import SocketCanBus
from drivers.bus.wire_time import frame_bits


class NoSocket:
    """Stands for a kernel that refuses sockets with an error."""

    def __init__(self, number: int, words: str) -> None:
        self.error = OSError(number, words)

    def __call__(self, *_: Any) -> socket.socket:
        raise self.error


@pytest.mark.parametrize("spec", ["can0", ":can0", "socketcan:", "", "pigeon:can0"])
def test_a_specification_that_names_no_bus_is_refused(spec: str) -> None:
    with pytest.raises(UsageError):
        open_bus(spec, 1_000_000)


@pytest.mark.parametrize(("spec", "kind"), [("socketcan:can0", SocketCanBus), ("slcan:/dev/ttyUSB0", PythonCanBus)])
def test_the_kernels_can_has_a_back_end_of_its_own(spec: str, kind: type[Bus]) -> None:
    assert type(open_bus(spec, 1_000_000)) is kind


@pytest.mark.real_time
async def test_a_kernel_without_can_is_not_helped_by_setting_up_the_interface(monkeypatch: pytest.MonkeyPatch) -> None:
    refusal = NoSocket(errno.EAFNOSUPPORT, "Address family not supported by protocol")
    bus = open_bus("socketcan:can0", 1_000_000)
    with monkeypatch.context() as patched:
        patched.setattr(socket, "socket", refusal)
        with pytest.raises(BusOff, match="Address family not supported") as raised:
            await bus.open()
    assert ("modprobe can_raw" in str(raised.value.remedy), "ip link" in str(raised.value.remedy)) == (True, False)


@pytest.mark.real_time
@pytest.mark.parametrize(
    ("channel", "remedy"),
    [
        ("can0", "sudo ip link set can0 up type can bitrate 500000"),
        ("vcan0", "sudo ip link add dev vcan0 type vcan"),
    ],
)
async def test_a_missing_interface_comes_with_the_line_that_makes_it(
    channel: str, remedy: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    bus = open_bus(f"socketcan:{channel}", 500_000)
    with monkeypatch.context() as patched:
        patched.setattr(socket, "socket", NoSocket(errno.ENODEV, "No such device"))
        with pytest.raises(BusOff, match="No such device") as raised:
            await bus.open()
    assert remedy in str(raised.value.remedy)


@pytest.mark.real_time
async def test_sending_on_a_bus_that_is_not_open_is_dropped_and_counted() -> None:
    bus = open_bus("socketcan:can0", 500_000)
    bus.send(0x080)
    assert (bus.counters.sent, bus.counters.dropped_stale) == (0, 1)


def test_a_frame_that_no_base_frame_can_be_is_refused_at_sending() -> None:
    with pytest.raises(ValueError, match="no classic base frame"):
        open_bus("socketcan:can0", 500_000).send(0x800)


def test_a_setup_for_the_broadcast_manager_is_the_kernels_struct() -> None:
    head = struct.pack("@IIIllllII0q", 1, 3, 25, 0, 10_000, 0, 0, 0x080, 1)
    assert make_setup(3, 0x080, b"", 0.01, 25) == head + struct.pack("=IB3x8s", 0x080, 0, b"")


def test_a_period_of_more_than_a_second_is_split() -> None:
    assert struct.unpack_from("@ll", make_setup(3, 0x080, b"", 2.25, 1), 16) == (2, 250_000)


def test_a_kernel_without_a_broadcast_manager_repeats_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(socket, "socket", NoSocket(errno.EPROTONOSUPPORT, "Protocol not supported"))
    frame = RepeatedFrame("can0", 0x080, b"", 0.01, 25)
    assert (kernel_repeats(), frame.start()) == (False, False)


def counters(folder: Path, name: str, tx: tuple[int, int], rx: tuple[int, int]) -> None:
    where = folder / name / "statistics"
    where.mkdir(parents=True, exist_ok=True)
    for counter, value in zip(("tx_packets", "tx_bytes", "rx_packets", "rx_bytes"), tx + rx, strict=True):
        (where / counter).write_text(f"{value}\n")


def load_of(folder: Path, name: str) -> float:
    """The load after 100 frames with 800 bytes in each direction, within half a second at 1 Mbit/s."""
    load = InterfaceLoad(name, 1_000_000, folder)
    counters(folder, name, (10, 80), (20, 160))
    load.sample(1.0)
    counters(folder, name, (110, 880), (120, 960))
    load.sample(1.5)
    return load.load


def test_the_load_is_what_the_kernel_has_counted_in_both_directions(tmp_path: Path) -> None:
    assert load_of(tmp_path, "can0") == pytest.approx(2 * wire_bits(100, 800) / 500_000)


def test_a_virtual_interface_counts_each_frame_once(tmp_path: Path) -> None:
    assert load_of(tmp_path, "vcan0") == pytest.approx(wire_bits(100, 800) / 500_000)


def test_an_interface_that_is_gone_has_no_load(tmp_path: Path) -> None:
    load = InterfaceLoad("can0", 1_000_000, tmp_path)
    load.load = 0.5
    load.sample(1.0)
    assert load.load == 0.0


@given(st.integers(0, 0x7FF), st.binary(max_size=8))
def test_estimated_bits_are_within_a_fifth_of_what_any_frame_takes(can_id: int, data: bytes) -> None:
    assert wire_bits(1, len(data)) == pytest.approx(frame_bits(can_id, data), rel=0.2)
