"""Work on the disk: jobs that compute for a while leave the control cycle its time."""

from __future__ import annotations

import asyncio
from functools import partial

from daemon.runtime.disk import PAUSE_S, Disk
from drivers.simulated.computer_trouble import ComputerTrouble


def make_disk() -> Disk:
    return Disk(lambda error: None, ComputerTrouble())


async def test_jobs_in_turns_come_in_order_with_pauses_between() -> None:
    disk, loop, done = make_disk(), asyncio.get_running_loop(), list[tuple[str, float]]()
    begun_s = loop.time()
    disk.do_in_turns(*(partial(lambda name: done.append((name, loop.time() - begun_s)), name) for name in "abc"))
    await asyncio.sleep(1.0)
    assert done == [("a", 0.0), ("b", PAUSE_S), ("c", 2 * PAUSE_S)]


async def test_what_is_left_at_the_end_is_done_at_once() -> None:
    disk, done = make_disk(), list[str]()
    disk.do_in_turns(*(partial(done.append, name) for name in "abc"))
    disk.close()
    assert done == ["a", "b", "c"]
