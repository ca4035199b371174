"""What a page that reads slowly gets: all answers, and the newest of the rest."""

from __future__ import annotations

import asyncio

import pytest

from canhelm import protocol
from daemon.station import outbox
from daemon.station.outbox import Outbox


def sample(number: int) -> bytes:
    return protocol.make_notification("status", {"number": number})


def event(length: int) -> bytes:
    return protocol.make_notification("event", {"message": "x" * length})


def answer(number: int, length: int = 0) -> bytes:
    return protocol.make_result(number, {"padding": "x" * length})


async def test_of_the_samples_that_wait_the_newest_is_sent_and_the_others_are_counted() -> None:
    box = Outbox()
    for number in range(5):
        box.put(sample(number))
    assert await box.get() == sample(4)
    assert box.lost == 4


async def test_answers_go_before_samples_and_in_order() -> None:
    box = Outbox()
    for line in (sample(1), answer(1), answer(2)):
        box.put(line)
    assert [await box.get() for _ in range(3)] == [answer(1), answer(2), sample(1)]


async def test_events_are_lost_and_counted_when_much_waits_but_answers_are_not() -> None:
    box = Outbox()
    waiting = [answer(1, outbox.SLOW_BYTES), answer(2)]
    for line in (waiting[0], event(10), waiting[1]):
        box.put(line)
    assert [await box.get() for _ in range(2)] == waiting
    assert box.lost == 1


async def test_at_the_end_what_waits_still_comes() -> None:
    box = Outbox()
    box.put(sample(1))
    box.end()
    assert [await box.get() for _ in range(2)] == [sample(1), b""]


async def test_few_events_are_kept() -> None:
    box = Outbox()
    box.put(event(1))
    box.put(event(2))
    assert [await box.get() for _ in range(2)] == [event(1), event(2)]


async def test_who_waits_gets_what_comes() -> None:
    box = Outbox()
    waiting = asyncio.create_task(box.get())
    await asyncio.sleep(0)
    box.put(answer(1))
    assert await waiting == answer(1)


async def test_too_many_answers_are_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(outbox, "MAX_UNSENT_BYTES", 100)
    box = Outbox()
    box.put(answer(1, 200))
    full = box.overfull
    await box.get()
    assert (full, box.overfull) == (True, False)
