"""Writes a path as the text of a path file."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

import msgspec

from profiles.path_file import PathSpec, StartSpec


def path_lines(spec: PathSpec, comment: str = "") -> Iterator[str]:
    """The lines of a path file, each piece on one; numbers with nine digits.

    Args:
        spec: the path.
        comment: for the first line; empty for none.
    """
    if comment:
        yield f"# {comment}"
    if spec.description:
        yield f"description: {json.dumps(spec.description)}"
    if spec.start is not None:
        yield f"start: {_flow(_start(spec.start))}"
    yield "pieces:"
    for piece in spec.pieces:
        yield f"  - {_flow(msgspec.to_builtins(piece))}"


def _start(start: StartSpec) -> dict[str, float]:
    return {"x_m": start.x_m, "y_m": start.y_m, "heading_deg": start.heading_deg}


def _flow(value: Any) -> str:
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key}: {_flow(item)}" for key, item in value.items()) + "}"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(_flow, value)) + "]"
    return value if isinstance(value, str) else f"{value + 0.0:.9g}"  # not -0.0
