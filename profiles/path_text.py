"""The text of a path file as plain values: YAML from the events of its parser, bounded in depth and without aliases.

A path may be long, so it is read by libyaml where there is one; its composer is not used, which recurses in C as deep
as a text is nested, and unfolds aliases of aliases.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any, cast

import yaml

MAX_DEPTH = 6
_LOADER = getattr(yaml, "CSafeLoader", yaml.SafeLoader)


class PathText:
    """The values in a text. A plain scalar that is a finite number is one, everything else is text.

    Args:
        text: YAML.

    Attributes:
        value: what it says, None where it says nothing.
        lines: of the items of the list ``pieces``, from 1.

    Raises:
        yaml.MarkedYAMLError: it is nested too deeply, has an alias, a key that stands twice, or a second document;
            its ``note`` is what to do.
        yaml.YAMLError: it is no YAML.
    """

    def __init__(self, text: str) -> None:
        self.lines: list[int] = []
        self._events: Iterator[yaml.Event] = iter(yaml.parse(text, Loader=_LOADER))
        self.value = self._document()

    def _document(self) -> Any:
        next(self._events)  # the stream begins
        if isinstance(next(self._events), yaml.StreamEndEvent):
            return None
        value = self._value(next(self._events), 0)
        next(self._events)  # the document ends
        after = next(self._events)
        if not isinstance(after, yaml.StreamEndEvent):
            raise _wrong("a second document begins", "remove it", after)
        return value

    def _value(self, event: yaml.Event, depth: int) -> Any:
        if isinstance(event, yaml.ScalarEvent):
            return _scalar(event)
        if isinstance(event, yaml.AliasEvent):
            raise _wrong("aliases are not supported", "write the values out", event)
        if depth > MAX_DEPTH:
            raise _wrong("is nested too deeply", "give a mapping with a list of pieces", event)
        if isinstance(event, yaml.MappingStartEvent):
            return self._mapping(depth)
        return [self._value(item, depth + 1) for item in self._until(yaml.SequenceEndEvent)]

    def _mapping(self, depth: int) -> dict[str, Any]:
        found: dict[str, Any] = {}
        for key in self._until(yaml.MappingEndEvent):
            if not isinstance(key, yaml.ScalarEvent):
                raise _wrong("a key is not a text", "write a name before the colon", key)
            if key.value in found:
                raise _wrong(f"key '{key.value}' stands here twice", "remove one of them", key)
            value = next(self._events)
            if depth == 0 and key.value == "pieces" and isinstance(value, yaml.SequenceStartEvent):
                found[key.value] = self._pieces()
            else:
                found[key.value] = self._value(value, depth + 1)
        return found

    def _pieces(self) -> list[Any]:
        pieces = []
        for event in self._until(yaml.SequenceEndEvent):
            self.lines.append(_mark(event).line + 1)
            pieces.append(self._value(event, 2))
        return pieces

    def _until(self, end: type[yaml.Event]) -> Iterator[yaml.Event]:
        """The events up to the end of what has begun; whoever takes one takes those that belong to it."""
        while not isinstance(event := next(self._events), end):
            yield event


def _scalar(event: yaml.ScalarEvent) -> str | float:
    text: str = event.value
    if event.style:
        return text
    try:
        number = float(text)
    except ValueError:
        return text
    return number if math.isfinite(number) else text


def _wrong(what: str, remedy: str, event: yaml.Event) -> yaml.MarkedYAMLError:
    return yaml.MarkedYAMLError(problem=what, problem_mark=_mark(event), note=remedy)


def _mark(event: yaml.Event) -> yaml.Mark:
    """Where it stands, which every event of a text knows."""
    return cast("yaml.Mark", event.start_mark)
