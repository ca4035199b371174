"""JSON Schema of a profile, for editors.

It says what a file may contain. A file that ``extends:`` another one may leave out anything, so nothing is required
here; whether the merged profile is complete is the loader's to say.
"""

from __future__ import annotations

import ast
import inspect
from typing import Any

import msgspec

from profiles import bricks, gamepad, localisation, own_vehicle, plausibility, schema, sensors, steered

DIALECT = "https://json-schema.org/draft/2020-12/schema"
_MODULES = (schema, bricks, steered, sensors, gamepad, localisation, own_vehicle, plausibility)
"""Where the schema's classes stand."""
_NAME = {"type": "string"}
EXTENDS = {
    "anyOf": [_NAME, {"type": "array", "items": _NAME}],
    "description": "What this mapping is laid over: a profile file (devices/ec40), a part of the catalogue "
    "(catalogue/268214), or a list of them, a later one over an earlier one.",
}


def json_schema() -> dict[str, Any]:
    """The schema, described with the docstrings of :mod:`profiles.schema`."""
    text = msgspec.json.schema(schema.Profile)
    definitions: dict[str, Any] = text["$defs"]
    described = _descriptions()
    for name, definition in definitions.items():
        definition.pop("required", None)
        for field, description in described.get(name, {}).items():
            definition["properties"][field]["description"] = description
    _allow_extends(text)
    return {"$schema": DIALECT, "title": "canhelm robot profile", **text}


def _allow_extends(node: Any) -> None:
    """Put ``extends`` beside the keys of every mapping."""
    if isinstance(node, dict):
        for child in list(node.values()):
            _allow_extends(child)
        if node.get("type") == "object":
            node["properties"] = {"extends": EXTENDS, **node.get("properties", {})}
            node.pop("minProperties", None)
    elif isinstance(node, list):
        for child in node:
            _allow_extends(child)


def _descriptions() -> dict[str, dict[str, str]]:
    """Docstring of every field, by class and field."""
    trees = [ast.parse(inspect.getsource(module)) for module in _MODULES]
    classes = [node for tree in trees for node in tree.body if isinstance(node, ast.ClassDef)]
    return {node.name: _field_descriptions(node) for node in classes}


def _field_descriptions(node: ast.ClassDef) -> dict[str, str]:
    found: dict[str, str] = {}
    for statement, after in zip(node.body, node.body[1:], strict=False):
        text = after.value.value if isinstance(after, ast.Expr) and isinstance(after.value, ast.Constant) else None
        if isinstance(statement, ast.AnnAssign) and isinstance(statement.target, ast.Name) and isinstance(text, str):
            found[statement.target.id] = " ".join(text.split())
    return found
