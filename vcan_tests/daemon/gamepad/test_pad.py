"""A pad by its events: recorded ones on virtual time, and a file descriptor in real time."""

from __future__ import annotations

import asyncio
import os
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from daemon.gamepad.input_events import EV_ABS, EV_SYN, SYN_DROPPED, Event
from daemon.gamepad.pad import Pad, watched
from vcan_tests.daemon.gamepad.recorded_pad import FULL, REPORT, RecordedPad, make_event


@pytest.fixture
async def held() -> RecordedPad:
    return RecordedPad()


async def test_a_stick_is_where_its_last_event_says(held: RecordedPad) -> None:
    for share in (1.0, 0.25, -0.5):
        held.move("ABS_Y", share)
        assert held.pad.position("ABS_Y") == pytest.approx(share, abs=1e-4)
    assert held.pad.position("ABS_X") == pytest.approx(0.0, abs=1e-4)


async def test_a_pad_tells_at_once_how_it_is_held() -> None:
    held = RecordedPad(pressed=("BTN_TL",))
    assert held.pad.held("BTN_TL")


async def test_a_button_that_was_let_go_of_in_between_was_not_held(held: RecordedPad) -> None:
    held.press("BTN_TL")
    held.let_go("BTN_TL")
    held.press("BTN_TL")
    assert not held.pad.held("BTN_TL")
    held.pad.forget()
    assert held.pad.held("BTN_TL")


async def test_a_short_press_is_remembered_until_somebody_has_seen_to_it(held: RecordedPad) -> None:
    held.press("BTN_EAST")
    held.let_go("BTN_EAST")
    assert held.pad.was_pressed("BTN_EAST")
    held.pad.forget()
    assert not held.pad.was_pressed("BTN_EAST")


async def test_a_button_wakes_who_waits_and_a_stick_does_not(held: RecordedPad) -> None:
    loop = asyncio.get_running_loop()
    loop.call_later(0.01, held.move, "ABS_X", 0.5)
    loop.call_later(0.03, held.press, "BTN_TL")
    await held.pad.wait(0.05)
    assert loop.time() == pytest.approx(0.03)
    await held.pad.wait(0.05)
    assert loop.time() == pytest.approx(0.08)


async def test_after_lost_events_the_kernel_is_asked_how_the_pad_is_held(held: RecordedPad) -> None:
    held.press("BTN_TL")
    held.pad.forget()
    held.moves("ABS_Y", -1.0)
    held.lets_go("BTN_TL")
    stale = make_event(Event(EV_ABS, 1, FULL))
    held.pad.feed(make_event(Event(EV_SYN, SYN_DROPPED, 0)) + stale + REPORT)
    assert held.pad.position("ABS_Y") == pytest.approx(-1.0, abs=1e-4)
    assert not held.pad.held("BTN_TL")


async def test_who_held_on_through_lost_events_has_to_press_again(held: RecordedPad) -> None:
    held.press("BTN_TL")
    held.pad.forget()
    held.pad.feed(make_event(Event(EV_SYN, SYN_DROPPED, 0)) + REPORT)
    assert not held.pad.held("BTN_TL")


@contextmanager
def wire() -> Iterator[tuple[int, int]]:
    """Both ends of what stands for an event device."""
    reading, writing = os.pipe2(os.O_NONBLOCK)
    try:
        yield reading, writing
    finally:
        os.close(reading)
        os.close(writing)


@pytest.mark.real_time
async def test_a_pad_hears_what_its_file_descriptor_says() -> None:
    held = RecordedPad()
    with wire() as (reading, writing), watched(reading, held.pad):
        os.write(writing, held.moves("ABS_RX", 0.75) + held.presses("BTN_TL"))
        await held.pad.wait(5.0)
        assert held.pad.position("ABS_RX") == pytest.approx(0.75, abs=1e-4)
        assert held.pad.held("BTN_TL")


@pytest.mark.real_time
async def test_the_end_of_a_file_descriptor_is_the_end_of_the_pad() -> None:
    held = RecordedPad()
    reading, writing = os.pipe2(os.O_NONBLOCK)
    with watched(reading, held.pad):
        os.close(writing)
        await held.pad.wait(5.0)
    os.close(reading)
    assert held.pad.gone == "it says no more"


@pytest.mark.real_time
async def test_an_error_of_the_file_descriptor_is_the_end_of_the_pad(monkeypatch: pytest.MonkeyPatch) -> None:
    """What read(2) says of an event device that was unplugged."""

    def unplugged(device: int, size: int) -> bytes:
        raise OSError(19, "No such device")

    held = RecordedPad()
    with wire() as (reading, writing), watched(reading, held.pad):
        monkeypatch.setattr(os, "read", unplugged)
        os.write(writing, REPORT)
        await held.pad.wait(5.0)
    assert held.pad.gone == "No such device"


async def test_a_trigger_at_its_rest_is_not_in_the_middle() -> None:
    """So a pad on which a stick's axis is a trigger never begins to drive."""
    held = RecordedPad()
    held.truth.axes[5], held.truth.ranges[5] = 0, (0, 255)
    assert Pad("triggers", held.look).position("ABS_RZ") == -1.0
