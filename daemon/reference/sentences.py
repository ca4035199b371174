"""What the program says when it fails, read from its own source, where each sentence stands with its remedy."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import canhelm
import daemon
import drivers
import profiles
from canhelm.errors import all_errors

PACKAGES = (canhelm, daemon, drivers, profiles)


@dataclass(frozen=True, slots=True, order=True)
class Sentence:
    """One failure.

    Attributes:
        kind: class of the error.
        text: what happened and where; ``{name}`` for what is put in.
        remedy: what to do next.
    """

    kind: str
    text: str
    remedy: str


def sentences() -> list[Sentence]:
    """Every sentence with a remedy that the program can say, in order of class and words."""
    return sorted({sentence for path in _sources() for sentence in _of(ast.parse(path.read_text(encoding="utf-8")))})


def _sources() -> Iterator[Path]:
    for package in PACKAGES:
        yield from Path(package.__path__[0]).rglob("*.py")


def _of(tree: ast.Module) -> Iterator[Sentence]:
    kinds = {error.__name__ for error in all_errors()}
    for node in ast.walk(tree):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in kinds and node.args:
            remedy = next((keyword.value for keyword in node.keywords if keyword.arg == "remedy"), None)
            text, advice = _words(node.args[0]), _words(remedy)
            if text and advice:
                yield Sentence(node.func.id, text, advice)


def _words(node: ast.expr | None) -> str:
    """The words of a string, ``{name}`` where something is put in; empty where it is put together elsewhere."""
    if isinstance(node, ast.Constant):
        return str(node.value)
    if isinstance(node, ast.FormattedValue):
        return f"{{{_name(node.value)}}}"
    return "".join(_words(part) for part in node.values) if isinstance(node, ast.JoinedStr) else ""


def _name(node: ast.expr) -> str:
    """What a person would call an expression: ``names`` for ``", ".join(self.names)``."""
    if isinstance(node, ast.Name):
        return node.id.strip("_")
    if isinstance(node, ast.Call):
        return _name(node.args[0] if node.args else node.func)
    if isinstance(node, ast.Attribute):
        return node.attr.strip("_")
    inner = [child for child in ast.iter_child_nodes(node) if isinstance(child, ast.expr)]
    return _name(inner[-1]) if inner else str(getattr(node, "value", "..."))
