"""What a part of the benchmark is told, and what it has to tell."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any


def _silent(_: str) -> None:
    """Nobody listens."""


@dataclass(frozen=True)
class Options:
    """What every part is told.

    Attributes:
        out: folder for pictures.
        seconds: how long each measurement lasts, in the time that it measures.
        tell: hears a few words at each step.
    """

    out: Path
    seconds: float = 10.0
    tell: Callable[[str], None] = _silent


@dataclass(frozen=True)
class Table:
    """Figures for people.

    Attributes:
        title: what was measured, and how.
        heads: of the columns, with units.
        rows: a word or a number a column; None for what was not measured.
    """

    title: str
    heads: Sequence[str]
    rows: Sequence[Sequence[str | float | None]]


@dataclass(frozen=True)
class Section:
    """What one part has measured.

    Attributes:
        name: of the part.
        tables: for the terminal.
        figures: for the JSON file, under the part's name; units in the names.
        pictures: files that were drawn.
    """

    name: str
    tables: Sequence[Table]
    figures: dict[str, Any]
    pictures: Sequence[Path] = field(default_factory=tuple)
