"""The rules of the house hold: they name modules that exist, and each test is where it is looked for."""

from __future__ import annotations

import tomllib
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest

from vcan_tests.kernel.suite import MARKS

ROOT = Path(__file__).resolve().parent.parent
OURS = ("canhelm", "daemon", "drivers", "profiles")


def contracts() -> list[dict[str, Any]]:
    """The contracts of import-linter."""
    text = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    found: list[dict[str, Any]] = tomllib.loads(text)["tool"]["importlinter"]["contracts"]
    return found


def named_modules() -> list[str]:
    """Every module of ours that a contract forbids or watches."""
    keys = ("source_modules", "forbidden_modules")
    names = {name.removesuffix(".*") for contract in contracts() for key in keys for name in contract.get(key, [])}
    return sorted(name for name in names if name.partition(".")[0] in OURS)


@pytest.mark.parametrize("name", named_modules())
def test_a_module_that_a_rule_names_exists(name: str) -> None:
    assert find_spec(name) is not None


@pytest.mark.parametrize("mark", MARKS)
def test_the_tests_of_a_guest_are_in_the_folder_that_is_searched_for_them(mark: str) -> None:
    tests = ROOT / "vcan_tests"
    marked = {path for path in tests.rglob("test_*.py") if f"pytest.mark.{mark}" in path.read_text(encoding="utf-8")}
    assert marked - {Path(__file__).resolve()} <= set((tests / mark).iterdir())
