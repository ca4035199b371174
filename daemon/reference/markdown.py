"""The little Markdown that the pages share."""

from __future__ import annotations

from collections.abc import Iterable, Sequence


def table(columns: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """A table with its header; cells may hold anything, on any number of lines."""
    head = [_row(columns), _row(["---"] * len(columns))]
    return "\n".join([*head, *(_row(row) for row in rows)]) + "\n"


def _row(cells: Iterable[object]) -> str:
    return "| " + " | ".join(_cell(cell) for cell in cells) + " |"


def _cell(value: object) -> str:
    """One line, without the sign that separates cells, and without signs that would be taken for HTML."""
    text = " ".join(str(value).split())
    return text.replace("|", "\\|").replace("<", "&lt;")


def code(text: object) -> str:
    """Text to be typed or read as it stands; nothing for nothing."""
    return f"`{text}`" if str(text) else ""
