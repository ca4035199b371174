"""Tasks that nobody awaits: kept alive, looked after when they fail, ended together."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable, Coroutine
from typing import Any

LOGGER = logging.getLogger("canhelm")


class TaskSet:
    """A set of running tasks.

    Args:
        on_failure: called with a task's name and its exception, when one fails by what no code expected.
    """

    def __init__(self, on_failure: Callable[[str, BaseException], None]) -> None:
        self._tasks: set[asyncio.Task[None]] = set()
        self._on_failure = on_failure
        self._closed = False

    def spawn(self, work: Coroutine[Any, Any, None], name: str) -> None:
        """Run a coroutine as a task; not at all once this set was closed."""
        if self._closed:
            work.close()
            return
        task = asyncio.get_running_loop().create_task(work, name=name)
        self._tasks.add(task)
        task.add_done_callback(self._done)

    async def wait(self, name: str) -> None:
        """Wait until all tasks of this name have ended."""
        named = [task for task in self._tasks if task.get_name() == name]
        if named:
            await asyncio.wait(named)

    async def close(self) -> None:
        """Cancel all and wait for their ends."""
        self._closed = True
        for task in self._tasks:
            task.cancel()
        if self._tasks:
            await asyncio.wait(self._tasks)

    def _done(self, task: asyncio.Task[None]) -> None:
        self._tasks.discard(task)
        error = None if task.cancelled() else task.exception()
        if error is not None:
            LOGGER.error("%s failed", task.get_name(), exc_info=error)
            self._on_failure(task.get_name(), error)
