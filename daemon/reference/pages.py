"""Which reference pages there are, and writing them down for the site and for ``man``."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

from daemon.reference.api import api
from daemon.reference.commands import commands
from daemon.reference.errors import errors
from daemon.reference.objects import objects
from daemon.reference.profile import profile

PAGES: dict[str, Callable[[], str]] = {
    "api.md": api,
    "commands.md": commands,
    "errors.md": errors,
    "objects.md": objects,
    "profile.md": profile,
}
"""The pages of docs/reference by the names of their files."""


def site_pages() -> dict[str, str]:
    """Every page as Markdown, by the name of its file."""
    return {name: make() for name, make in PAGES.items()}


def write(files: Mapping[str, str], folder: Path) -> None:
    """Write files into a folder, which is made where it is missing. Raises OSError."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in files.items():
        (folder / name).write_text(text, encoding="utf-8")
