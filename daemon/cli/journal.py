"""Log lines for the system's journal: each with its level, without the time that the journal knows itself.

Levels stand in front of a line as sd-daemon(3) has them, ``<3>`` for an error.
"""

from __future__ import annotations

import logging
import os
from collections.abc import Mapping

ERROR, WARNING, INFO, DEBUG = 3, 4, 6, 7
"""Levels of syslog(3)."""
_STDERR = 2


def reads_stderr(environment: Mapping[str, str], fd: int = _STDERR) -> bool:
    """Whether stderr goes to the journal (systemd.exec(5), JOURNAL_STREAM), and not, say, through a pipe.

    Args:
        environment: of this process.
        fd: of stderr.
    """
    device, _, inode = environment.get("JOURNAL_STREAM", "").partition(":")
    try:
        found = os.fstat(fd)
    except OSError:
        return False
    return (device, inode) == (str(found.st_dev), str(found.st_ino))


def with_level(text: str, level: int) -> str:
    """The text with its level in front of each line, as each becomes an entry of its own."""
    return "\n".join(f"<{level}>{line}" for line in text.splitlines())


class JournalFormatter(logging.Formatter):
    """Messages with their level in front of each line, tracebacks included."""

    def format(self, record: logging.LogRecord) -> str:
        """The record as the journal takes it."""
        level = next((theirs for ours, theirs in _LEVELS if record.levelno >= ours), DEBUG)
        return with_level(super().format(record), level)


_LEVELS = ((logging.ERROR, ERROR), (logging.WARNING, WARNING), (logging.INFO, INFO))


def log_to_stderr(environment: Mapping[str, str]) -> None:
    """Let the log of this process go to stderr: for the journal with levels, else with time stamps."""
    if reads_stderr(environment):
        handler = logging.StreamHandler()
        handler.setFormatter(JournalFormatter("%(message)s"))
        logging.basicConfig(level=logging.INFO, handlers=[handler])
    else:
        logging.basicConfig(level=logging.INFO, format="%(asctime)s %(levelname)s %(name)s %(message)s")
