"""What the kernel tells of a CAN interface; recorded on Linux 6.1, an adapter of its slcan driver and a vcan."""

from __future__ import annotations

import struct

from hypothesis import given
from hypothesis import strategies as st

from drivers.bus.can_link import CanLink, make_get_link, parse_link, read_link

HEAD = bytes.fromhex("800300001000000001000000cd0200000000180104000000c100010000000000")
"""Header of the message and of the interface, whose first attribute is its name."""
NAME = bytes.fromhex("0900 0300 63616e3000 000000")
INFO = bytes.fromhex(
    "b0001200 0800 0100 63616e00 1c00 0300 000000000000000001000000000000000000000000000000"
    "8800 0200 2400 0100 48e8010000000000000000000000000000000000000000000000000000000000"
    "0800 0300 00000000 0800 0400 02000000 0c00 0500 0000000000000000 0800 0600 00000000"
    "2800 0d00 10270000204e000050c30000a086010048e8010090d0030020a1070000350c0040420f00"
    "0800 0f00 00000000 0c00 1180 0800 0100 02000000"
)
"""Of an adapter at 125 kbit/s, error-passive."""
VIRTUAL = bytes.fromhex("10001200 0900 0100 7663616e 00000000")
NO_SUCH_DEVICE = bytes.fromhex("400000000200000001000000cd020000edffffff2c00000012000100010000000000000000000000")


def test_bit_rate_state_and_restart_delay_of_a_controller_are_read() -> None:
    assert parse_link(HEAD + NAME + INFO) == CanLink(125_000, "ERROR-PASSIVE", restart_ms=0)


def test_a_virtual_interface_has_none_of_them() -> None:
    assert parse_link(HEAD + NAME + VIRTUAL) == CanLink()


def test_of_an_interface_that_is_not_there_nothing_is_known() -> None:
    assert parse_link(NO_SUCH_DEVICE) == CanLink()
    assert read_link("nothing0") == CanLink()


def test_the_request_names_the_interface_and_tells_its_own_length() -> None:
    request = make_get_link("can0")
    assert struct.unpack_from("=IH", request) == (len(request), 18)
    assert request[32:] == NAME


@given(st.binary())
def test_no_answer_raises(rest: bytes) -> None:
    parse_link(HEAD + rest)
    parse_link(rest)
