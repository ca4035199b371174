"""The classes that a profile names: finding them, and whether they are what a vehicle of one's own needs."""

from __future__ import annotations

import difflib
import importlib
import inspect
import logging
import sys
from collections.abc import Iterator
from typing import Any

import msgspec

from profiles.checks import Finding
from profiles.own_vehicle import OwnGeometry
from profiles.schema import Limits

LOGGER = logging.getLogger("canhelm")
COUNTED = ("wheels", "encoders", "brakes")
"""How many of each a law has."""
LAW = (*COUNTED, "parameters", "step", "body_motion", "objection")
"""What a law has to have: daemon.loops.own_vehicle."""
TWIN = ("advance", "moving", "pose", "velocity", "heading_rad", "set_brake")
"""What a twin has to have: drivers.simulated.body."""


class ClassMissing(ImportError):
    """The module is there, the class is not."""


def load_class(name: str) -> type[Any]:
    """The class that a profile names as ``package.module:Class``.

    Raises:
        ImportError: there is no such module, or no such class in it.
    """
    module, _, wanted = name.partition(":")
    found = getattr(importlib.import_module(module), wanted, None)
    if not inspect.isclass(found):
        raise ClassMissing(f"names {name}: module {module} has no class {wanted}")
    return found


def findings(data: dict[str, Any]) -> Iterator[Finding]:
    """What is wrong with the classes that a profile's plain data names; they are imported."""
    try:
        vehicle, limits = msgspec.convert(data.get("vehicle"), OwnGeometry), msgspec.convert(data.get("limits"), Limits)
    except msgspec.ValidationError:
        return
    law, wrong = _checked(vehicle.kind, "kind", LAW)
    yield from wrong
    if vehicle.twin is not None:
        yield from _checked(vehicle.twin, "twin", TWIN)[1]
    if law is not None:
        fitting = [*_counts(law, vehicle), *_parameters(law, vehicle)]
        yield from fitting or _made(law, vehicle, limits)


def _checked(name: str, key: str, needed: tuple[str, ...]) -> tuple[type[Any] | None, list[Finding]]:
    """The class, and what it lacks; None where it cannot be used."""
    path = ("vehicle", key)
    try:
        found = load_class(name)
    except ClassMissing as error:
        return None, [Finding(path, str(error), _classes_like(name, needed))]
    except ImportError as error:
        remedy = f"install it for {sys.executable}, or put the folder that it lies in on PYTHONPATH"
        return None, [Finding(path, f"{name} cannot be imported: {error}", remedy)]
    except Exception as error:
        LOGGER.exception("%s failed while it was imported", name)
        what = f"{name} failed while it was imported: {type(error).__name__}: {error}"
        return None, [Finding(path, what, "mend it; the traceback is in the log")]
    abstract: frozenset[str] = getattr(found, "__abstractmethods__", frozenset())
    lacking = [part for part in needed if not hasattr(found, part)]
    lacking += [part for part in sorted(abstract) if part not in lacking]
    if lacking:
        return None, [Finding(path, f"{name} lacks {', '.join(lacking)}", "write them as docs/own-vehicle.md says")]
    return found, []


def _classes_like(name: str, needed: tuple[str, ...]) -> str:
    """What to write instead of a class that its module does not have."""
    module = name.partition(":")[0]
    own = [each for each in vars(sys.modules[module]).values() if inspect.isclass(each) and each.__module__ == module]
    made = [each for each in own if not inspect.isabstract(each) and all(hasattr(each, part) for part in needed)]
    fitting = [f"{module}:{each.__name__}" for each in made]
    return (
        f"it has {', '.join(fitting)}" if fitting else f"write it, or name another module: {module} has none that fits"
    )


def _counts(law: type[Any], vehicle: OwnGeometry) -> Iterator[Finding]:
    for key in COUNTED:
        named, wanted = len(getattr(vehicle, key)), getattr(law, key)
        if named != wanted:
            what = f"names {named}, {vehicle.kind} has {wanted}"
            yield Finding(("vehicle", key), what, f"name {wanted}")


def _parameters(law: type[Any], vehicle: OwnGeometry) -> Iterator[Finding]:
    known, given = list(law.parameters), list(vehicle.parameters)
    for name in (name for name in known if name not in given):
        what = f"is missing, {vehicle.kind} needs it"
        yield Finding(("vehicle", "parameters", name), what, f"write {name}: with a number")
    for name in (name for name in given if name not in known):
        close = difflib.get_close_matches(name, known, n=1)
        remedy = f"did you mean {close[0]}?" if close else f"it knows: {', '.join(known) or 'none'}"
        yield Finding(("vehicle", "parameters", name), f"is a number that {vehicle.kind} does not know", remedy)


def _made(law: type[Any], vehicle: OwnGeometry, limits: Limits) -> Iterator[Finding]:
    """Whether one can be made of the profile's numbers."""
    try:
        law(vehicle.parameters, limits)
    except ValueError as error:
        yield Finding(("vehicle", "parameters"), f"are refused by {vehicle.kind}: {error}", "correct them")
    except Exception as error:
        LOGGER.exception("%s cannot be made", vehicle.kind)
        what = f"{vehicle.kind} cannot be made: {type(error).__name__}: {error}"
        yield Finding(("vehicle", "kind"), what, "mend it; the traceback is in the log")
