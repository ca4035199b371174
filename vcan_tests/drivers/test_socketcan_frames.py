"""What goes through a raw SocketCAN socket, byte for byte."""

from __future__ import annotations

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.bus.contract import RTR_FLAG
from drivers.bus.socketcan_frames import (
    ERROR_FLAG,
    EVERYTHING,
    MAX_FILTERS,
    SO_RXQ_OVFL,
    SO_TIMESTAMPNS,
    Ancillary,
    make_filters,
    make_frame,
    parse_ancillary,
    parse_frame,
)

SOL_SOCKET = 1
IDS = st.integers(0, 0x7FF)


def packet(can_id: int, length: int, data: bytes = b"") -> bytes:
    return struct.pack("=IB3x8s", can_id, length, data)


def test_a_data_frame_is_the_kernels_struct() -> None:
    assert make_frame(0x201, b"\x0f\x00") == packet(0x201, 2, b"\x0f\x00")


def test_a_remote_frame_carries_its_flag_and_no_data() -> None:
    assert make_frame(0x701 | RTR_FLAG, b"") == packet(0x4000_0701, 0)


@pytest.mark.parametrize(("can_id", "data"), [(0x800, b""), (0x201, bytes(9)), (0x8000_0201, b""), (0x2000_0040, b"")])
def test_what_no_base_frame_can_be_is_not_made(can_id: int, data: bytes) -> None:
    with pytest.raises(ValueError, match="no classic base frame"):
        make_frame(can_id, data)


@given(IDS, st.binary(max_size=8))
def test_a_frame_comes_back_as_it_was_sent(can_id: int, data: bytes) -> None:
    assert parse_frame(make_frame(can_id, data)) == (can_id, data)


def test_the_length_of_a_remote_frame_asks_for_data_and_carries_none() -> None:
    assert parse_frame(packet(0x4000_0181, 8)) == (0x181 | RTR_FLAG, b"")


@pytest.mark.parametrize(
    "foreign",
    [
        packet(0x8000_0181, 0),
        packet(0x0000_0800, 0),
        packet(0x181, 9),
        packet(0x181, 2)[:15],
        packet(0x181, 2) + bytes(56),
        b"",
    ],
    ids=["extended", "beyond 11 bits", "longer than 8", "cut off", "CAN FD", "empty"],
)
def test_other_kinds_of_frames_are_none(foreign: bytes) -> None:
    assert parse_frame(foreign) is None


def test_an_error_frame_keeps_its_classes_and_all_its_bytes() -> None:
    assert parse_frame(packet(0x2000_0204, 8, b"\0\x20\0\0\0\0\x82\x04")) == (
        ERROR_FLAG | 0x204,
        b"\0\x20\0\0\0\0\x82\x04",
    )


@given(st.binary(max_size=80))
def test_no_bytes_from_the_wire_are_an_exception(garbage: bytes) -> None:
    parse_frame(garbage)


def test_a_filter_wants_the_identifier_and_no_extended_frame() -> None:
    assert make_filters([0x181]) == struct.pack("=II", 0x181, 0x8000_07FF)


def test_more_identifiers_than_the_kernel_has_filters_for_let_everything_through() -> None:
    assert make_filters(range(MAX_FILTERS + 1)) == EVERYTHING


def test_nothing_is_wanted_where_no_identifier_is() -> None:
    assert make_filters([]) == b""


def test_time_and_loss_come_beside_a_frame() -> None:
    ancillary = [
        (SOL_SOCKET, SO_TIMESTAMPNS, struct.pack("@ll", 1_700_000_000, 500_000_000)),
        (SOL_SOCKET, SO_RXQ_OVFL, struct.pack("=I", 7)),
    ]
    assert parse_ancillary(ancillary) == (1_700_000_000.5, 7)


@pytest.mark.parametrize("ancillary", [[], [(SOL_SOCKET, SO_TIMESTAMPNS, b"\x01")], [(SOL_SOCKET, 99, bytes(16))]])
def test_what_the_kernel_does_not_tell_is_no_time_and_no_loss(ancillary: Ancillary) -> None:
    assert parse_ancillary(ancillary) == (None, 0)
