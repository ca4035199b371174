"""The runs that a robot's motions and faults have left: their list, their files, their pictures."""

from __future__ import annotations

import asyncio
import importlib.util
import re
import stat
import sys
import tempfile
from functools import lru_cache
from pathlib import Path
from typing import Any, Final

from canhelm.aio import Client
from canhelm.errors import ConfigError, DaemonNotRunning, NotReady, Timeout, UsageError
from daemon.runs.store import FACTS, FAULT, RUNS, Run, RunStore, read_yaml
from daemon.station.robots import Robot

MAX_LISTED: Final = 500
"""Of the newest runs."""
LONGEST_NUMBER: Final = 9
DRAWING_S: Final = 60.0
"""Longest time that a picture may take."""
_FILE: Final = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{0,99}", re.ASCII)
_ONE_AT_A_TIME: Final = asyncio.Semaphore(1)
"""Pictures that are drawn at once: drawing takes a whole processor."""


async def list_runs(robot: Robot, params: dict[str, Any]) -> dict[str, Any]:
    """The newest runs, oldest first. Raises ConfigError where this user may not read them.

    What has not ended is under way where the daemon says so. It is read again after that has been asked, as it may
    have ended meanwhile.
    """
    folder = await _folder(robot)
    if folder is None:
        return {"runs": []}
    runs = await asyncio.to_thread(_list, folder, robot.name)
    if not all(run["ended"] for run in runs):
        under_way = await _under_way(robot)
        runs = await asyncio.to_thread(_list_again, folder, runs, under_way)
    return {"runs": runs}


async def run_file(robot: Robot, run: str, name: str) -> Path:
    """A file of a run.

    Args:
        robot: whose run it is.
        run: its number.
        name: of the file, as :func:`list_runs` tells it.

    Raises:
        UsageError: there is no such run, or no such file in it.
        ConfigError: this user may not read it.
    """
    folder = await _run_folder(robot, run)
    files = await asyncio.to_thread(_files, folder)
    if name not in files:
        raise UsageError(f"run {int(run)} has no file {name[:80]!r}", value=name[:80], remedy="choose one of its files")
    return folder / name


async def draw(robot: Robot, run: str) -> bytes:
    """The picture of a run, as PNG; a process of its own draws it.

    Raises:
        UsageError: there is no such run.
        ConfigError: it has no rows to be drawn.
        NotReady: pictures cannot be drawn here.
        Timeout: it takes too long.
    """
    folder = await _run_folder(robot, run)
    if importlib.util.find_spec("matplotlib") is None:
        remedy = "pip install 'canhelm[plot]' where the station runs"
        raise NotReady("no pictures: matplotlib is missing", remedy=remedy)
    async with _ONE_AT_A_TIME:
        with tempfile.TemporaryDirectory(prefix="canhelm-plot-") as place:
            picture = Path(place) / "run.png"
            await _draw(folder, picture)
            return await asyncio.to_thread(picture.read_bytes)


async def _draw(folder: Path, picture: Path) -> None:
    """`canhelm plot` in a process of its own."""
    command = (sys.executable, "-m", "daemon", "plot", str(int(folder.name)), "--runs", str(folder.parent))
    pipe, nowhere = asyncio.subprocess.PIPE, asyncio.subprocess.DEVNULL
    process = await asyncio.create_subprocess_exec(
        *command, "--out", str(picture), stdin=nowhere, stdout=nowhere, stderr=pipe
    )
    try:
        async with asyncio.timeout(DRAWING_S):
            _, told = await process.communicate()
    except TimeoutError:
        what = f"the picture of run {int(folder.name)} takes more than {DRAWING_S:g} s"
        raise Timeout(what, remedy=f"draw it by `canhelm plot {int(folder.name)}`") from None
    finally:
        if process.returncode is None:
            process.kill()
            await process.wait()
    if process.returncode:
        what = told.decode(errors="replace").strip() or f"canhelm plot ended with {process.returncode}"
        raise ConfigError(what, remedy="download its files, and look at them")


async def _folder(robot: Robot) -> Path | None:
    """Where the daemon keeps its runs, as it tells; without one where it would; None where it keeps none."""
    try:
        told = await _told_of_runs(robot)
    except (DaemonNotRunning, TimeoutError):
        return robot.folder / RUNS
    return Path(told["folder"]) if told else None


async def _under_way(robot: Robot) -> frozenset[int]:
    """The runs that the daemon writes now; without a daemon there are none."""
    try:
        told = await _told_of_runs(robot)
    except (DaemonNotRunning, TimeoutError):
        return frozenset()
    return frozenset(told["under_way"] if told else ())


async def _told_of_runs(robot: Robot) -> dict[str, Any] | None:
    """What the daemon says of its runs; None where it keeps none. Raises DaemonNotRunning, TimeoutError."""
    async with asyncio.timeout(2.0), Client(robot.socket) as client:
        told: dict[str, Any] | None = (await client.status())["runs"]
        return told


async def _run_folder(robot: Robot, run: str) -> Path:
    """The folder of a run of this robot, by its number. Raises UsageError, ConfigError."""
    folder = await _folder(robot)
    if folder and run.isascii() and run.isdecimal() and len(run) <= LONGEST_NUMBER:
        found = await asyncio.to_thread(_find, folder, robot.name, int(run))
        if found is not None:
            return found
    raise UsageError(f"{robot.name} has no run {run[:20]!r}", value=run[:20], remedy="choose one of the list")


# --- in a thread -----------------------------------------------------------------------------------------------------


def _list(folder: Path, robot: str) -> list[dict[str, Any]]:
    runs = [_told(path) for path in _folders(folder)[-MAX_LISTED:]]
    return [run for run in runs if run.pop("robot") == robot]


def _list_again(folder: Path, runs: list[dict[str, Any]], under_way: frozenset[int]) -> list[dict[str, Any]]:
    """The same runs, with those marked that are under way, and how others have ended by now."""
    return [run if run["ended"] else _again(folder, run, under_way) for run in runs]


def _again(folder: Path, run: dict[str, Any], under_way: frozenset[int]) -> dict[str, Any]:
    if run["run"] in under_way:
        return {**run, "under_way": True}
    now = _told(folder / f"{run['run']:04d}")
    return {key: value for key, value in now.items() if key != "robot"}


def _find(folder: Path, robot: str, number: int) -> Path | None:
    for path in _folders(folder):
        if int(path.name) == number and _run(path).robot == robot:
            return path
    return None


def _folders(folder: Path) -> list[Path]:
    """The folders of runs, oldest first; a link is none. Raises ConfigError."""
    try:
        return [path for path in RunStore(folder).folders() if path.is_dir() and not path.is_symlink()]
    except OSError as error:
        remedy = "let the user that runs the station read there: sudo usermod -aG canhelm USER"
        raise ConfigError(f"runs in {folder} cannot be read: {error.strerror}", remedy=remedy) from error


def _told(path: Path) -> dict[str, Any]:
    run = _run(path)
    motion = run.facts.get("motion")
    return {
        "robot": run.robot,
        "run": run.number,
        "begun": run.begun,
        "struck": run.facts.get("struck"),
        "method": f"fault in {motion or 'no motion'}" if run.facts.get("kind") == FAULT else motion,
        "ended": run.facts.get("ended"),
        "message": run.facts.get("message", ""),
        "under_way": False,
        "duration_s": run.facts.get("duration_s"),
        "files": _files(path),
    }


def _run(path: Path) -> Run:
    try:
        changed_ns = (path / FACTS).stat().st_mtime_ns
    except OSError:
        changed_ns = 0
    return _read(path, changed_ns)


@lru_cache(maxsize=MAX_LISTED)
def _read(path: Path, changed_ns: int) -> Run:
    """A run as its facts were last changed: reading YAML takes milliseconds."""
    return Run(int(path.name), path, read_yaml(path / FACTS))


def _files(folder: Path) -> list[str]:
    """Names of its files; whatever else is there, as a link, is left out. Raises ConfigError."""
    try:
        found = [file for file in folder.iterdir() if stat.S_ISREG(file.lstat().st_mode)]
        return sorted(file.name for file in found if _FILE.fullmatch(file.name))
    except OSError as error:
        raise ConfigError(f"{folder} cannot be read: {error.strerror}", remedy="look again") from error
