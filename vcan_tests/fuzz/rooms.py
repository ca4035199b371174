"""All targets, by their names; each is in the room of its tests."""

from __future__ import annotations

from functools import cache
from importlib import import_module
from pathlib import Path

from vcan_tests.fuzz.target import Target


@cache
def targets() -> dict[str, Target]:
    """Looked for when they are asked for: some rooms ask, too."""
    found: dict[str, Target] = {}
    for path in sorted(Path(__file__).parent.glob("test_*.py")):
        values = vars(import_module(f"vcan_tests.fuzz.{path.stem}")).values()
        found |= {value.name: value for value in values if isinstance(value, Target)}
    return found
