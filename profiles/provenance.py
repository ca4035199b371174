"""YAML in which every value keeps its file and line, and says whether it is assumed.

Plain scalars are read by the rules of YAML 1.2's core schema, so ``on`` and ``1:30`` stay text and ``1e-6`` is a
number. Aliases are refused: the one mechanism for sharing values is ``extends:``.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeAlias

import yaml

ASSUMED = "!assumed"
"""Tag of a value that no source gives."""
MAX_FILE_BYTES = 200_000
MAX_DEPTH = 30
MOST_LISTED = 100
LARGEST_INTEGER = 2**63 - 1
NO_ALIASES = "aliases are not supported"


Value: TypeAlias = str | int | float | bool | None


@dataclass(frozen=True, slots=True)
class Place:
    """Where something stands: file and line (from 1)."""

    file: str
    line: int

    def __str__(self) -> str:
        return f"{self.file}:{self.line}"


@dataclass(frozen=True, slots=True)
class Mistake:
    """One mistake in a profile.

    Attributes:
        place: where it stands.
        field: dotted path of the field (``drives.rear_left.node``), empty where there is none.
        what: what is wrong.
        remedy: what to write instead.
    """

    place: Place
    field: str
    what: str
    remedy: str

    def __str__(self) -> str:
        return f"{self.place}: {self.field + ': ' if self.field else ''}{self.what}; {self.remedy}"


def listed(subject: str, mistakes: Sequence[Mistake]) -> str:
    """What has mistakes, and these line by line; of very many the first."""
    count = f"{len(mistakes)} mistake{'s' if len(mistakes) > 1 else ''}"
    lines = [f"{subject} has {count}:", *(f"  {mistake}" for mistake in mistakes[:MOST_LISTED])]
    return "\n".join(lines if len(mistakes) <= MOST_LISTED else [*lines, "  ..."])


@dataclass(frozen=True, slots=True)
class Scalar:
    """A single value."""

    value: Value
    place: Place
    assumed: bool = False


@dataclass(frozen=True, slots=True)
class Listing:
    """A sequence."""

    items: tuple[Node, ...]
    place: Place


@dataclass(frozen=True, slots=True)
class Mapping:
    """A mapping; ``complete`` is False when a part of it could not be read, so that keys may be missing."""

    entries: dict[str, Node]
    place: Place
    key_places: dict[str, Place] = field(default_factory=dict)
    complete: bool = True


Node: TypeAlias = Scalar | Listing | Mapping
FieldPath: TypeAlias = tuple[str | int, ...]


def dotted(path: FieldPath) -> str:
    """``("vehicle", "wheels", 0)`` as ``vehicle.wheels[0]``; a name that would not be seen is shown with its codes."""
    text = "".join(f"[{step}]" if isinstance(step, int) else f".{_visible(step)}" for step in path)
    return text.removeprefix(".")


def _visible(name: str) -> str:
    return name if name and name.isprintable() and name == name.strip() else ascii(name)


def place_of(node: Node, path: FieldPath) -> Place:
    """Place of the value at ``path``, or of the nearest thing around it that exists."""
    for step in path:
        if isinstance(node, Mapping) and step in node.entries:
            node = node.entries[str(step)]
        elif isinstance(node, Listing) and isinstance(step, int) and step < len(node.items):
            node = node.items[step]
        else:
            break
    return node.place


def plain(node: Node) -> Any:
    """The value without its places: dicts, lists and scalars."""
    if isinstance(node, Mapping):
        return {key: plain(value) for key, value in node.entries.items()}
    if isinstance(node, Listing):
        return [plain(item) for item in node.items]
    return node.value


def leaves(node: Node, path: FieldPath = ()) -> list[tuple[str, Scalar]]:
    """Every scalar with its dotted path, in the order of the file."""
    if isinstance(node, Scalar):
        return [(dotted(path), node)]
    children = node.entries.items() if isinstance(node, Mapping) else enumerate(node.items)
    return [leaf for step, child in children for leaf in leaves(child, (*path, step))]


def merge(base: Node, own: Node) -> Node:
    """``own`` laid over ``base``: mappings are merged key by key, everything else is replaced."""
    if not (isinstance(base, Mapping) and isinstance(own, Mapping)):
        return own
    entries = dict(base.entries)
    for key, value in own.entries.items():
        entries[key] = merge(base.entries[key], value) if key in base.entries else value
    complete = base.complete and own.complete
    return Mapping(entries, own.place, base.key_places | own.key_places, complete)


class _Composer(yaml.SafeLoader):
    """PyYAML up to its node graph, without aliases and with a limit on nesting."""

    yaml_implicit_resolvers: dict[Any, Any] = {}  # noqa: RUF012 - PyYAML's own class attribute, emptied
    depth = 0

    def compose_node(self, parent: yaml.Node | None, index: int) -> yaml.Node | None:
        if self.check_event(yaml.AliasEvent):
            raise self._refusal(NO_ALIASES)
        if self.depth >= MAX_DEPTH:
            raise self._refusal("nested too deeply")
        self.depth += 1
        node = super().compose_node(parent, index)
        self.depth -= 1
        return node

    def _refusal(self, problem: str) -> yaml.MarkedYAMLError:
        event = self.peek_event()  # type: ignore[no-untyped-call]  # PyYAML's stubs leave it untyped
        return yaml.MarkedYAMLError(problem=problem, problem_mark=event.start_mark)


_TAG = "tag:yaml.org,2002:"
_SYNTAX = {
    "null": (r"~|null|Null|NULL|", ["~", "n", "N", ""]),
    "bool": (r"true|True|TRUE|false|False|FALSE", list("tTfF")),
    "int": (r"[-+]?[0-9]+|0x[0-9a-fA-F]+", list("-+0123456789")),
    "float": (r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?", list("-+.0123456789")),
}
for _kind, (_pattern, _first) in _SYNTAX.items():
    _Composer.add_implicit_resolver(_TAG + _kind, re.compile(f"^(?:{_pattern})$"), _first)


class Reader:
    """Reads one file into a :class:`Node`; what is wrong with it goes to ``mistakes``.

    Args:
        wanted: what to write into a file that is empty.
    """

    def __init__(
        self,
        path: Path,
        mistakes: list[Mistake],
        wanted: str = "write a profile, or extends: max2d to begin with a shipped one",
    ) -> None:
        self.path = path
        self.mistakes = mistakes
        self.wanted = wanted

    def read(self) -> Node | None:
        """The file's content, or None when it cannot be read at all."""
        text = self._text()
        root = self._compose(text) if text is not None else None
        return self._node(root) if root is not None else None

    def _wrong(self, line: int, what: str, remedy: str) -> None:
        self.mistakes.append(Mistake(Place(str(self.path), line), "", what, remedy))

    def _text(self) -> str | None:
        try:
            if self.path.stat().st_size > MAX_FILE_BYTES:
                self._wrong(1, f"is larger than {MAX_FILE_BYTES // 1000} kB", "give a profile")
                return None
            content = self.path.read_bytes()
            return content.decode("utf-8-sig")
        except OSError as error:
            self._wrong(1, f"cannot be read ({error.strerror})", "check the path and its permissions")
        except UnicodeDecodeError as error:
            self._wrong(content[: error.start].count(b"\n") + 1, "is not UTF-8 text", "save the file as UTF-8")
        return None

    def _compose(self, text: str) -> yaml.Node | None:
        try:
            root = yaml.compose(text, Loader=_Composer)
        except yaml.MarkedYAMLError as error:
            self._wrong(*_syntax_mistake(error, text))
            return None
        except yaml.reader.ReaderError as error:
            line = text[: error.position].count("\n") + 1
            self._wrong(line, f"character U+{ord(text[error.position]):04X} is not allowed", "remove it")
            return None
        if root is None:
            self._wrong(1, "is empty", self.wanted)
        return root

    def _place(self, node: yaml.Node) -> Place:
        return Place(str(self.path), node.start_mark.line + 1)

    def _node(self, node: yaml.Node, assumed: bool = False) -> Node:
        assumed = assumed or node.tag == ASSUMED
        if isinstance(node, yaml.MappingNode):
            return self._mapping(node, assumed)
        if isinstance(node, yaml.SequenceNode):
            return Listing(tuple(self._node(item, assumed) for item in node.value), self._place(node))
        return Scalar(self._value(node), self._place(node), assumed)

    def _mapping(self, node: yaml.MappingNode, assumed: bool) -> Mapping:
        found = Mapping({}, self._place(node))
        for key_node, value_node in node.value:
            key, line = key_node.value, key_node.start_mark.line + 1
            if not isinstance(key, str) or key_node.tag != _TAG + "str":
                self._wrong(line, "a key is not a text", "write a name before the colon")
            elif key in found.entries:
                self._wrong(
                    line, f"key '{key}' stands here twice", f"remove it (first: line {found.key_places[key].line})"
                )
            else:
                found.key_places[key] = self._place(key_node)
                found.entries[key] = self._node(value_node, assumed)
        return found

    def _value(self, node: yaml.Node) -> Value:
        text: str = node.value
        kind = (_plain_kind(node) if node.tag == ASSUMED else node.tag).removeprefix(_TAG)
        convert = _CONVERT.get(kind)
        line = node.start_mark.line + 1
        if convert is None:
            self._wrong(line, f"tag {node.tag} is unknown", f"the only tag of a profile is {ASSUMED}")
            return text
        try:
            return convert(text)
        except ValueError:
            octal = re.match(r"[-+]?0[0-9]", text)
            remedy = "write it without the zero in front" if octal else "write a number of ordinary size"
            self._wrong(line, f"{short(text)} is no {kind}", remedy)
            return None


def _syntax_mistake(error: yaml.MarkedYAMLError, text: str) -> tuple[int, str, str]:
    """Line, what is wrong, and the remedy."""
    mark = error.problem_mark or error.context_mark
    line = mark.line + 1 if mark else 1
    if mark and text[mark.index : mark.index + 1] == "\t":
        return line, "YAML: a tab stands where spaces belong", "indent with spaces"
    remedy = "share values with extends:" if error.problem == NO_ALIASES else "mend the syntax"
    return line, f"YAML: {error.problem or error.context}", remedy


def _plain_kind(node: yaml.Node) -> str:
    """The kind that a scalar would have without its ``!assumed``."""
    if isinstance(node, yaml.ScalarNode) and node.style is None:
        return next((kind for kind, (pattern, _) in _SYNTAX.items() if re.fullmatch(pattern, node.value)), "str")
    return "str"


def _integer(text: str) -> int:
    """Not with a zero in front: some read that as octal."""
    if re.fullmatch(r"[-+]?0[0-9]+", text):
        raise ValueError(text)
    value = int(text, 16 if text.startswith("0x") else 10)
    if abs(value) > LARGEST_INTEGER:
        raise ValueError(text)
    return value


def _number(text: str) -> float:
    value = float(text)
    if not math.isfinite(value):
        raise ValueError(text)
    return value


def _truth(text: str) -> bool:
    if text.lower() not in ("true", "false"):
        raise ValueError(text)
    return text.lower() == "true"


def _nothing(_: str) -> None:
    return None


_CONVERT: dict[str, Callable[[str], Value]] = {
    "str": str,
    "int": _integer,
    "float": _number,
    "bool": _truth,
    "null": _nothing,
}


def short(text: str) -> str:
    """A text of a file in quotes, its end left out where it is long."""
    return repr(text if len(text) <= 40 else text[:37] + "...")
