"""Runs a process to its end, of which nothing is left whatever happens."""

from __future__ import annotations

import os
import signal
import subprocess
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress


def run_to_end(command: Sequence[str], timeout_s: float | None, descriptors: Sequence[int] = ()) -> int | None:
    """The exit status of a command, or None when its time was over; its output goes to ours.

    The command has a session of its own, which is killed in the end with all that is still in it. Its output is copied
    by a process between, since a user-mode kernel takes a terminal for its own if it gets one.

    Args:
        command: Program and arguments.
        timeout_s: Wall time until it is killed, in seconds.
        descriptors: Open files that it gets beside.
    """
    with _ended_by_signals(), subprocess.Popen(["cat"], stdin=subprocess.PIPE, start_new_session=True) as output:
        process = subprocess.Popen(
            command,
            stdin=subprocess.DEVNULL,
            stdout=output.stdin,
            stderr=output.stdin,
            start_new_session=True,
            pass_fds=descriptors,
        )
        try:
            return process.wait(timeout_s)
        except subprocess.TimeoutExpired:
            return None
        finally:
            with suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
            process.wait()


@contextmanager
def _ended_by_signals() -> Iterator[None]:
    """The signals that ask this process to end do so by an exception, so that it clears up."""

    def end(number: int, _frame: object) -> None:
        raise SystemExit(128 + number)

    asking = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
    before = {number: signal.signal(number, end) for number in asking}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
