"""Several pages at one robot are told apart, and each hears what the others do."""

from __future__ import annotations

import re

import pytest

from vcan_tests.station.browser import Operator
from vcan_tests.station.conftest import Meet
from vcan_tests.station.processes import Robot

pytestmark = pytest.mark.station

NAME = r"page [1-9]\d\d at 127\.0\.0\.1"


@pytest.fixture
def pages(meet: Meet, robot: Robot) -> tuple[Operator, Operator]:
    """Two pages at the robot."""
    pages = (meet(), meet())
    for page in pages:
        page.open(robot.name)
        page.sees("#who", NAME)
    return pages


def name_of(page: Operator) -> str:
    """The name that a page shows as its own."""
    found = re.search(NAME, page.text("#who"))
    assert found
    return found[0]


def test_each_page_shows_a_name_of_its_own_and_what_it_may_do(pages: tuple[Operator, Operator]) -> None:
    first, second = pages
    first.sees("#who", f"^{NAME}: may configure$")
    assert name_of(first) != name_of(second)


def the_first_drives(pages: tuple[Operator, Operator]) -> tuple[Operator, Operator]:
    """The first holds the stick, and the second sees who has the robot."""
    first, second = pages
    first.take_seat()
    first.pulls(".stick", right=0.0, up=0.6)
    second.sees("#holder", f"^{name_of(first)} has the robot$")
    return first, second


def test_the_holder_is_told_by_the_name_of_its_page(pages: tuple[Operator, Operator]) -> None:
    first, _ = the_first_drives(pages)
    first.page.mouse.up()


def test_a_stop_on_one_page_is_told_on_the_other(pages: tuple[Operator, Operator], robot: Robot) -> None:
    first, second = the_first_drives(pages)
    second.page.click("#stop")
    first.sees("#notes", f"stop was pressed on {name_of(second)}")
    second.sees("#notes", "stopped")
    second.catches_up()
    assert "stop was pressed" not in second.text("#notes")
    first.page.mouse.up()


def test_a_takeover_is_told_on_the_other_page_by_the_name_of_who_took_the_robot(
    pages: tuple[Operator, Operator], robot: Robot
) -> None:
    first, second = the_first_drives(pages)
    second.page.click("#takeover")
    first.sees("#notes", f"{name_of(second)} by .* has taken the robot over from {name_of(first)}")
    second.sees("#notes", f"you have the robot; {name_of(first)} .*had it")
    first.page.mouse.up()


def test_an_emergency_stop_tells_on_which_page_it_was_pressed(
    pages: tuple[Operator, Operator], expected_errors: list[str]
) -> None:
    expected_errors.append("emergency stop")
    first, second = pages
    second.page.click("#estop")
    first.sees("#latched-why", f"emergency stop: pressed on {name_of(second)}")


def test_a_page_keeps_its_name_when_it_is_connected_again(meet: Meet, robot: Robot) -> None:
    page = meet()
    page.open(robot.name)
    page.sees("#who", NAME)
    before = name_of(page)
    page.expects("WebSocket", "^failed: ")
    robot.kill()
    page.sees("#who", "^$")
    robot.begin_again()
    robot.wait_until_ready()
    page.sees("#who", before)
