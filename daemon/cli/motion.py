"""Carrying out a motion from the command line: wait, show progress on a terminal, stop it when interrupted."""

from __future__ import annotations

import shutil
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from types import FrameType
from typing import Any

from canhelm.client import Client
from canhelm.errors import CanhelmError
from daemon.cli.options import MotionOptions
from daemon.cli.output import say, show, words

INTERRUPTED = 130
PROGRESS_HZ = 5.0
CLEAR_LINE = "\r\x1b[K"


def run_motion(options: MotionOptions, method: str, /, *, no_wait: bool = False, **params: Any) -> int:
    """Call a motion's method and print its result.

    Args:
        options: which daemon, how to print, and whether to take the robot over.
        method: as in ``api.schema``.
        no_wait: hand the motion to the daemon and print its id.
        params: the method's parameters.

    Returns:
        The exit code: 0, or 130 where a signal interrupted it and the motion was stopped.
    """
    with options.client() as client:
        if options.takeover:
            say(takeover_text(client.call("lease.take")))
        if no_wait:
            show(client.call(method, wait=False, **params), json=options.json)
            return 0
        if params.get("duration_s", 0.0) is None and sys.stderr.isatty():
            asked = ", ".join(f"{name} {words(value)}" for name, value in params.items() if value is not None)
            say(f"{asked}: without --duration this goes on until Ctrl-C or `canhelm stop`")
        try:
            with signals_interrupt(), progress_line(client):
                result = client.call(method, **params)
        except KeyboardInterrupt:
            state = client.call("lease.close").get("state", "unknown")
            say(f"interrupted: the motion was stopped (vehicle: {state})")
            return INTERRUPTED
        show(result, json=options.json)
    return 0


def takeover_text(taken: dict[str, Any]) -> str:
    """What ``lease.take`` has answered, in words."""
    return f"taken over from {taken['taken_from']}" if taken["taken_from"] else "nobody else had the robot"


@contextmanager
def signals_interrupt() -> Iterator[None]:
    """SIGINT (even where a shell had it ignored, as for background jobs) and SIGTERM raise KeyboardInterrupt."""
    before = {number: signal.signal(number, _interrupt) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _interrupt(number: int, frame: FrameType | None) -> None:
    raise KeyboardInterrupt


@contextmanager
def progress_line(client: Client) -> Iterator[None]:
    """One line on stderr that follows the motion, and the daemon's warnings above it; nothing off a terminal.

    What ends the motion and was among these warnings is not raised in the same words again.
    """
    if not sys.stderr.isatty():
        yield
        return
    told: set[str] = set()
    client.on_notification = partial(_draw, told)
    client.call("subscribe", rate_hz=PROGRESS_HZ)
    try:
        yield
    except CanhelmError as error:
        if error.message not in told:
            raise
        raise type(error)("the motion was ended by this", node=error.node, remedy=error.remedy) from error
    finally:
        client.on_notification = None
        print(CLEAR_LINE, end="", file=sys.stderr, flush=True)


def _draw(told: set[str], method: str, params: dict[str, Any]) -> None:
    if method == "status":
        width = shutil.get_terminal_size().columns - 1
        print(f"{CLEAR_LINE}{cut(progress_text(params), width)}", end="", file=sys.stderr, flush=True)
    elif method == "event" and params.get("severity") != "info":
        print(CLEAR_LINE, end="", file=sys.stderr)
        message = str(params.get("message"))
        told.add(message)
        say(message)


def progress_text(status: dict[str, Any]) -> str:
    """What the motions report of themselves, in one line; the vehicle's state where none runs."""
    motions = status.get("motions") or ()
    return "; ".join(_progress(motion) for motion in motions) or str(status.get("state"))


def _progress(motion: dict[str, Any]) -> str:
    """Words as they are, then numbers, then lists; without what is empty or zero."""
    told = [(key, value) for key, value in motion.items() if value and key not in ("motion", "kind", "drives")]
    told.sort(key=lambda item: isinstance(item[1], list) - isinstance(item[1], str))
    parts = [value if isinstance(value, str) else f"{key} {words(value, digits=3)}" for key, value in told]
    return f"{motion.get('kind')}: {', '.join(parts)}"


def cut(text: str, width: int) -> str:
    """A line that is too long, cut after a whole item."""
    return text if len(text) <= width else text[: width + 1].rpartition(",")[0]
