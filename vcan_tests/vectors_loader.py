"""Reads the reference vectors: ``*.json`` beside the tests and in the folder that ``CANHELM_VECTORS`` names.

A vector file holds ``kind``, ``schema`` (units, signs and tolerances in words) and ``cases``, whose form the kind
decides.
"""

from __future__ import annotations

import json
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

FOLDER: Final = Path(__file__).parent / "vectors"


@dataclass(frozen=True)
class VectorFile:
    """One file of reference cases."""

    path: Path
    kind: str
    cases: list[dict[str, Any]]


def vector_folders() -> list[Path]:
    """The tests' own folder and, if set, the one in ``CANHELM_VECTORS``."""
    named = os.environ.get("CANHELM_VECTORS")
    return [FOLDER, Path(named)] if named else [FOLDER]


def read_vectors(path: Path) -> VectorFile:
    """One vector file.

    Raises:
        ValueError: it is not of the schema.
    """
    content = json.loads(path.read_text(encoding="utf-8"))
    if not isinstance(content, dict) or not isinstance(content.get("kind"), str):
        raise ValueError(f"{path}: no kind; a vector file is an object with kind, schema and cases")
    cases = content.get("cases")
    if not isinstance(cases, list) or not cases or not all(isinstance(case, dict) for case in cases):
        raise ValueError(f"{path}: no cases; a vector file is an object with kind, schema and cases")
    return VectorFile(path, content["kind"], cases)


def vector_paths() -> list[Path]:
    """All vector files.

    Raises:
        FileNotFoundError: a folder holds none, for instance because ``CANHELM_VECTORS`` is mistyped.
    """
    paths: list[Path] = []
    for folder in vector_folders():
        found = sorted(folder.glob("*.json"))
        if not found:
            raise FileNotFoundError(f"no vector files in {folder}; is CANHELM_VECTORS right?")
        paths += found
    return paths
