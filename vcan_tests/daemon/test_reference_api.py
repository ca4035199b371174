"""The page of the API is made of the table that requests are checked against."""

from __future__ import annotations

import json
import re

import pytest

from canhelm.errors import all_errors
from daemon.api.methods import METHODS
from daemon.api.parameters import validate
from daemon.reference.api import api
from daemon.reference.pages import PAGES


@pytest.fixture(scope="module")
def page() -> str:
    return api()


@pytest.mark.parametrize("name", METHODS)
def test_every_method_has_a_section_with_its_parameters(page: str, name: str) -> None:
    section = page.partition(f"\n### {name}\n")[2].partition("\n### ")[0]
    assert re.findall(r"^\| `(\w+)` \|", section, re.M)[: len(METHODS[name].params)] == [
        param.name for param in METHODS[name].params
    ]


def test_a_parameter_is_told_with_unit_default_and_range(page: str) -> None:
    section = page.partition("\n### drive.set\n")[2].partition("\n### ")[0]
    assert "| `valid_for_ms` | number | ms | 300.0 | 20 to 1000 | age at which it is too old |" in section
    assert "| `speed_m_s` | number | m/s | required |" in section


def test_a_method_that_moves_something_says_that_it_needs_a_lease(page: str) -> None:
    assert page.count("*lease*)") == sum(method.needs_lease for method in METHODS.values())


@pytest.mark.parametrize("leaf", all_errors())
def test_every_error_is_there_with_its_code(page: str, leaf: type) -> None:
    assert re.search(rf"^\| -\d+ \| `{leaf.__name__}` \| \d \| \w", page, re.M)


def test_the_request_that_it_shows_is_one(page: str) -> None:
    request, answer = map(json.loads, page.partition("```json\n")[2].partition("```")[0].splitlines())
    assert validate(METHODS[request["method"]], request["params"])["angle_deg"] == 20
    assert answer["id"] == request["id"]


def test_the_site_has_the_page() -> None:
    assert PAGES["api.md"] is api
