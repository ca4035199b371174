"""Runs processes to their ends; nothing is left of them whatever happens."""

from __future__ import annotations

import asyncio
import os
import signal
from asyncio.subprocess import DEVNULL
from collections.abc import AsyncIterator, Coroutine, Sequence
from contextlib import asynccontextmanager, suppress
from typing import IO, Any, TypeVar

Result = TypeVar("Result")


def run(work: Coroutine[Any, Any, Result]) -> Result:
    """The result of what works with processes; signals that ask this one to end let it clear up before that.

    Raises:
        SystemExit: there was such a signal.
    """
    asked: list[signal.Signals] = []

    async def work_until_asked() -> Result:
        task, loop = asyncio.current_task(), asyncio.get_running_loop()
        assert task is not None

        def end(number: signal.Signals) -> None:
            asked.append(number)
            task.cancel()

        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            loop.add_signal_handler(number, end, number)
        return await work

    try:
        return asyncio.run(work_until_asked())
    except asyncio.CancelledError:
        raise SystemExit(128 + asked[0]) from None


async def run_to_end(
    command: Sequence[str], timeout_s: float | None, descriptors: Sequence[int] = (), output: IO[bytes] | None = None
) -> int | None:
    """The exit status of a command, or None when its time was over.

    The command has a session of its own, which is killed in the end with all that is still in it. Its output is copied
    by a process between, since a user-mode kernel takes a terminal for its own if it gets one.

    Args:
        command: Program and arguments.
        timeout_s: Wall time until it is killed, in seconds.
        descriptors: Open files that it gets beside.
        output: Where its output goes; None: where ours goes.
    """
    async with _copied_to(output) as copier:
        process = await asyncio.create_subprocess_exec(
            *command, stdin=DEVNULL, stdout=copier, stderr=copier, start_new_session=True, pass_fds=descriptors
        )
        try:
            async with asyncio.timeout(timeout_s):
                return await process.wait()
        except TimeoutError:
            return None
        finally:
            with suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
            await process.wait()


@asynccontextmanager
async def _copied_to(output: IO[bytes] | None) -> AsyncIterator[int]:
    """A pipe whose end, when nobody holds it any more, ends the process that copies what comes through it."""
    reader, writer = os.pipe()
    copying = await asyncio.create_subprocess_exec("cat", stdin=reader, stdout=output, start_new_session=True)
    os.close(reader)
    try:
        yield writer
    finally:
        os.close(writer)
        await copying.wait()
