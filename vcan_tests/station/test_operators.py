"""Several people at one robot: watching, taking over, giving back."""

from __future__ import annotations

import pytest

from vcan_tests.station.browser import Operator
from vcan_tests.station.conftest import Meet
from vcan_tests.station.processes import UNHELD_S, Robot, Status, speeds
from vcan_tests.station.stick import drives

pytestmark = pytest.mark.station

MOVING_M_S = 0.1


def moving(status: Status) -> bool:
    """Whether every wheel turns."""
    return min(speeds(status)) > MOVING_M_S


@pytest.fixture
def first(operator: Operator, robot: Robot) -> Operator:
    """Somebody who drives by the stick, and holds it."""
    drives(operator, robot, moving)
    return operator


@pytest.fixture
def second(meet: Meet, first: Operator, robot: Robot) -> Operator:
    """Somebody else, who comes later."""
    operator = meet()
    operator.open(robot.name)
    return operator


def test_the_second_sees_the_robot_drive_and_who_has_it(first: Operator, second: Operator) -> None:
    second.sees("#state", "active")
    second.sees("#holder", "has the robot")
    first.sees("#holder", "you have the robot")
    first.page.mouse.up()
    second.sees("#state", "idle")


def test_the_second_cannot_drive_and_is_told_why(first: Operator, second: Operator, robot: Robot) -> None:
    second.go_to("drive")
    second.sees("[data-panel=drive]", "has the robot: wait, or take it over")
    second.pulls(".stick", right=0.0, up=-0.6)
    second.catches_up()
    second.page.mouse.up()
    assert min(speeds(robot.status())) > MOVING_M_S
    first.page.mouse.up()


def test_a_takeover_stops_the_first_and_both_see_it(first: Operator, second: Operator, robot: Robot) -> None:
    second.sees("#holder", "has the robot")
    second.page.click("#takeover")
    robot.comes_to_rest(UNHELD_S)
    second.sees("#holder", "you have the robot")
    first.sees("#holder", r"(?<!you) has the robot")
    first.sees("#notes", "has the robot|taken the robot over")
    first.page.mouse.up()
    drives(second, robot, moving)
    second.page.mouse.up()
    robot.comes_to_rest(UNHELD_S)


def test_what_was_taken_over_is_given_back(first: Operator, second: Operator, robot: Robot) -> None:
    second.sees("#holder", "has the robot")
    second.page.click("#takeover")
    second.sees("#takeover", "Give back")
    first.page.mouse.up()
    second.page.click("#takeover")
    first.sees("#holder", "^$")
    drives(first, robot, moving)
    first.page.mouse.up()


def test_a_page_that_is_closed_gives_the_robot_back(first: Operator, second: Operator, robot: Robot) -> None:
    first.page.close()
    robot.comes_to_rest(UNHELD_S)
    second.sees("#holder", "^$")
