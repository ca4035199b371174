"""Readers of files that people write: an input is a file, and a mistake is told as one, with its place and a remedy."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TypeVar

from canhelm.errors import CanhelmError, ConfigError, UsageError

T = TypeVar("T")
LONGEST_MESSAGE = 1_000_000


@contextmanager
def file_of(content: bytes, name: str) -> Iterator[Path]:
    """A file that is gone afterwards, in a folder of its own."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / name
        path.write_bytes(content)
        yield path


def read_or_told(read: Callable[[], T], path: Path) -> T | None:
    """What was read; None where the file is wrong and a person has been told what and where.

    Raises:
        AssertionError: as :func:`require_helpful`.
    """
    try:
        return read()
    except (ConfigError, UsageError) as error:
        require_helpful(error, path)
    return None


def require_helpful(error: CanhelmError, path: Path) -> None:
    """Whether an error tells the file and what to do about it, in a message of a size that somebody reads."""
    text = str(error)
    assert path.name in text, text
    assert error.remedy or "; " in error.message, text
    assert len(text) < LONGEST_MESSAGE, len(text)
