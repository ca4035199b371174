"""How commands speak: data on stdout (a table for a terminal, else one JSON object a line), all else on stderr.

rich is loaded only when something is drawn.
"""

from __future__ import annotations

import json as json_text
import math
import os
import sys
from collections.abc import Callable, Iterable, Mapping
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from daemon.cli import journal

if TYPE_CHECKING:
    from rich.console import Console, RenderableType

    from canhelm.errors import CanhelmError

Json = Annotated[
    bool | None,
    Parameter(name="--json", negative=(), help="One JSON object a line (the default when the output is no terminal)."),
]
"""Type of every command's ``json`` parameter: ``json: Json = None``."""


_SHOWN = dict.fromkeys((*range(9), *range(11, 32), *range(127, 160)), "\N{REPLACEMENT CHARACTER}")
"""Control characters of a file or a device, but for tabs and line ends: no orders to a person's terminal."""


def wants_json(flag: bool | None) -> bool:
    """Whether to write JSON: as told, else when stdout is no terminal."""
    return flag if flag is not None else not sys.stdout.isatty()


def show(
    data: Mapping[str, Any] | Iterable[Mapping[str, Any]],
    table: Callable[[Any], RenderableType] | None = None,
    json: bool | None = None,
) -> None:
    """Write data to stdout.

    Args:
        data: one object, or several (one line each).
        table: makes a rich renderable or a string of the data for a terminal; None: a line a field, but for empty ones.
        json: True for JSON, False for the table, None: JSON unless stdout is a terminal.
    """
    if wants_json(json):
        for item in [data] if isinstance(data, Mapping) else data:
            print(json_text.dumps(plain(item), ensure_ascii=False), flush=True)
    elif table is not None:
        console().print(table(data))
    else:
        for item in [data] if isinstance(data, Mapping) else data:
            for line in (line for key, value in item.items() if words(value) for line in _field_lines(key, value)):
                print(line)


def _field_lines(key: str, value: Any) -> list[str]:
    """A field for people; a list of objects has a line each."""
    if isinstance(value, list | tuple) and value and all(isinstance(item, Mapping) for item in value):
        return [f"{key}:", *(f"  {number}: {words(item)}" for number, item in enumerate(value))]
    return [f"{key}: {words(value)}"]


def plain(value: Any) -> Any:
    """The value as JSON can carry it: NaN and infinity become null, what JSON does not know becomes its text."""
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value if value is None or isinstance(value, str | int | float) else str(value)


def words(value: Any, digits: int = 4) -> str:
    """A value for people: short numbers, yes and no, a dash for nothing; empty fields are left out."""
    if value is None:
        return "-"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.0f}" if 10**digits <= abs(value) < 1e12 else f"{value:.{digits}g}"
    if isinstance(value, Mapping):
        return ", ".join(f"{key} {told}" for key, item in value.items() if (told := words(item, digits)))
    if isinstance(value, list | tuple):
        return ", ".join(words(item, digits) for item in value)
    return str(value)


def console(stderr: bool = False) -> Console:
    """A rich console on stdout or stderr; it honours NO_COLOR and draws nothing moving off a terminal."""
    from rich.console import Console

    return Console(stderr=stderr, highlight=False)


def say(text: str, level: int = journal.INFO) -> None:
    """A sentence for people, on stderr.

    Args:
        text: the sentence.
        level: how the journal shall take it, where stderr goes there.
    """
    told = f"canhelm: {text.translate(_SHOWN)}"
    if journal.reads_stderr(os.environ):
        told = journal.with_level(told, level)
    print(told, file=sys.stderr, flush=True)


def say_warning(text: str) -> None:
    """What a person should look at although the command goes on, on stderr."""
    say(text, journal.WARNING)


def say_error(error: CanhelmError) -> None:
    """What went wrong, the limit that it broke, and what to do next, on stderr."""
    limit = "" if error.limit is None or str(error.limit) in error.message else f" (limit: {error.limit})"
    remedy = f" - {error.remedy}" if error.remedy else ""
    say(f"{error.message}{limit}{remedy}", journal.ERROR)
