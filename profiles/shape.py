"""Compares a tree of located values with the schema's types; every difference is a mistake with its place."""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable
from typing import Any

from msgspec import inspect

from profiles.own_vehicle import CLASS_PATTERN
from profiles.parts import ADDRESS_PATTERN
from profiles.provenance import FieldPath, Listing, Mapping, Mistake, Node, Place, Scalar, dotted, plain, short

_NUMBERS = {inspect.IntType: "a whole number", inspect.FloatType: "a number"}


class Shape:
    """One walk over a tree; mistakes are appended to ``mistakes``."""

    def __init__(self, mistakes: list[Mistake]) -> None:
        self.mistakes = mistakes

    def walk(self, node: Node, kind: inspect.Type, path: FieldPath = ()) -> Any:
        """The plain value of ``node`` without unknown keys; wrong values stay in and are listed as mistakes."""
        if isinstance(kind, inspect.UnionType):
            kind = self._member(node, kind, path)
        if isinstance(kind, inspect.StructType):
            return self._struct(node, kind, path)
        if isinstance(kind, inspect.DictType):
            return self._dict(node, kind, path)
        if isinstance(kind, inspect.TupleType):
            return self._tuple(node, kind, path)
        if isinstance(kind, inspect.VarTupleType):
            return self._several(node, kind, path)
        return self._scalar(node, kind, path)

    def _wrong(self, place: Place, path: FieldPath, what: str, remedy: str) -> None:
        self.mistakes.append(Mistake(place, dotted(path), what, remedy))

    def _not_a(self, node: Node, path: FieldPath, expected: str) -> Any:
        self._wrong(node.place, path, f"is {shown(node)}", f"write {expected}")
        return plain(node)

    def _struct(self, node: Node, kind: inspect.StructType, path: FieldPath) -> Any:
        fields = {field.encode_name: field for field in kind.fields}
        if not isinstance(node, Mapping):
            return self._not_a(node, path, f"a mapping with the keys {', '.join(fields)}")
        tag = {kind.tag_field: kind.tag} if kind.tag_field else {}
        for key in node.entries.keys() - fields.keys() - tag.keys():
            self._wrong(node.key_places[key], (*path, key), "is an unknown key", _did_you_mean(key, fields))
        for name, field in fields.items():
            if field.required and name not in node.entries and node.complete:
                self._wrong(node.place, (*path, name), "is missing", f"write {name}: with {expected(field.type)}")
        known = ((key, value) for key, value in node.entries.items() if key in fields)
        return {**tag, **{key: self.walk(value, fields[key].type, (*path, key)) for key, value in known}}

    def _member(self, node: Node, kind: inspect.UnionType, path: FieldPath) -> inspect.Type:
        """The member of a union that the value means: None for an empty value, of several mappings the named one."""
        empty = isinstance(node, Scalar) and node.value is None
        members = [member for member in kind.types if isinstance(member, inspect.NoneType) == empty]
        tags = {str(member.tag): member for member in members if isinstance(member, inspect.StructType) and member.tag}
        if len(tags) < 2 or not isinstance(node, Mapping):
            return members[0]
        field = next(iter(tags.values())).tag_field or ""
        given = node.entries.get(field)
        named = str(given.value) if isinstance(given, Scalar) else ""
        if named in tags:
            return tags[named]
        what = f"is {shown(given)}" if given else "is missing"
        remedy = f"write {field}: with one of {', '.join(tags)}"
        self._wrong(given.place if given else node.place, (*path, field), what, remedy)
        return members[0]

    def _dict(self, node: Node, kind: inspect.DictType, path: FieldPath) -> Any:
        if not isinstance(node, Mapping) or len(node.entries) < (kind.min_length or 0):
            return self._not_a(node, path, expected(kind))
        for key in node.entries:
            if not _fits(key, kind.key_type):
                self._wrong(node.key_places[key], (*path, key), "is not a name", f"use {expected(kind.key_type)}")
        return {key: self.walk(value, kind.value_type, (*path, key)) for key, value in node.entries.items()}

    def _tuple(self, node: Node, kind: inspect.TupleType, path: FieldPath) -> Any:
        if not isinstance(node, Listing) or len(node.items) != len(kind.item_types):
            return self._not_a(node, path, expected(kind))
        pairs = enumerate(zip(node.items, kind.item_types, strict=True))
        return [self.walk(item, item_kind, (*path, index)) for index, (item, item_kind) in pairs]

    def _several(self, node: Node, kind: inspect.VarTupleType, path: FieldPath) -> Any:
        if not isinstance(node, Listing) or len(node.items) < (kind.min_length or 0):
            return self._not_a(node, path, expected(kind))
        return [self.walk(item, kind.item_type, (*path, index)) for index, item in enumerate(node.items)]

    def _scalar(self, node: Node, kind: inspect.Type, path: FieldPath) -> Any:
        if not isinstance(node, Scalar) or not _fits(node.value, kind):
            return self._not_a(node, path, expected(kind))
        return node.value


def shown(node: Node) -> str:
    """A value for people: short, in YAML's words."""
    if isinstance(node, Mapping):
        return "a mapping"
    if isinstance(node, Listing):
        return f"a list of {len(node.items)}"
    if isinstance(node.value, bool):
        return str(node.value).lower()
    return "empty" if node.value is None else short(node.value) if isinstance(node.value, str) else repr(node.value)


def expected(kind: inspect.Type) -> str:
    """A type of the schema in words, with its limits."""
    if isinstance(kind, inspect.UnionType):
        return " or ".join(dict.fromkeys(expected(member) for member in kind.types))
    if isinstance(kind, inspect.LiteralType):
        return "one of " + ", ".join(str(value) for value in sorted(kind.values, key=_rank))
    if isinstance(kind, inspect.IntType | inspect.FloatType):
        return _NUMBERS[type(kind)] + _range(kind)
    if isinstance(kind, inspect.StrType):
        forms = {CLASS_PATTERN: "module:Class, as mecanum:Mecanum", ADDRESS_PATTERN: "an object as 0x6041/0"}
        return forms.get(kind.pattern or "", "a text" + (f" that matches {kind.pattern}" if kind.pattern else ""))
    if isinstance(kind, inspect.TupleType):
        return f"a list of {len(kind.item_types)}"
    if isinstance(kind, inspect.VarTupleType):
        return f"a list of {expected(kind.item_type)}"
    if isinstance(kind, inspect.BoolType):
        return "true or false"
    return "nothing" if isinstance(kind, inspect.NoneType) else "a mapping"


def _rank(value: str | int | None) -> tuple[int, str]:
    """Numbers by size, texts by letters."""
    return (value, "") if isinstance(value, int) else (0, str(value))


def _range(kind: inspect.IntType | inspect.FloatType) -> str:
    low = f"from {kind.ge:.12g}" if kind.ge is not None else f"greater than {kind.gt:g}" if kind.gt is not None else ""
    high = f"to {kind.le:.12g}" if kind.le is not None else f"below {kind.lt:g}" if kind.lt is not None else ""
    joint = " and " if low and high and (kind.gt is not None or kind.lt is not None) else " "
    return f" {joint.join(part for part in (low, high) if part)}".rstrip()


def _fits(value: object, kind: inspect.Type) -> bool:
    """True when a scalar is of the type and within its limits."""
    if isinstance(kind, inspect.LiteralType):
        return any(value == allowed and type(value) is type(allowed) for allowed in kind.values)
    if isinstance(kind, inspect.BoolType):
        return isinstance(value, bool)
    if isinstance(kind, inspect.StrType):
        return isinstance(value, str) and _text_fits(value, kind)
    if isinstance(kind, inspect.IntType | inspect.FloatType):
        accepted = int if isinstance(kind, inspect.IntType) else (int, float)
        return isinstance(value, accepted) and not isinstance(value, bool) and _in_range(value, kind)
    return value is None and isinstance(kind, inspect.NoneType)


def _text_fits(text: str, kind: inspect.StrType) -> bool:
    return re.search(kind.pattern or "", text) is not None and len(text) <= (kind.max_length or len(text))


def _in_range(value: float, kind: inspect.IntType | inspect.FloatType) -> bool:
    return (
        (kind.ge is None or value >= kind.ge)
        and (kind.gt is None or value > kind.gt)
        and (kind.le is None or value <= kind.le)
        and (kind.lt is None or value < kind.lt)
    )


def _did_you_mean(key: str, known: Iterable[str]) -> str:
    close = difflib.get_close_matches(key, known, n=1)
    return f"did you mean {close[0]}?" if close else f"known keys: {', '.join(known)}"
