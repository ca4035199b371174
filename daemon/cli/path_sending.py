"""Sending a path file to the daemon; what it finds wrong with a piece is told with the piece's line."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

import msgspec

from canhelm.errors import CanhelmError
from daemon.cli.motion import run_motion
from daemon.cli.options import MotionOptions, Options
from profiles.path_file import PathFile, load_path_file

MAX_PART_CHARACTERS = 40_000
"""Pieces in one request, as JSON: the daemon reads lines of 64 KiB at most."""


def drive_path(options: MotionOptions, name: str, /, *, no_wait: bool, **params: Any) -> int:
    """Read a path file, send it, drive it; the exit code.

    Args:
        options: which daemon, and how to print.
        name: of the file, or of a shipped path.
        no_wait: hand the motion to the daemon.
        params: further parameters of ``drive.path``.

    Raises:
        CanhelmError: with file and line where a piece is the reason.
    """
    file = load_path_file(name)
    try:
        *first, last = _parts(file)
        kept = _keep(options, first)
        start = file.spec.start
        path = {"pieces": last} if start is None else {"pieces": last, "start": msgspec.to_builtins(start)}
        return run_motion(options, "drive.path", no_wait=no_wait, path=path, kept=kept, **params)
    except CanhelmError as error:
        raise file.located(error) from None


def _parts(file: PathFile) -> Iterator[list[Any]]:
    """The pieces, in parts that fit into a request each."""
    part: list[Any] = []
    characters = 0
    for piece in msgspec.to_builtins(file.spec.pieces):
        size = len(json.dumps(piece))
        if part and characters + size > MAX_PART_CHARACTERS:
            yield part
            part, characters = [], 0
        part.append(piece)
        characters += size
    yield part


def _keep(options: Options, parts: list[list[Any]]) -> str | None:
    """Let the daemon keep all parts but the last one; the name by which it keeps them."""
    kept: str | None = None
    if parts:
        with options.client() as client:
            for part in parts:
                kept = str(client.call("path.add", pieces=part, kept=kept)["kept"])
    return kept
