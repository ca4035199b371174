"""Who drives the runs of a campaign: this process, one process a core, or the workers of a Dask cluster."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from importlib.util import find_spec
from typing import Final

from canhelm.errors import CanhelmError, Timeout, UsageError
from daemon.campaigns.cases import Case, Outcome
from daemon.campaigns.following_runs import ideal_run, outcome
from daemon.campaigns.results import Result

BATCH: Final = {"ideal": 8, "can": 1}
"""Runs that a worker is given at once; what a crash can lose of each."""
DASK_PATIENCE_S: Final = 10.0


def drive_batch(cases: Sequence[Case]) -> list[Result]:
    """Drive some cases, one after the other."""
    return [(case, _outcome(case)) for case in cases]


def _outcome(case: Case) -> Outcome:
    if case.through == "ideal":
        return outcome(ideal_run(case))
    from daemon.campaigns.can_runs import can_outcome

    return can_outcome(case)


def drive_all(cases: Sequence[Case], workers: int, dask: str | None = None) -> Iterator[list[Result]]:
    """Drive all cases, and hand over results as they come, in any order.

    Args:
        cases: to be driven.
        workers: processes; 1: this one.
        dask: address of a Dask scheduler, whose workers are used instead.

    Raises:
        UsageError: Dask is not installed.
        Timeout: no scheduler answers.
        CanhelmError: a worker died.
    """
    size = BATCH[cases[0].through] if cases else 1
    batches = [cases[begin : begin + size] for begin in range(0, len(cases), size)]
    if dask is not None:
        yield from _on_dask(batches, dask)
    elif workers == 1:
        yield from map(drive_batch, batches)
    else:
        yield from _on_processes(batches, workers)


def _on_processes(batches: Sequence[Sequence[Case]], workers: int) -> Iterator[list[Result]]:
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(workers, context, _live_with_parent) as pool:
        waiting = [pool.submit(drive_batch, batch) for batch in batches]
        try:
            for done in as_completed(waiting):
                yield done.result()
        except BrokenProcessPool:
            message = "a worker process died"
            raise CanhelmError(
                message, remedy="the same command goes on; with fewer --workers if memory ran out"
            ) from None
        finally:
            pool.shutdown(wait=False, cancel_futures=True)


def _live_with_parent() -> None:
    """Leave Ctrl-C to the campaign, and end when it is gone, however it ended."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    assert parent is not None
    parent.join()
    os._exit(1)


def _on_dask(batches: Sequence[Sequence[Case]], address: str) -> Iterator[list[Result]]:
    if find_spec("distributed") is None:
        raise UsageError("Dask is not installed", remedy="pip install 'canhelm[dask]'")
    from distributed import Client
    from distributed import as_completed as dask_as_completed

    try:
        client = Client(address, timeout=DASK_PATIENCE_S)
    except (OSError, TimeoutError, ValueError) as error:
        message = f"no Dask scheduler at {address}: {error}"
        raise Timeout(message, value=address, remedy="give the address that `dask scheduler` prints") from None
    with client:
        for done in dask_as_completed(client.map(drive_batch, batches, pure=False)):
            yield done.result()
