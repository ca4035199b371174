"""Frame lengths against published figures and against a bit-by-bit count."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.bus.contract import RTR_FLAG
from drivers.bus.wire_time import LoadMeter, frame_bits

DATA = st.binary(max_size=8)
IDS = st.integers(0, 0x7FF)


@pytest.mark.parametrize(
    ("can_id", "data", "bits"),
    [
        (0x080, "", 51),
        (0x000, "01 00", 68),
        (0x701, "05", 58),
        (0x381, "37 02 01", 76),
        (0x201, "00 00 00 00", 87),
        (0x601, "40 41 60 00 00 00 00 00", 123),
        (0x181, "00 00 00 00 00 00 00 00", 126),
    ],
)
def test_frames_of_known_length(can_id: int, data: str, bits: int) -> None:
    assert frame_bits(can_id, bytes.fromhex(data)) == bits


def counted_bits(can_id: int, data: bytes, remote: bool) -> int:
    """The frame as a string of bits: CRC by polynomial division, stuffing by looking at the last five sent."""
    head = "0" + f"{can_id:011b}" + ("1" if remote else "0") + "00" + f"{len(data):04b}"
    body = head if remote else head + "".join(f"{byte:08b}" for byte in data)
    remainder = int(body, 2) << 15
    for shift in range(len(body) - 1, -1, -1):
        if remainder >> (shift + 15) & 1:
            remainder ^= 0xC599 << shift
    sent = ""
    for bit in body + f"{remainder:015b}":
        sent += bit
        if sent.endswith("00000"):
            sent += "1"
        elif sent.endswith("11111"):
            sent += "0"
    return len(sent + "1" + "01" + "1111111" + "111")


@given(IDS, DATA)
def test_a_data_frame_is_as_long_as_its_bits_counted_one_by_one(can_id: int, data: bytes) -> None:
    assert frame_bits(can_id, data) == counted_bits(can_id, data, remote=False)


@given(IDS, st.sampled_from([b"\0", b"\xff", b"\x55"]), st.integers(0, 8))
def test_a_frame_of_equal_bytes_is_as_long_as_its_bits_counted(can_id: int, byte: bytes, length: int) -> None:
    assert frame_bits(can_id, byte * length) == counted_bits(can_id, byte * length, remote=False)


@given(IDS, DATA)
def test_a_remote_frame_sends_no_data(can_id: int, data: bytes) -> None:
    assert frame_bits(can_id | RTR_FLAG, data) == counted_bits(can_id, data, remote=True)


@given(IDS, DATA)
def test_a_frame_lies_between_no_stuffing_and_the_worst(can_id: int, data: bytes) -> None:
    assert 47 + 8 * len(data) <= frame_bits(can_id, data) <= 55 + 10 * len(data)


@pytest.mark.parametrize(("can_id", "data"), [(0x800, b""), (-1, b""), (0x181, bytes(9))])
def test_what_no_base_frame_can_be_is_refused(can_id: int, data: bytes) -> None:
    with pytest.raises(ValueError, match="base frame"):
        frame_bits(can_id, data)


def test_load_is_the_share_of_the_last_second() -> None:
    meter = LoadMeter(bit_rate=1000)
    meter.add(0.5, 100)
    meter.add(1.0, 200)
    assert meter.load(1.2) == pytest.approx(0.3)
    assert meter.load(1.6) == pytest.approx(0.2)
    assert meter.load(2.5) == 0.0
    assert meter.total_bits == 300
