"""Processes that try injections: each drives the course once and forks at its share of the points."""

from __future__ import annotations

import multiprocessing
import os
import signal
from collections.abc import Iterator, Sequence
from multiprocessing.connection import Connection, wait

from canhelm.errors import CanhelmError
from daemon.campaigns.faults.outcome import Outcome
from daemon.campaigns.faults.points import try_all
from daemon.campaigns.faults.strikes import Injection


def outcomes_of(injections: Sequence[Injection], seed: int, workers: int) -> Iterator[Outcome]:
    """Try injections in processes of their own, and hand over the outcomes as they come.

    Raises:
        CanhelmError: a process died.
    """
    context = multiprocessing.get_context("spawn")
    processes, inlets = [], []
    for number in range(min(workers, len(injections))):
        inlet, outlet = context.Pipe(duplex=False)
        process = context.Process(target=_work, args=(injections[number::workers], seed, outlet), daemon=True)
        process.start()
        outlet.close()
        processes.append(process)
        inlets.append(inlet)
    try:
        yield from _received(inlets)
        for process in processes:
            process.join()
            if process.exitcode:
                message = f"a worker process ended with exit code {process.exitcode}"
                raise CanhelmError(message, remedy="the same command goes on; with fewer --workers if memory ran out")
    finally:
        for process in processes:
            process.terminate()


def _received(inlets: list[Connection]) -> Iterator[Outcome]:
    """Outcomes from all pipes until each of them has come to its end."""
    while inlets:
        for inlet in wait(inlets):
            assert isinstance(inlet, Connection)
            try:
                outcome: Outcome = inlet.recv()
            except EOFError:
                inlets.remove(inlet)
            else:
                yield outcome


def _work(injections: Sequence[Injection], seed: int, outlet: Connection) -> None:
    """A process: leaves Ctrl-C to the campaign, and ends when nobody listens any more."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)

    def keep(outcome: Outcome) -> None:
        try:
            outlet.send(outcome)
        except BrokenPipeError:
            os._exit(1)

    try_all(injections, seed, keep)
