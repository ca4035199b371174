"""How steady SYNC is by what paces it: |period - 10 ms| of a timerfd on the loop and of asyncio's own timers."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine, Mapping, Sequence
from itertools import pairwise
from typing import Any

from benchmarks.pictures import draw_histograms
from benchmarks.section import Options, Section, Table
from benchmarks.spread import cell_heads, spread
from daemon.runtime.clock import Ticker

PERIOD_S = 0.01
LEAST_US = 0.1
"""Shown for less, so that a logarithmic scale can."""

Producer = Callable[[int, Callable[[], None]], Coroutine[Any, Any, None]]
"""Ticks so many times."""


def run(options: Options) -> Section:
    """On a loop that has nothing else to do."""
    errors_us: dict[str, list[float]] = {}
    for words, produce in PRODUCERS.items():
        options.tell(words)
        errors_us[words] = period_errors_us(asyncio.run(_times_s(produce, ticks_in(options.seconds))))
    picture = draw_histograms(errors_us, "Jitter of SYNC", "|period - 10 ms|", options.out / "jitter.png")
    figures = {words: spread(errors).figures("us") for words, errors in errors_us.items()}
    return Section("jitter", [jitter_table("an idle loop", errors_us)], figures, [picture])


def ticks_in(seconds: float) -> int:
    """Ticks in a time; two of them make a period."""
    return max(2, round(seconds / PERIOD_S))


def jitter_table(where: str, errors_us: Mapping[str, Sequence[float]]) -> Table:
    """Errors of the period by what paces SYNC."""
    rows: list[tuple[str | float | None, ...]] = [(words, *spread(errors).cells) for words, errors in errors_us.items()]
    return Table(f"|period - {1e3 * PERIOD_S:g} ms| on {where}", ("SYNC paced by", *cell_heads("us")), rows)


def period_errors_us(times_s: Sequence[float]) -> list[float]:
    """How far each period is from the nominal one."""
    return [max(LEAST_US, 1e6 * abs(end_s - begin_s - PERIOD_S)) for begin_s, end_s in pairwise(times_s)]


async def _times_s(produce: Producer, ticks: int) -> list[float]:
    loop, times_s = asyncio.get_running_loop(), list[float]()
    await produce(ticks, lambda: times_s.append(loop.time()))
    return times_s


async def by_timerfd(ticks: int, tick: Callable[[], None]) -> None:
    """Tick by the control cycle's own ticker."""
    ended, left = asyncio.Event(), ticks

    def on_tick() -> None:
        nonlocal left
        tick()
        left -= 1
        if not left:
            ticker.stop()
            ended.set()

    ticker = Ticker(PERIOD_S, on_tick)
    ticker.start()
    await ended.wait()


async def by_call_at(ticks: int, tick: Callable[[], None]) -> None:
    """Tick by ``loop.call_at`` at absolute deadlines."""
    loop, ended = asyncio.get_running_loop(), asyncio.Event()
    begin_s = loop.time()

    def on_timer(number: int) -> None:
        tick()
        if number == ticks:
            ended.set()
        else:
            loop.call_at(begin_s + (number + 1) * PERIOD_S, on_timer, number + 1)

    loop.call_at(begin_s + PERIOD_S, on_timer, 1)
    await ended.wait()


PRODUCERS: dict[str, Producer] = {"timerfd on the loop": by_timerfd, "asyncio call_at": by_call_at}
