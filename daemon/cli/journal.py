"""Lines for the system's journal: each with its level in front as sd-daemon(3) has them, ``<3>`` for an error."""

from __future__ import annotations

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
