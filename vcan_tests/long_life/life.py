"""One long life: a daemon with everything that it can have, on virtual time, until its hours are over."""

from __future__ import annotations

import asyncio
import logging
import sys
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from random import Random
from typing import Final

from daemon.app import App, GatewayAccess
from daemon.runs.store import RunStore
from profiles.schema import Profile
from vcan_tests.long_life.chapters import opening, random_chapter
from vcan_tests.long_life.figures import complaints
from vcan_tests.long_life.loop import VirtualSocketLoop
from vcan_tests.long_life.samples import LOGS, RUNS, Sample, read_samples, take_sample, write_sample
from vcan_tests.long_life.stage import Stage

RECORD_BYTES: Final = 16_000_000
RUNS_BYTES: Final = 40_000_000
"""Small, so that both are full soon and old files have to go all the time."""
SETTLE_S: Final = 2.0
"""Between the last client of a chapter and a sample."""

NAMES: Final = 100_000
"""More than Python's table of interned strings, where the name of each file comes and goes, takes before it grows."""


@dataclass(slots=True)
class Life:
    """What became of it.

    Attributes:
        seed: by which it can be lived again.
        samples: about one a period, the first after the opening; only when life is over.
        counts: what has happened, by name.
        defects: what must not happen, with its time; none in a good life.
        ended_early: a person had enough of it.
    """

    seed: int
    samples: list[Sample] = field(default_factory=list)
    counts: dict[str, int] = field(default_factory=dict)
    defects: list[str] = field(default_factory=list)
    ended_early: bool = False


class _Tracebacks(logging.Handler):
    """Keeps what was logged with a traceback: a defect of the daemon, whatever stopped it."""

    def __init__(self) -> None:
        super().__init__()
        self.told: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        if record.exc_info:
            self.told.append(self.format(record))


def live(
    profile: Profile,
    hours: float,
    seed: int,
    folder: Path,
    samples: Path,
    on_sample: Callable[[Life, Sample], None],
    period_s: float = 60.0,
) -> Life:
    """Live so many virtual hours; Ctrl-C ends a life early, and it is judged as far as it went.

    Args:
        profile: the robot, a MAX2D.
        hours: virtual time.
        seed: of everything random.
        folder: for the sockets, the record and the runs; empty.
        samples: file to which each sample is appended at once.
        on_sample: hears of each sample.
        period_s: of the samples.
    """
    tracebacks = _Tracebacks()
    logger = logging.getLogger()
    logger.addHandler(tracebacks)
    life = Life(seed)
    app = partial(make_app, profile, folder, seed)

    def look() -> None:
        sample = take_sample(folder, life.counts)
        write_sample(samples, sample)
        on_sample(life, sample)

    try:
        with asyncio.Runner(loop_factory=VirtualSocketLoop) as runner:
            runner.run(_live(life, 3600.0 * hours, app, look, period_s))
    except KeyboardInterrupt:
        if not samples.exists():
            raise
        life.ended_early = True
    finally:
        logger.removeHandler(tracebacks)
    life.samples = read_samples(samples)
    life.defects += tracebacks.told
    life.defects += complaints(life.samples, RECORD_BYTES, RUNS_BYTES)
    return life


async def _live(
    life: Life, end_s: float, make_app: Callable[[], App], look: Callable[[], None], period_s: float
) -> None:
    loop = asyncio.get_running_loop()
    app = make_app()
    before = asyncio.all_tasks()
    await app.start()
    stage = Stage(app, Random(life.seed))
    await stage.recover("the boot")
    _fill_names()
    await stage.peace("opening", opening(stage))
    while True:
        await asyncio.sleep(SETTLE_S)
        life.counts, life.defects = dict(stage.counts), stage.defects
        look()
        if loop.time() >= end_s:
            break
        next_s = min(loop.time() + period_s, end_s)
        while loop.time() < next_s:
            await random_chapter(stage)
    assert app.server is not None
    assert app.gateway is not None
    if errors := app.server.counters.internal_errors + app.gateway.counters.internal_errors:
        stage.defect(f"{errors} requests failed inside the daemon")
    await app.close()
    if left := asyncio.all_tasks() - before:
        stage.defect(f"tasks left over: {left}")


def _fill_names() -> None:
    """Let Python's table of names grow at once, by 940 KiB, and not when so many files have come and gone."""
    for number in range(NAMES):
        sys.intern(f"file {number}")


def make_app(profile: Profile, folder: Path, seed: int) -> App:
    """The daemon with everything that it can have: sockets, gateway, continuous record, runs."""
    return App(
        profile,
        socket=folder / "robot.sock",
        gateway=GatewayAccess(folder / "gateway.sock"),
        record=folder / LOGS,
        record_bytes=RECORD_BYTES,
        runs=RunStore(folder / RUNS, RUNS_BYTES),
        seed=seed,
    )
