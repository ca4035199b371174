"""The paths that are kept for a robot: path files in one folder, as `canhelm drive path` reads them.

All work on files is done in a thread, so that no page waits for a disk.
"""

from __future__ import annotations

import asyncio
import math
import os
import re
import stat
import tempfile
from functools import lru_cache
from pathlib import Path
from typing import Any, Final

import msgspec

from canhelm.errors import CanhelmError, LimitExceeded, NotReady, Refused, UsageError
from daemon.loops.odometry import Pose
from daemon.runtime.path_building import PathBuilder
from daemon.runtime.path_commands import converted
from daemon.station.robots import Robot
from profiles.path_file import PathFile, PathSpec, PieceSpec, StartSpec, load_path_file, parse_path_file
from profiles.path_writing import path_lines

PATHS: Final = "paths"
"""Folder in the robot's state folder."""
ENDING: Final = ".yaml"
MAX_FILE_BYTES: Final = 500_000
"""Of one path: some 10 000 pieces, more than anybody draws."""
MAX_PATHS: Final = 500
READABLE: Final = 0o644
"""By everybody: who calls `canhelm drive path` may be another user than the station's."""
_NAME: Final = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]{0,59}", re.ASCII)


async def list_paths(robot: Robot, params: dict[str, Any]) -> dict[str, Any]:
    """Name, time of the last change [s since 1970] and length of each; null where a file has a mistake."""
    return {"paths": await asyncio.to_thread(_list, robot.folder / PATHS)}


async def read_path(robot: Robot, params: dict[str, Any]) -> dict[str, Any]:
    """One path, whole.

    Raises:
        UsageError: there is none of this name, or it has a mistake; the message has file:line.
        LimitExceeded: it is too large for a page, or a piece for any vehicle.
    """
    file = await asyncio.to_thread(_read, _file(robot.folder / PATHS, params["name"]))
    return {"path": await asyncio.to_thread(_sound, file, params.get("here"))}


async def parse_path(robot: Robot, params: dict[str, Any]) -> dict[str, Any]:
    """The path in a path file that a page has. Raises UsageError, LimitExceeded, with the line of the mistake."""
    lines = params["lines"]
    if not all(isinstance(line, str) for line in lines):
        raise UsageError("a line is no text", object="lines", remedy="send the lines of the file as strings")
    file = await asyncio.to_thread(parse_path_file, "\n".join(lines), Path(params["file"]))
    return {"path": await asyncio.to_thread(_sound, file, params.get("here"))}


async def write_path(robot: Robot, params: dict[str, Any]) -> dict[str, Any]:
    """Check a path and keep it: it is there as a whole, or not at all.

    Raises:
        UsageError: the name or the path makes no sense; ``object`` is the place, as ``pieces[3]``.
        LimitExceeded: the path is too large, or there are too many.
        Refused: there is one of this name, and it is not to be replaced.
        NotReady: it cannot be written.
    """
    file = _file(robot.folder / PATHS, params["name"])
    spec, length_m = await asyncio.to_thread(checked, params["path"])
    await asyncio.to_thread(_write, file, spec, replace=bool(params["replace"]))
    return {"name": params["name"], "length_m": length_m}


async def delete_path(robot: Robot, params: dict[str, Any]) -> dict[str, Any]:
    """Delete a path for good. Raises UsageError where there is none of this name, NotReady."""
    await asyncio.to_thread(_delete, _file(robot.folder / PATHS, params["name"]))
    return {"name": params["name"]}


def checked(path: Any) -> tuple[PathSpec, float]:
    """A path that somebody sent, and its length [m]; what is wrong with a piece is told as the loops tell it.

    Raises:
        UsageError, LimitExceeded: ``object`` is the place, as ``pieces[3].line_m``.
    """
    spec = converted(path, PathSpec)
    if not spec.pieces:
        raise UsageError("the path is empty", object="pieces", remedy="give it at least one line or arc")
    return spec, _built_length_m(spec, StartSpec())


def _built_length_m(spec: PathSpec, here: StartSpec) -> float:
    """The length of a path [m], its pieces built as for driving.

    Every section is checked by itself: where the driving direction changes, only the vehicle's own length says where
    the next one begins, and the daemon judges that when the path is driven.

    Args:
        spec: with a piece at least.
        here: where the vehicle is: where a path without a start begins.

    Raises:
        UsageError, LimitExceeded: ``object`` is the place, as ``pieces[3]``.
    """
    start, from_here = spec.start or here, spec.start is None
    begin = Pose(start.x_m, start.y_m, math.radians(start.heading_deg))
    builders: list[PathBuilder] = []
    for number, piece in enumerate(spec.pieces):
        if not builders or _turns_round(piece, builders[-1]):
            begin = builders[-1].end if builders else begin
            builders.append(PathBuilder(begin, 0.0, False, math.inf, math.inf, from_here=from_here, entry=number))
        builders[-1].add(piece)
    return round(math.fsum(builder.finished(0.0).length_m for builder in builders), 3)


def _turns_round(piece: PieceSpec, before: PathBuilder) -> bool:
    return piece.drive is not None and (piece.drive == "backward") != before.backward


# --- in a thread -----------------------------------------------------------------------------------------------------


def _file(folder: Path, name: str) -> Path:
    """The file of a name, inside the folder whatever the name is. Raises UsageError."""
    if _NAME.fullmatch(name) is None:
        remedy = "give up to 60 letters, digits, - and _, the first one a letter or a digit"
        raise UsageError(f"{name[:80]!r} is no name of a path", object="name", remedy=remedy)
    return folder / f"{name}{ENDING}"


def _require_kept(file: Path) -> None:
    """Raise UsageError where there is no path file; a link is none."""
    if not _is_plain(file):
        raise UsageError(f"no path {file.stem} is kept", value=file.stem, remedy="choose one of the list")


def _is_plain(file: Path) -> bool:
    try:
        return stat.S_ISREG(file.lstat().st_mode)
    except OSError:
        return False


def _files(folder: Path) -> list[Path]:
    """The path files of a folder. Raises NotReady."""
    try:
        found = sorted(folder.iterdir())
    except FileNotFoundError:
        return []
    except OSError as error:
        raise _closed(folder, error) from error
    return [file for file in found if file.suffix == ENDING and _NAME.fullmatch(file.stem) and _is_plain(file)]


def _sound(file: PathFile, here: Any) -> Any:
    """What a path file says, once all its pieces have been built.

    Args:
        file: that was read.
        here: where the vehicle is, as the start of a path; None: where the daemon began.

    Raises:
        UsageError, LimitExceeded: a piece is none, or does not join; the message has file:line.
    """
    try:
        _built_length_m(file.spec, converted(here or {}, StartSpec))
    except CanhelmError as error:
        raise file.located(error) from None
    return msgspec.to_builtins(file.spec)


def _list(folder: Path) -> list[dict[str, Any]]:
    found = [(file, file.lstat()) for file in _files(folder)]
    return [
        {
            "name": file.stem,
            "changed_s": round(status.st_mtime, 3),
            "length_m": _length_m(file, status.st_mtime_ns, status.st_size),
        }
        for file, status in found
    ]


@lru_cache(maxsize=MAX_PATHS)
def _length_m(file: Path, changed_ns: int, size: int) -> float | None:
    """Of a file as it was last changed; None where it has a mistake."""
    try:
        return _built_length_m(_read(file).spec, StartSpec())
    except CanhelmError:
        return None


def _read(file: Path) -> PathFile:
    _require_kept(file)
    size = file.stat().st_size
    if size > MAX_FILE_BYTES:
        what, remedy = f"path {file.stem} is too large for a page", f"drive it by `canhelm drive path {file}`"
        raise LimitExceeded(what, value=size, limit=MAX_FILE_BYTES, remedy=remedy)
    return load_path_file(file)


def _write(file: Path, spec: PathSpec, *, replace: bool) -> None:
    text = "".join(f"{line}\n" for line in path_lines(spec)).encode()
    if len(text) > MAX_FILE_BYTES:
        raise LimitExceeded("this path is too large", value=len(text), limit=MAX_FILE_BYTES, remedy="divide it")
    files = _files(file.parent)
    if file in files and not replace:
        what = f"there is a path {file.stem} already"
        raise Refused(what, value=file.stem, remedy="replace it, or change the name")
    if file not in files and len(files) >= MAX_PATHS:
        raise LimitExceeded("too many paths are kept", value=len(files), limit=MAX_PATHS, remedy="delete some")
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        _write_whole(file, text)
    except OSError as error:
        raise _closed(file.parent, error) from error


def _write_whole(file: Path, text: bytes) -> None:
    """Write a draft beside the file and put it in its place: rename(2) is atomic. Raises OSError."""
    descriptor, draft = tempfile.mkstemp(prefix=".draft-", dir=file.parent)
    try:
        with os.fdopen(descriptor, "wb") as written:
            os.fchmod(descriptor, READABLE)
            written.write(text)
            written.flush()
            os.fsync(descriptor)
        os.replace(draft, file)
    except BaseException:
        os.unlink(draft)
        raise


def _delete(file: Path) -> None:
    _require_kept(file)
    try:
        file.unlink()
    except OSError as error:
        raise _closed(file.parent, error) from error


def _closed(folder: Path, error: OSError) -> NotReady:
    what = f"paths cannot be kept in {folder}: {error.strerror or error}"
    return NotReady(what, value=str(folder), remedy="let the user that runs the station write there")
