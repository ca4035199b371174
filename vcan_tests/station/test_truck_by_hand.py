"""Driving a truck with a trailer by hand: what it may backwards, and what holds it back."""

from __future__ import annotations

import pytest

from vcan_tests.station.browser import Operator
from vcan_tests.station.processes import UNHELD_S, Robot

pytestmark = pytest.mark.station

ROBOTS = ("semitrailer",)
DRIVE = "[data-panel=drive]"


@pytest.fixture
def driver(operator: Operator) -> Operator:
    """Somebody at the panel for driving."""
    operator.take_seat()
    return operator


def test_the_top_speed_says_what_holds_backwards(driver: Operator) -> None:
    driver.sees(DRIVE, r"Top speed\s+0\.20 m/s\s+backwards 0\.20 m/s at most")


@pytest.mark.parametrize(("hand", "right", "up"), [(".stick", 0.0, -1.0), ("#slider-speed", -1.0, 0.0)])
def test_stick_and_slider_give_the_top_speed_backwards(
    driver: Operator, robot: Robot, hand: str, right: float, up: float
) -> None:
    driver.pulls(hand, right, up)
    driver.sees("#commanded", r"speed −0\.20 m/s")
    driver.page.mouse.up()
    robot.comes_to_rest(UNHELD_S)


def test_degrees_are_written_alike(driver: Operator) -> None:
    driver.page.fill("#slider-steering", "12")
    driver.sees(".slider:has(#slider-steering) output", "^12.0°$")
    driver.pulls("#slider-speed", 0.2, 0.0)
    driver.sees("#commanded", r"steering 12\.0°")
    driver.page.mouse.up()


def test_the_guard_against_jackknifing_says_why_the_vehicle_stands(driver: Operator, robot: Robot) -> None:
    robot.call("simulation.pace", factor=4.0)
    driver.pulls(".stick", right=-0.9, up=-0.9)
    driver.sees("#guarded", "Stands at its largest bending angle: the trailer is bent by [0-9.]+°. Drive the other way")
    driver.page.mouse.up()
    robot.comes_to_rest(UNHELD_S)
    driver.comes_to(lambda: driver.text("#guarded"), "")
    robot.call("simulation.pace", factor=1.0)
