"""Error frames in words, and the controller that is followed by them."""

from __future__ import annotations

import logging

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.bus.can_errors import ControllerState, parse_error
from drivers.bus.controller import Controller

PASSIVE = (0x2000_0204, bytes([0, 0x20, 0, 0, 0, 0, 130, 4]))
"""As the kernel's slcan driver makes it."""
BUS_OFF = (0x2000_0040, bytes(8))
RESTARTED = (0x2000_0100, bytes(8))


def frame(classes: int, **details: int) -> tuple[int, bytes]:
    """An error frame; details by their byte, as ``d1=0x20``."""
    data = bytearray(8)
    for name, value in details.items():
        data[int(name[1:])] = value
    return 0x2000_0000 | classes, bytes(data)


@pytest.mark.parametrize(
    ("error", "words"),
    [
        (frame(0x001), "the driver gave up sending (time-out)"),
        (frame(0x002, d0=5), "arbitration lost in bit 5"),
        (frame(0x002), "arbitration lost"),
        (frame(0x004, d1=0x01), "receive buffer of the controller overflowed"),
        (frame(0x004, d1=0x08), "many errors in sending (warning)"),
        (frame(0x004, d1=0x10), "too many errors in receiving (error passive)"),
        (frame(0x008, d2=0x84, d3=0x0A), "stuff error, while sending in data"),
        (frame(0x008, d3=0x08), "protocol error in CRC sequence"),
        (frame(0x010, d4=0x04), "CANH no wire"),
        (frame(0x010, d4=0x70), "CANL shorted to ground"),
        (frame(0x010, d4=0x80), "CANL shorted to CANH"),
        (frame(0x020), "no node acknowledges"),
        (frame(0x0A0), "no node acknowledges"),
        (frame(0x0A8, d3=0x19), "no node acknowledges"),
        (frame(0x040), "bus-off"),
        (frame(0x080), "bus error"),
        (frame(0x100), "controller restarted"),
        (frame(0x1000), "error of no known class"),
    ],
)
def test_each_class_of_errors_has_words(error: tuple[int, bytes], words: str) -> None:
    assert ", ".join(parse_error(*error).words) == words


def test_a_frame_may_report_several_things() -> None:
    assert parse_error(*frame(0x0A8, d2=0x08)).words == ("no node acknowledges", "a dominant bit could not be sent")


def test_error_counters_stand_in_the_last_two_bytes() -> None:
    assert parse_error(*PASSIVE).counters == (130, 4)


def test_without_the_class_for_counters_there_are_none() -> None:
    assert parse_error(*frame(0x004, d6=130)).counters is None


@pytest.mark.parametrize(
    ("error", "state"),
    [
        (BUS_OFF, ControllerState.BUS_OFF),
        (RESTARTED, ControllerState.ERROR_ACTIVE),
        (PASSIVE, ControllerState.ERROR_PASSIVE),
        (frame(0x004, d1=0x04), ControllerState.ERROR_WARNING),
        (frame(0x004, d1=0x40), ControllerState.ERROR_ACTIVE),
        (frame(0x004, d1=0x02), None),
        (frame(0x020), None),
    ],
)
def test_an_error_frame_tells_the_controllers_state_or_nothing(
    error: tuple[int, bytes], state: ControllerState | None
) -> None:
    assert parse_error(*error).state is state


@given(st.integers(0, 0xFFFF_FFFF), st.binary(max_size=8))
def test_no_error_frame_is_an_exception(can_id: int, data: bytes) -> None:
    assert parse_error(can_id, data).words


def controller() -> Controller:
    return Controller("can0", "then sudo ip link set can0 down; sudo ip link set can0 up")


def test_a_controller_without_trouble_has_nothing_to_tell() -> None:
    assert controller().details() == {}


def test_going_bus_off_is_counted_once_each_time() -> None:
    follower = controller()
    for error in (BUS_OFF, BUS_OFF, RESTARTED, BUS_OFF):
        follower.take(*error)
    assert (follower.bus_off, follower.bus_offs) == (True, 2)


def test_bus_off_is_said_with_what_to_check_and_the_line_that_mends_it(caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.ERROR):
        controller().take(*BUS_OFF)
    (told,) = caplog.messages
    assert all(part in told for part in ("can0 is bus-off", "termination", "ip link set can0 down"))


def test_a_change_is_said_once_however_many_error_frames_come(caplog: pytest.LogCaptureFixture) -> None:
    follower = controller()
    with caplog.at_level(logging.INFO):
        for _ in range(1000):
            follower.take(*PASSIVE)
    assert caplog.messages == ["can0 is error-passive: too many errors in sending (error passive)"]


def test_an_error_that_tells_no_state_leaves_the_state_as_it_is() -> None:
    follower = controller()
    follower.take(*BUS_OFF)
    follower.take(*frame(0x020))
    assert follower.bus_off


def test_the_last_error_is_told_with_the_state_and_the_counters() -> None:
    follower = controller()
    follower.take(*PASSIVE)
    assert follower.details() == {
        "controller": "error-passive",
        "bus_offs": 0,
        "last_error": "too many errors in sending (error passive)",
        "transmit_errors": 130,
        "receive_errors": 4,
    }
