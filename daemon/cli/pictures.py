"""Where the pictures of commands go, and whether they can be drawn."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from tempfile import TemporaryFile

from canhelm.errors import UsageError
from daemon.cli.output import say


def make_folder(out: Path) -> None:
    """Make the folder that ``--out`` names. Raises UsageError where nothing can be written into it."""
    remedy = "name a folder that this user may write to"
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        message = f"--out {out} is no folder and cannot be made one: {error.strerror}"
        raise UsageError(message, value=str(out), remedy=remedy) from error
    try:
        TemporaryFile(dir=out).close()
    except OSError as error:
        message = f"nothing can be written into --out {out}: {error.strerror}"
        raise UsageError(message, value=str(out), remedy=remedy) from error


def can_draw() -> bool:
    """Whether pictures can be drawn; says so where they cannot."""
    if importlib.util.find_spec("matplotlib") is None:
        say("no pictures: matplotlib is missing - pip install 'canhelm[plot]'")
        return False
    return True
