"""``canhelm record``: the frames of a running daemon's bus."""

from __future__ import annotations

import contextlib
import math
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import TextIO

from canhelm.errors import UsageError
from daemon.cli.options import DEFAULT, Options
from daemon.cli.output import say, say_warning


def record(file: Path | None = None, /, *, duration: float = math.inf, options: Options = DEFAULT) -> None:
    """Write every frame of the daemon's bus to a new candump log, until Ctrl-C or for a time.

    Example: `canhelm record bus.log --duration 10`

    Args:
        file: The log, which must not exist yet; without it frames go to the output.
        duration: Seconds after which it ends.
    """
    if not duration > 0.0:
        raise UsageError(f"--duration {duration:g} is no time", remedy="give seconds")
    with options.client() as client, _opened(file) as log:
        after: int | None = None
        frames = lost = 0
        begin_s = time.monotonic()
        with contextlib.suppress(KeyboardInterrupt):
            while time.monotonic() - begin_s < duration:
                answer = client.call("bus.frames", after=after)
                after = int(answer["next"])
                frames += len(answer["frames"])
                lost += int(answer["lost"])
                log.writelines(f"{line}\n" for line in answer["frames"])
                log.flush()
    say(f"{frames} frames recorded")
    if lost:
        say_warning(f"{lost} frames are missing: this machine was too busy to take them in time")


@contextlib.contextmanager
def _opened(file: Path | None) -> Iterator[TextIO]:
    if file is None:
        yield sys.stdout
        return
    try:
        log = file.open("x", encoding="ascii")
    except OSError as error:
        remedy = "name a new file in a folder that this user may write to"
        raise UsageError(f"cannot create the log {file}: {error.strerror}", remedy=remedy) from error
    with log:
        yield log
