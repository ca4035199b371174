"""What a method of the socket API is, its parameters, and the check of what clients send for them."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

from canhelm.errors import UsageError


class Role(StrEnum):
    """What a peer may do; each role includes those before it, and whoever may open the socket has the first."""

    STOP = "stop"
    WATCH = "watch"
    DRIVE = "drive"
    CONFIGURE = "configure"


REQUIRED = object()
"""Default of a parameter that has none."""
MAX_SETTINGS = 1000
"""Settings in one request."""
MAX_NESTING = 8
"""Objects and lists within each other in one parameter; a path has four."""


@dataclass(frozen=True, slots=True)
class Param:
    """One parameter of a method.

    Attributes:
        name: with its unit as suffix.
        type: ``number``, ``integer``, ``boolean``, ``string``, ``node`` (id 1 to 127, or a name), ``value``
            (a number or a string), ``values`` (whole numbers by object), ``object`` or ``list``.
        doc: what it means.
        unit: its unit, empty for none.
        default: value where it is left out; a parameter without one is required.
        minimum, maximum: range of a number, both included.
        choices: the only strings allowed, where there are any.
    """

    name: str
    type: str
    doc: str
    unit: str = ""
    default: Any = REQUIRED
    minimum: float | None = None
    maximum: float | None = None
    choices: tuple[str, ...] = ()

    @property
    def required(self) -> bool:
        """Whether a request without it is refused."""
        return self.default is REQUIRED

    def schema(self) -> dict[str, Any]:
        """The parameter for ``api.schema``."""
        fields = {"unit": self.unit, "minimum": self.minimum, "maximum": self.maximum, "choices": list(self.choices)}
        known = {key: value for key, value in fields.items() if value not in (None, "", [])}
        default = {} if self.required else {"default": self.default}
        return {"name": self.name, "type": self.type, "doc": self.doc, "required": self.required, **known, **default}


@dataclass(frozen=True, slots=True)
class Method:
    """One method.

    Attributes:
        name: what a request calls it.
        doc: what it does.
        params: its parameters.
        result: what its result holds.
        role: the least role that may call it.
        needs_lease: it moves something, and the motion belongs to the connection that asked for it.
        one_of: exactly one of these parameters must be given.
        ends_by: the parameter without which the motion has no end (and cannot be handed to the daemon).
        urgent: it stops the robot: it is carried out whatever else is under way, and without parameters that make no
            sense instead of being refused.
    """

    name: str
    doc: str
    params: tuple[Param, ...] = ()
    result: str = "state"
    role: Role = Role.DRIVE
    needs_lease: bool = False
    one_of: tuple[str, ...] = ()
    ends_by: str | None = None
    urgent: bool = False

    def schema(self) -> dict[str, Any]:
        """The method for ``api.schema``."""
        return {
            "name": self.name,
            "doc": self.doc,
            "role": self.role.value,
            "needs_lease": self.needs_lease,
            "params": [param.schema() for param in self.params],
            "one_of": list(self.one_of),
            "result": self.result,
        }


def validate(method: Method, params: dict[str, Any]) -> dict[str, Any]:
    """The parameters with their defaults filled in.

    Raises:
        UsageError: an unknown, missing, mistyped or out of range parameter, named in ``object``.
    """
    known = {param.name: param for param in method.params}
    if method.urgent:
        params = {name: value for name, value in params.items() if name in known and _fits(known[name], value)}
    for name in params:
        if name not in known:
            has = ", ".join(known) or "no parameters"
            raise _wrong(method, name, "is not a parameter", params[name], f"it takes {has}")
    checked = {name: _check(method, param, params) for name, param in known.items()}
    if method.one_of and sum(checked[name] is not None for name in method.one_of) != 1:
        raise _wrong(method, method.one_of[0], "conflicts or is missing", None, f"give one of {method.one_of}")
    if method.ends_by and checked[method.ends_by] is None and checked["wait"] is False:
        raise _wrong(
            method,
            method.ends_by,
            "is missing: a motion without an end cannot be handed over",
            None,
            "give it, or wait",
        )
    return checked


def _check(method: Method, param: Param, params: dict[str, Any]) -> Any:
    value = params.get(param.name)
    if value is None:
        if param.required:
            raise _wrong(method, param.name, "is missing", None, param.doc)
        return param.default
    fits, wanted = _TYPES[param.type]
    if not fits(value):
        raise _wrong(method, param.name, f"is not {wanted}", value, f"{param.name}: {param.doc}")
    if param.choices and value not in param.choices:
        raise _wrong(method, param.name, "is none of its values", value, f"give {', '.join(param.choices)}")
    if param.type in ("number", "integer"):
        _check_range(method, param, value)
    return value


def _fits(param: Param, value: Any) -> bool:
    return _TYPES[param.type][0](value)


def _check_range(method: Method, param: Param, value: float) -> None:
    low, high = param.minimum, param.maximum
    if (low is not None and value < low) or (high is not None and value > high):
        limit = f"{_range(low, high)} {param.unit}".strip()
        raise _wrong(method, param.name, "is out of range", value, f"give {limit}", limit)


def _range(low: float | None, high: float | None) -> str:
    if low is None:
        return f"at most {high:.12g}"
    return f"at least {low:.12g}" if high is None else f"{low:.12g} to {high:.12g}"


def _wrong(method: Method, name: str, what: str, value: Any, remedy: str, limit: str | None = None) -> UsageError:
    shown = "" if value is None else f" ({_short(value)!r})"
    return UsageError(
        f"{method.name}: {name}{shown} {what}", object=name, value=_short(value), limit=limit, remedy=remedy
    )


def _short(value: Any) -> Any:
    return value if value is None or isinstance(value, int | float) else str(value)[:80]


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < 1e15 and math.isfinite(value)


def _is_integer(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and abs(value) < 2**63


def _is_text(value: Any) -> bool:
    return isinstance(value, str) and 0 < len(value) <= 256 and value.isprintable()


def _is_settings(value: Any) -> bool:
    return isinstance(value, dict) and len(value) <= MAX_SETTINGS and all(map(_is_integer, value.values()))


def _is_shallow(value: Any, depth: int = MAX_NESTING) -> bool:
    if not isinstance(value, dict | list):
        return True
    items = value.values() if isinstance(value, dict) else value
    return depth > 0 and all(_is_shallow(item, depth - 1) for item in items)


def _is_node(value: Any) -> bool:
    return 1 <= value <= 127 if _is_integer(value) else _is_text(value)


_TYPES: dict[str, tuple[Callable[[Any], bool], str]] = {
    "number": (_is_number, "a number from -1e15 to 1e15"),
    "integer": (_is_integer, "an integer"),
    "boolean": (lambda value: isinstance(value, bool), "true or false"),
    "string": (_is_text, "a string of 1 to 256 printable characters"),
    "node": (_is_node, "a node id from 1 to 127, or a name"),
    "values": (_is_settings, f"at most {MAX_SETTINGS} whole numbers by object"),
    "value": (lambda value: _is_number(value) or _is_text(value), "a number or a string"),
    "object": (lambda value: isinstance(value, dict) and _is_shallow(value), f"an object, {MAX_NESTING} deep at most"),
    "list": (lambda value: isinstance(value, list) and _is_shallow(value), f"a list, {MAX_NESTING} deep at most"),
}
