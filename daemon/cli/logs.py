"""The log of a process on stderr: for the journal with levels, without the time that it knows itself."""

from __future__ import annotations

import logging
from collections.abc import Mapping

from daemon.cli import journal


class JournalFormatter(logging.Formatter):
    """Messages with their level in front of each line, tracebacks included."""

    def format(self, record: logging.LogRecord) -> str:
        """The record as the journal takes it."""
        level = next((theirs for ours, theirs in _LEVELS if record.levelno >= ours), journal.DEBUG)
        return journal.with_level(super().format(record), level)


_LEVELS = ((logging.ERROR, journal.ERROR), (logging.WARNING, journal.WARNING), (logging.INFO, journal.INFO))


def log_to_stderr(environment: Mapping[str, str]) -> None:
    """Let the log of this process go to stderr: for the journal with levels, else with time stamps."""
    if journal.reads_stderr(environment):
        handler = logging.StreamHandler()
        handler.setFormatter(JournalFormatter("%(message)s"))
        logging.basicConfig(level=logging.INFO, handlers=[handler])
    else:
        logging.basicConfig(level=logging.INFO, format="%(asctime)s %(levelname)s %(name)s %(message)s")
