"""The page of who may do what agrees with the methods, and with the groups that give roles."""

from __future__ import annotations

import re

import pytest

from canhelm.protocol import MAX_REQUEST_BYTES
from daemon.api.connection import MAX_PENDING
from daemon.api.metering import BYTES_PER_S, REQUESTS_PER_S
from daemon.api.methods import METHODS
from daemon.api.parameters import MAX_NESTING, Role
from daemon.api.peers import Groups
from daemon.api.server import MAX_CLIENTS, RESERVED_CLIENTS
from vcan_tests.docs.pages import text_of

ROW = re.compile(r"^\| \*(\w+)\* \| (.*) \| (.*) \|$", re.MULTILINE)
SPAN = re.compile(r"`([^`]+)`")


def rows() -> dict[str, tuple[str, list[str]]]:
    """Who has each role, and its methods, as the page tells."""
    found = ROW.findall(text_of("docs/rights.md"))
    return {role: (who, SPAN.findall(methods)) for role, who, methods in found}


@pytest.mark.parametrize("role", Role)
def test_the_page_tells_each_method_in_the_row_of_its_least_role(role: Role) -> None:
    assert sorted(rows()[role][1]) == sorted(name for name, method in METHODS.items() if method.role is role)


@pytest.mark.parametrize("role", [Role.WATCH, Role.DRIVE, Role.CONFIGURE])
def test_the_page_names_the_group_that_gives_a_role(role: Role) -> None:
    assert f"group `{getattr(Groups(), role)}`" in rows()[role][0]


@pytest.mark.parametrize(
    ("what", "most"),
    [
        ("requests of one connection", f"{REQUESTS_PER_S} a second, and as many at once"),
        ("bytes of one connection", f"{BYTES_PER_S // 1_000_000} MB a second, and as many at once"),
        ("requests under way of one connection", f"{MAX_PENDING}"),
        ("bytes in a line", f"{MAX_REQUEST_BYTES:,}"),
        ("objects and lists within each other", f"{MAX_NESTING}"),
        ("connections", f"{MAX_CLIENTS}, and {RESERVED_CLIENTS} more that may only stop"),
    ],
)
def test_the_page_tells_the_limits_that_are_kept(what: str, most: str) -> None:
    assert f"\n| {what} | {most} |" in text_of("docs/rights.md")
