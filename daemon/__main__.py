"""``python -m daemon`` is the command ``canhelm``: where the process begins."""

from __future__ import annotations

import gc
import os
import signal
import sys
from collections.abc import Callable

INTERRUPTED = 130


def main() -> int:
    """Run the command line of this process; Ctrl-C and SIGTERM end it in order, even while it is being loaded.

    Returns:
        The exit code.
    """
    try:
        signal.signal(signal.SIGTERM, signal.default_int_handler)
        _replace_closed_outputs()
        run = _load()
        return run()
    except KeyboardInterrupt:
        return INTERRUPTED


def _load() -> Callable[[], int]:
    """The command line; what it has loaded lives as long as the process, and no collection of garbage looks at it."""
    gc.disable()
    from daemon.cli.main import main as run

    gc.freeze()
    gc.enable()
    return run


def _replace_closed_outputs() -> None:
    """Python has no stdout or stderr where the shell has closed it (``>&-``): nobody wants what is written there."""
    nowhere = os.fdopen(os.open(os.devnull, os.O_WRONLY), "w")
    sys.stdout = sys.stdout or nowhere
    sys.stderr = sys.stderr or nowhere


if __name__ == "__main__":
    sys.exit(main())
