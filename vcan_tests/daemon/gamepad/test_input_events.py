"""The kernel's events and requests, against what <linux/input.h> makes of them on a 64-bit machine."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from daemon.gamepad.input_events import (
    EV_ABS,
    EVENT,
    Event,
    absinfo_request,
    keys_request,
    parse_bits,
    parse_events,
)
from vcan_tests.daemon.gamepad.recorded_pad import make_event

EVENTS = st.builds(
    Event, type=st.integers(0, 0xFFFF), code=st.integers(0, 0xFFFF), value=st.integers(-(2**31), 2**31 - 1)
)


@given(st.lists(EVENTS))
def test_events_come_back_as_they_were_sent(events: list[Event]) -> None:
    assert list(parse_events(b"".join(map(make_event, events)))) == events


@given(st.binary())
def test_whatever_is_read_is_parsed_up_to_its_last_whole_event(data: bytes) -> None:
    assert len(list(parse_events(data))) == len(data) // EVENT.size


def test_an_event_of_a_real_pad_is_read() -> None:
    """Left stick of an Xbox pad, by hexdump of its event device."""
    data = bytes.fromhex("5c9e1366000000002a1b050000000000030000000a1f0000")
    assert list(parse_events(data)) == [Event(EV_ABS, 0, 0x1F0A)]


def test_requests_are_those_of_the_header() -> None:
    assert absinfo_request(0) == 0x80184540  # EVIOCGABS(ABS_X)
    assert absinfo_request(0x11) == 0x80184551  # EVIOCGABS(ABS_HAT0Y)
    assert keys_request() == 0x80604518  # EVIOCGKEY(96)


@pytest.mark.parametrize(("data", "bits"), [(b"", set()), (b"\x01", {0}), (b"\x00\x81", {8, 15})])
def test_bits_are_counted_from_the_lowest_of_the_first_byte(data: bytes, bits: set[int]) -> None:
    assert parse_bits(data) == bits
