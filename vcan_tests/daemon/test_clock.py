"""Virtual time and the ticker."""

from __future__ import annotations

import asyncio
import threading
import time
from collections.abc import Callable
from selectors import SelectorKey, SelectSelector

import pytest

from daemon.runtime.clock import Deadlock, Ticker, VirtualTimeLoop, run_patient, run_precise, run_virtual, stood_still_s


async def test_tests_run_on_virtual_time() -> None:
    assert isinstance(asyncio.get_running_loop(), VirtualTimeLoop)


@pytest.mark.real_time
async def test_a_marked_test_runs_in_real_time() -> None:
    assert not isinstance(asyncio.get_running_loop(), VirtualTimeLoop)


async def test_time_jumps_exactly_to_the_next_timer() -> None:
    seen: list[float] = []
    loop = asyncio.get_running_loop()
    loop.call_at(0.1 + 0.2, lambda: seen.append(loop.time()))
    await asyncio.sleep(1.0)
    assert seen == [0.1 + 0.2]


def test_an_hour_takes_no_time() -> None:
    began = time.monotonic()
    run_virtual(asyncio.sleep(3600.0))
    assert time.monotonic() - began < 60.0


async def test_timers_of_one_time_run_in_the_order_they_were_set() -> None:
    seen: list[int] = []
    loop = asyncio.get_running_loop()
    for number in range(50):
        loop.call_at(1.0, seen.append, number)
    await asyncio.sleep(2.0)
    assert seen == list(range(50))


async def test_what_is_ready_runs_before_time_goes_on() -> None:
    seen: list[str] = []
    loop = asyncio.get_running_loop()
    loop.call_at(1.0, lambda: loop.call_soon(seen.append, "soon"))
    loop.call_at(1.0 + 1e-9, seen.append, "later")
    await asyncio.sleep(2.0)
    assert seen == ["soon", "later"]


def virtual_loop() -> VirtualTimeLoop:
    loop = asyncio.get_running_loop()
    assert isinstance(loop, VirtualTimeLoop)
    return loop


async def test_a_callback_may_jump_ahead_of_a_later_timer() -> None:
    loop = virtual_loop()
    loop.call_at(2.0, int)
    assert loop.jump_to(1.5)
    assert loop.time() == 1.5


@pytest.mark.parametrize("due_s", [0.5, 1.0])
async def test_a_callback_does_not_jump_past_or_to_a_timer(due_s: float) -> None:
    loop = virtual_loop()
    loop.call_at(due_s, int)
    assert not loop.jump_to(1.0)
    assert loop.time() == 0.0


async def test_a_callback_does_not_jump_while_another_is_ready() -> None:
    loop = virtual_loop()
    loop.call_soon(int)
    assert not loop.jump_to(1.0)
    assert loop.time() == 0.0


async def test_a_jump_back_leaves_the_time() -> None:
    loop = virtual_loop()
    await asyncio.sleep(1.0)
    assert loop.jump_to(0.5)
    assert loop.time() == 1.0


async def test_a_timer_in_the_past_does_not_turn_time_back() -> None:
    loop = asyncio.get_running_loop()
    await asyncio.sleep(1.0)
    called = loop.create_future()
    loop.call_at(0.5, called.set_result, None)
    await called
    assert loop.time() == 1.0


async def test_a_cancelled_timer_does_not_move_time() -> None:
    loop = asyncio.get_running_loop()
    loop.call_at(5.0, print).cancel()
    await asyncio.sleep(1.0)
    assert loop.time() == 1.0


async def test_a_timer_cancelled_at_its_own_time_does_not_run() -> None:
    seen: list[int] = []
    loop = asyncio.get_running_loop()
    timers: list[asyncio.TimerHandle] = []
    loop.call_at(1.0, lambda: timers[0].cancel())
    timers.append(loop.call_at(1.0, seen.append, 2))
    await asyncio.sleep(2.0)
    assert seen == []


async def wait_forever() -> None:
    await asyncio.get_running_loop().create_future()


def test_waiting_for_what_cannot_happen_is_an_error() -> None:
    with pytest.raises(Deadlock, match="cannot happen"):
        run_virtual(wait_forever())


def test_left_tasks_are_cancelled_at_the_end() -> None:
    left: list[asyncio.Task[None]] = []

    async def leave_one() -> str:
        left.append(asyncio.create_task(wait_forever()))
        await asyncio.sleep(0.1)
        return "done"

    assert run_virtual(leave_one()) == "done"
    assert left[0].cancelled()


async def test_a_time_out_runs_on_virtual_time() -> None:
    with pytest.raises(TimeoutError):
        await asyncio.wait_for(wait_forever(), 10.0)
    assert asyncio.get_running_loop().time() == 10.0


async def test_threads_are_refused() -> None:
    with pytest.raises(RuntimeError, match="virtual time"):
        await asyncio.to_thread(print)


async def test_a_ticker_does_not_drift() -> None:
    loop = asyncio.get_running_loop()
    times: list[float] = []
    ticker = Ticker(0.01, lambda: times.append(loop.time()))
    ticker.start()
    await asyncio.sleep(100.005)
    assert times == pytest.approx([0.01 * (n + 1) for n in range(10_000)], abs=1e-9)


async def test_a_stopped_ticker_is_silent_and_may_be_started_again() -> None:
    ticker = Ticker(0.1, lambda: None)
    ticker.start()
    ticker.start()
    await asyncio.sleep(0.35)
    ticker.stop()
    await asyncio.sleep(1.0)
    assert (ticker.ticks, ticker.running) == (3, False)
    ticker.start()
    await asyncio.sleep(0.25)
    assert ticker.ticks == 5


async def test_a_callback_may_stop_its_own_ticker() -> None:
    ticker = Ticker(0.1, lambda: ticker.stop())
    ticker.start()
    await asyncio.sleep(1.0)
    assert ticker.ticks == 1


@pytest.mark.real_time
def test_precise_timers_are_finer_than_a_millisecond() -> None:
    async def shortest() -> float:
        loop, waits = asyncio.get_running_loop(), []
        for _ in range(50):
            began = loop.time()
            await asyncio.sleep(0.0001)
            waits.append(loop.time() - began)
        return min(waits)

    assert run_precise(shortest()) < 0.0009


@pytest.mark.real_time
async def test_a_real_ticker_ticks_at_its_deadlines() -> None:
    loop = asyncio.get_running_loop()
    done = loop.create_future()
    began = loop.time()

    def tick() -> None:
        if ticker.ticks + ticker.missed >= 10:
            ticker.stop()
            done.set_result(loop.time() - began)

    ticker = Ticker(0.005, tick)
    ticker.start()
    assert await done >= 0.05
    assert not ticker.running


@pytest.mark.real_time
async def test_missed_ticks_are_counted_and_not_made_up_for() -> None:
    loop = asyncio.get_running_loop()
    done = loop.create_future()

    def block() -> None:
        if ticker.ticks == 1:
            while loop.time() < began + 0.035:
                pass
        else:
            ticker.stop()
            done.set_result(None)

    ticker = Ticker(0.01, block)
    began = loop.time()
    ticker.start()
    await done
    assert ticker.ticks == 2
    assert ticker.missed >= 1
    assert ticker.max_lateness_s >= 0.01


def block(seconds: float) -> None:
    """What a machine without time for this process looks like to it."""
    threading.Event().wait(seconds)


def compute(seconds: float) -> None:
    end_s = time.thread_time() + seconds
    while time.thread_time() < end_s:
        pass


@pytest.mark.real_time
def test_a_patient_clock_stands_still_while_the_process_is_kept_waiting() -> None:
    async def wait() -> tuple[float, float]:
        loop = asyncio.get_running_loop()
        began_s = loop.time()
        block(0.2)
        return loop.time() - began_s, stood_still_s()

    took_s, left_out_s = run_patient(wait())
    assert took_s < 0.1
    assert left_out_s >= 0.199


@pytest.mark.real_time
def test_a_patient_clock_counts_what_the_process_computes() -> None:
    async def work() -> float:
        loop = asyncio.get_running_loop()
        began_s = loop.time()
        compute(0.05)
        return loop.time() - began_s

    assert run_patient(work()) >= 0.05


@pytest.mark.real_time
def test_a_sleep_that_the_machine_prolongs_ends_on_time_by_a_patient_clock(monkeypatch: pytest.MonkeyPatch) -> None:
    select = SelectSelector.select

    def oversleep(self: SelectSelector, timeout: float | None = None) -> list[tuple[SelectorKey, int]]:
        events = select(self, timeout)
        block(0.1)
        return events

    async def sleep() -> float:
        loop = asyncio.get_running_loop()
        began_s = loop.time()
        await asyncio.sleep(0.02)
        return loop.time() - began_s

    monkeypatch.setattr(SelectSelector, "select", oversleep)
    assert 0.02 <= run_patient(sleep()) < 0.06


@pytest.mark.real_time
def test_a_patient_clock_never_goes_back() -> None:
    async def watch() -> list[float]:
        loop, times = asyncio.get_running_loop(), []
        for _ in range(20):
            times.append(loop.time())
            block(0.003)
            times.append(loop.time())
            await asyncio.sleep(0.001)
        return times

    times = run_patient(watch())
    assert times == sorted(times)


def patient_ticks(each: Callable[[float], None], for_s: float) -> Ticker:
    """A ticker of 20 ms after a while in which each tick took 50 ms."""

    async def tick() -> Ticker:
        ticker = Ticker(0.02, lambda: each(0.05))
        ticker.start()
        await asyncio.sleep(for_s)
        ticker.stop()
        return ticker

    return run_patient(tick())


@pytest.mark.real_time
def test_no_tick_of_a_patient_clock_is_missed_where_the_machine_stood_still() -> None:
    ticker = patient_ticks(block, 0.13)
    assert (ticker.ticks, ticker.missed) == (6, 0)


@pytest.mark.real_time
def test_ticks_of_a_patient_clock_are_missed_where_the_process_computes_too_long() -> None:
    ticker = patient_ticks(compute, 0.3)
    assert ticker.missed >= ticker.ticks
    assert ticker.late >= 1


@pytest.mark.real_time
def test_other_clocks_leave_nothing_out() -> None:
    async def left_out() -> float:
        block(0.01)
        return stood_still_s()

    assert asyncio.run(left_out()) == run_virtual(left_out()) == 0.0
