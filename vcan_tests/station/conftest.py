"""Robots and station for each file of tests, a browser for all of them, and the look back at each test's end."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

import pytest

from vcan_tests.station.browser import Operator, chromium
from vcan_tests.station.processes import UNHELD_S, Fleet, Robot, running_fleet

if TYPE_CHECKING:
    from playwright.sync_api import Browser

Meet = Callable[..., Operator]


@pytest.fixture(scope="session")
def browser() -> Iterator[Browser]:
    """The one Chromium."""
    with chromium() as browser:
        yield browser


@pytest.fixture(scope="module")
def fleet(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Fleet]:
    """The robots that a file of tests names in ``ROBOTS``, and a station."""
    names = getattr(request.module, "ROBOTS", ("max2d",))
    with running_fleet(tmp_path_factory.mktemp("fleet"), names) as fleet:
        yield fleet


@pytest.fixture
def robot(fleet: Fleet) -> Robot:
    """The first of the robots."""
    return next(iter(fleet.robots.values()))


@pytest.fixture
def expected_errors() -> list[str]:
    """Parts of what the daemons' logs may tell of errors; a test that makes some names them."""
    return []


@pytest.fixture
def meet(browser: Browser, fleet: Fleet, expected_errors: list[str]) -> Iterator[Meet]:
    """Makes operators; at the end nothing has gone wrong with any of them, nor in a daemon, and every robot stands."""
    operators: list[Operator] = []
    begins = {name: robot.log.stat().st_size for name, robot in fleet.robots.items()}

    def meet(url: str | None = None, **options: Any) -> Operator:
        operators.append(Operator(browser, url or fleet.station.url, **options))
        return operators[-1]

    yield meet
    for operator in operators:
        operator.close()
    assert [problem for operator in operators for problem in operator.unexpected()] == []
    for name, robot in fleet.robots.items():
        robot.comes_to_rest(UNHELD_S)
        told = robot.errors_since(begins[name])
        assert [error for error in told if not any(part in error for part in expected_errors)] == []
        assert robot.status()["api"]["internal_errors"] == 0
        robot.tidy()


@pytest.fixture
def operator(meet: Meet, robot: Robot) -> Operator:
    """Somebody at a desktop who has chosen the first robot."""
    operator = meet()
    operator.open(robot.name)
    return operator
