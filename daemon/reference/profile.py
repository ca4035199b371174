"""The page of all keys of a profile, from the JSON Schema that ``canhelm profile schema`` prints."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from typing import Any

from daemon.reference.markdown import code, table
from profiles.json_schema import json_schema

HEAD = """# Keys of a profile

A robot's profile is a YAML file. Each section below is one mapping; a key without a default has to be given by the file
or by what it extends. `canhelm profile check FILE` names file and line of every mistake.

Every mapping may also have the key `extends`. {extends}

"""
COLUMNS = ("key", "what it may be", "default", "meaning")
Schema = Mapping[str, Any]


def profile() -> str:
    """Every mapping of a profile with its keys, as Markdown."""
    known = json_schema()["$defs"]
    head = HEAD.format(extends=known["Profile"]["properties"]["extends"]["description"])
    return head + "\n".join(_section(name, mapping) for name, mapping in known.items())


def _section(name: str, mapping: Schema) -> str:
    keys = {key: value for key, value in mapping["properties"].items() if key != "extends"}
    return f"## {name}\n\n{mapping.get('description', '')}\n\n{table(COLUMNS, _rows(keys))}"


def _rows(keys: Mapping[str, Schema]) -> Iterator[tuple[str, ...]]:
    for key, value in keys.items():
        default = code(json.dumps(value["default"])) if value.get("default") not in (None, {}, []) else ""
        yield code(key), _kind(value), "" if "$ref" in value else default, value.get("description", "")


def _kind(value: Schema) -> str:
    """What a key may be, in words: a mapping of the page, one of several words, a number within limits."""
    if "$ref" in value:
        name = value["$ref"].rpartition("/")[2]
        return f"[{name}](#{name.lower()})"
    if "anyOf" in value:
        return " or ".join(_kind(each) for each in value["anyOf"])
    if "enum" in value:
        return ", ".join(code(each) for each in value["enum"])
    if value.get("type") == "array":
        return f"list of {_kind(value['prefixItems'][0] if 'prefixItems' in value else value['items'])}"
    if value.get("type") == "object":
        return f"names, each {_kind(value['additionalProperties'])}" if "additionalProperties" in value else "mapping"
    return f"{value.get('type', 'anything')} {_limits(value)}".strip().replace("null", "nothing")


def _limits(value: Schema) -> str:
    words = {"minimum": "from", "exclusiveMinimum": "above", "maximum": "to", "exclusiveMaximum": "below"}
    return " ".join(f"{word} {value[limit]}" for limit, word in words.items() if limit in value)
