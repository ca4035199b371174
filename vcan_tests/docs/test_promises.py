"""The page of promises: what it says to hold each of them is there, and is run."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "promises.md").read_text("utf-8")
HELD_BY = re.findall(r"`(test_\w+\.py)::(\w+)`", PAGE)


def named_in(name: str) -> set[str]:
    """Names of the tests of all rooms with that file name."""
    trees = [ast.parse(path.read_text("utf-8")) for path in (ROOT / "vcan_tests").rglob(name)]
    return {
        node.name for tree in trees for node in tree.body if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)
    }


def folder_of(room: str) -> str:
    """Where the page's sentences look for a room."""
    if room.startswith(("test_service_", "test_upgrade_")):
        return "systemd"
    return "station" if room == "test_network.py" else "daemon"


@pytest.mark.parametrize(("room", "test"), HELD_BY)
def test_a_promise_is_held_by_a_test_that_exists(room: str, test: str) -> None:
    assert test in named_in(room)


@pytest.mark.parametrize("room", sorted({room for room, _ in HELD_BY}))
def test_a_test_is_where_the_commands_of_the_page_look_for_it(room: str) -> None:
    assert list((ROOT / "vcan_tests" / folder_of(room)).rglob(room))


def test_every_promise_names_what_holds_it() -> None:
    rows = [line for line in PAGE.splitlines() if line.startswith("| ") and not line.startswith(("| ---", "| promise"))]
    assert rows
    assert [row for row in rows if "::test_" not in row.rpartition(" | ")[2]] == []
