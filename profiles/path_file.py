"""Path files: what a path to be driven looks like in YAML, and reading one with the lines that its pieces stand in.

A path is a list of pieces, each a line, an arc or a way through points. ``docs/paths.md`` is for people. Where a piece
begins nothing is said as a rule: where the one before it ends. The same structure, as JSON, goes over the socket.
"""

from __future__ import annotations

import gc
import os
import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal, TypeVar

import msgspec
import yaml
from msgspec import Meta

from canhelm.errors import CanhelmError, UsageError
from profiles.parts import Part, Positive
from profiles.path_text import PathText

SHIPPED = Path(__file__).resolve().parent / "paths"
MAX_PIECES = 200_000
MAX_FILE_BYTES = 20_000_000
MAX_WAYPOINTS = 500
_PIECE = re.compile(r"pieces\[(\d+)\]")
_EXPECTED = re.compile(r"Expected `(\w+)(?: \| null)?`([^`]*?)(?:, got `.*`)?")
_KINDS = {"float": "a finite number", "array": "a list", "object": "a mapping", "str": "a text"}

Point = tuple[float, float]
E = TypeVar("E", bound=CanhelmError)


class StartSpec(Part, frozen=True, kw_only=True):
    """Where a path begins, in the frame that began with the daemon."""

    x_m: float = 0.0
    y_m: float = 0.0
    heading_deg: float = 0.0
    """Of the vehicle, counter-clockwise positive."""


class PieceSpec(Part, frozen=True, kw_only=True, omit_defaults=True, gc=False):
    """One piece: exactly one of ``line_m``, ``line_to_m``, ``arc_deg`` and ``waypoints_m``."""

    line_m: Positive | None = None
    """Length of a line straight on."""
    line_to_m: Point | None = None
    """End of a line."""
    arc_deg: float | None = None
    """By how much the heading turns on an arc, counter-clockwise positive; with ``radius_m`` or ``centre_m``."""
    waypoints_m: Annotated[list[Point], Meta(min_length=1, max_length=MAX_WAYPOINTS)] | None = None
    """Points to drive through on straight legs, the corners rounded with ``radius_m``."""
    radius_m: Positive | None = None
    centre_m: Point | None = None
    from_m: Point | None = None
    """Where it begins; left out: where the one before it ends."""
    drive: Literal["forward", "backward"] | None = None
    """Driving direction from this piece on; the first piece is driven forward where nothing is said."""


class PathSpec(Part, frozen=True, kw_only=True, omit_defaults=True):
    """A path."""

    description: str = ""
    start: StartSpec | None = None
    """Left out: where the vehicle is when it begins to drive."""
    pieces: Annotated[list[PieceSpec], Meta(max_length=MAX_PIECES)]


@dataclass(frozen=True, slots=True)
class PathFile:
    """A path that was read.

    Attributes:
        file: where from.
        spec: what it says.
        lines: of the pieces.
    """

    file: Path
    spec: PathSpec
    lines: list[int]

    def located(self, error: E) -> E:
        """The same error; one that names ``pieces[3]`` as its object says file and line, too."""
        piece = _PIECE.fullmatch(error.object or "")
        if piece is None or int(piece[1]) >= len(self.lines):
            return error
        where = f"{self.file}:{self.lines[int(piece[1])]}"
        return type(error)(
            f"{where}: {error.message}", object=error.object, value=error.value, limit=error.limit, remedy=error.remedy
        )


def find_path_file(name_or_path: str | Path) -> Path:
    """The file of a path: whatever can be read, as a pipe, or a name among the shipped ones. Raises UsageError."""
    text = str(name_or_path)
    if os.path.exists(text) and not os.path.isdir(text):
        return Path(text)
    shipped = SHIPPED / f"{text}.yaml"
    if shipped.is_file() and "/" not in text:
        return shipped
    what = f"there is no path file {text}" if text else "the name of the path file is empty"
    if text and os.path.isdir(text):
        what = f"{text} is a directory, not a path file"
    known = ", ".join(sorted(path.stem for path in SHIPPED.glob("*.yaml")))
    raise UsageError(what, value=text, remedy=f"check it, or name a shipped one: {known}")


def load_path_file(name_or_path: str | Path) -> PathFile:
    """Read a path file.

    Args:
        name_or_path: a YAML file, or the name of a shipped one.

    Raises:
        UsageError: there is none, or it has a mistake; the message has file:line.
    """
    file = find_path_file(name_or_path)
    return parse_path_file(_read(file), file)


def parse_path_file(content: str, file: Path) -> PathFile:
    """Take the text of a path file.

    Args:
        content: of the file.
        file: where from, for mistakes; need not be there.

    Raises:
        UsageError: it has a mistake; the message has file:line.
    """
    with _no_collection():
        text = _parsed(content, file)
        try:
            spec = msgspec.convert(text.value, PathSpec)
        except msgspec.ValidationError as error:
            where, what, remedy = mistake_of(error)
            piece = _PIECE.search(where)
            line = text.lines[int(piece[1])] if piece and int(piece[1]) < len(text.lines) else 1
            raise _mistake(file, line, f"{where or 'the file'}: {what}", remedy) from None
    if not spec.pieces:
        raise _mistake(file, 1, "the path is empty", "give it at least one line or arc under pieces:")
    return PathFile(file, spec, text.lines)


def mistake_of(error: msgspec.ValidationError) -> tuple[str, str, str]:
    """What is wrong with a path that somebody wrote: the place as ``pieces[3].line_m``, the mistake, what to do."""
    what, _, place = str(error).partition(" - at `$")
    where = place.strip("`.")
    if where.endswith(".drive"):
        return where, what.replace("Invalid enum value", "is"), "write forward or backward"
    if (kind := _EXPECTED.fullmatch(what)) and kind[1] in _KINDS:
        return where, f"is not {_KINDS[kind[1]]}{kind[2]}", "docs/paths.md has the keys of a path"
    what = what.replace("`", "").replace("Object contains", "has an").replace("Object missing", "has no")
    return where, what, "docs/paths.md has the keys of a path"


@contextmanager
def _no_collection() -> Iterator[None]:
    """A long path is a million small objects, none of them garbage: looking for it would double the time."""
    was = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was:
            gc.enable()


def _mistake(file: Path, line: int, what: str, remedy: str) -> UsageError:
    return UsageError(f"{file}:{line}: {what}", value=str(file), remedy=remedy)


def _read(file: Path) -> str:
    """Raises UsageError."""
    try:
        with file.open("rb") as opened:  # a pipe tells no size before it has been read
            content = opened.read(MAX_FILE_BYTES + 1)
        if len(content) > MAX_FILE_BYTES:
            raise _mistake(file, 1, f"is larger than {MAX_FILE_BYTES / 1e6:g} MB", "drive it in parts")
        return content.decode("utf-8-sig")
    except OSError as error:
        raise _mistake(file, 1, f"cannot be read ({error.strerror})", "check its permissions") from None
    except UnicodeDecodeError:
        raise _mistake(file, 1, "is not UTF-8 text", "save the file as UTF-8") from None


def _parsed(content: str, file: Path) -> PathText:
    """The values in the text of a file, a mapping. Raises UsageError."""
    try:
        text = PathText(content)
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        what = error.problem if error.note else f"YAML: {error.problem or error.context}"
        raise _mistake(file, mark.line + 1 if mark else 1, str(what), error.note or "mend the syntax") from None
    except yaml.YAMLError:
        raise _mistake(file, 1, "YAML: it has a character that is not allowed", "remove it") from None
    if isinstance(text.value, list) and text.value:
        raise _mistake(file, 1, "is a list, not a mapping", "write pieces: above it, and indent it")
    if not isinstance(text.value, dict):
        raise _mistake(file, 1, "the path is empty", "give it at least one line or arc under pieces:")
    return text
