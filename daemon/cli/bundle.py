"""``canhelm doctor --bundle``: everything that a report of a problem needs, in one file."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import zipfile
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from canhelm import protocol
from canhelm.client import Client
from canhelm.errors import CanhelmError, UsageError
from daemon.cli.options import Options
from daemon.cli.version import versions
from daemon.runs import store

JOURNAL = ("journalctl", "--no-pager", "--output=short-iso", "--lines=2000", "--unit=canhelm@*")
JOURNAL_DEADLINE_S = 10.0
TAIL_BYTES = 20_000_000
"""Of each file of a run, how much goes along: its end, where the trouble is."""


def pack(path: Path, findings: Sequence[Mapping[str, Any]], options: Options) -> list[str]:
    """Write the bundle.

    It holds what canhelm itself has written or says: no environment, no keys, no files of other programs.

    Args:
        path: of the ZIP file, which must not exist yet.
        findings: of the doctor.
        options: which daemon; all that run where none is chosen.

    Returns:
        Names of the files in it.

    Raises:
        UsageError: the file exists already, or cannot be written.
    """
    try:
        with zipfile.ZipFile(path, "x", zipfile.ZIP_DEFLATED) as bundle:
            for name, content in _contents(findings, options):
                bundle.writestr(name, content)
            return bundle.namelist()
    except OSError as error:
        remedy = "name a new file in a folder that this user may write to"
        raise UsageError(f"cannot write {path}: {error.strerror or error}", remedy=remedy) from error


def _contents(findings: Sequence[Mapping[str, Any]], options: Options) -> Iterator[tuple[str, str | bytes]]:
    yield "versions.json", _json(versions())
    yield "doctor.json", _json(findings)
    yield from _of_daemons(options)
    yield "journal.txt", _journal()
    yield from _last_runs(options.robot)


def _of_daemons(options: Options) -> Iterator[tuple[str, str | bytes]]:
    chosen = options.socket or options.robot
    for path in [None] if chosen else protocol.find_sockets():
        name = str(options.robot or Path(path or options.socket or "").stem)
        try:
            with Client(path or options.socket, options.robot) as client:
                status = client.status()
        except CanhelmError as error:
            yield f"{name}/status.txt", f"{error.message}\n"
            continue
        yield f"{name}/status.json", _json(status)
        profile = Path(str(status.get("profile_file") or ""))
        for file in (profile, profile.with_name(f"{profile.stem}.calibration.yaml")):
            if file.is_file() and os.access(file, os.R_OK):
                yield f"{name}/{file.name}", file.read_bytes()


def _journal() -> str:
    """The last lines that services wrote, as far as this user may read them; why there are none otherwise."""
    if shutil.which(JOURNAL[0]) is None:
        return "there is no journalctl here\n"
    try:
        done = subprocess.run(JOURNAL, capture_output=True, text=True, timeout=JOURNAL_DEADLINE_S, check=False)
    except (OSError, subprocess.TimeoutExpired) as error:
        return f"{error}\n"
    return done.stdout + done.stderr


def _last_runs(robot: str | None) -> Iterator[tuple[str, str | bytes]]:
    """The newest run, and the newest fault."""
    try:
        runs = store.read_runs(store.all_folders(None, os.environ), robot)
    except CanhelmError as error:
        yield "run.txt", f"{error.message}\n"
        return
    if not runs:
        yield "run.txt", "there are no runs\n"
        return
    faults = [run for run in runs if run.facts.get("kind") == store.FAULT]
    for name, run in (("run", runs[-1]), *(("fault", fault) for fault in faults[-1:])):
        for file in sorted(run.folder.iterdir()):
            yield f"{name}/{file.name}", _tail(file)


def _tail(file: Path) -> bytes:
    with file.open("rb") as opened:
        opened.seek(max(0, file.stat().st_size - TAIL_BYTES))
        return opened.read()


def _json(value: Any) -> str:
    return json.dumps(value, indent=2, ensure_ascii=False, default=str) + "\n"
