"""Where the pictures of commands go, and whether they can be drawn."""

from __future__ import annotations

import importlib.util
from pathlib import Path

from canhelm.errors import UsageError
from daemon.cli.output import say


def make_folder(out: Path) -> None:
    """Make the folder that ``--out`` names. Raises UsageError where that cannot be."""
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UsageError(
            f"--out {out} is no folder and cannot be made one: {error.strerror}",
            value=str(out),
            remedy="name a folder that this user may write to",
        ) from error


def can_draw() -> bool:
    """Whether pictures can be drawn; says so where they cannot."""
    if importlib.util.find_spec("matplotlib") is None:
        say("no pictures: matplotlib is missing - pip install 'canhelm[plot]'")
        return False
    return True
