"""Stop and emergency stop: by button, by key, from every panel, whoever drives."""

from __future__ import annotations

import pytest

from vcan_tests.station.browser import PANELS, Operator
from vcan_tests.station.conftest import Meet
from vcan_tests.station.processes import Robot, speeds

pytestmark = pytest.mark.station

SPEED_M_S = 0.4
REST_S = 10.0
"""The motion would go on for a minute; how soon a stop acts is measured elsewhere (``latency.py``)."""


@pytest.fixture
def driving(robot: Robot) -> Robot:
    """The robot, driving for a minute; the daemon holds the motion."""
    robot.call("drive.parallel", angle_deg=0.0, speed_m_s=SPEED_M_S, duration_s=60.0, wait=False)
    robot.comes_to(lambda status: min(speeds(status)) > 0.9 * SPEED_M_S)
    return robot


def test_the_button_stops_the_robot(operator: Operator, driving: Robot) -> None:
    operator.sees("#state", "active")
    operator.page.click("#stop")
    driving.comes_to_rest(REST_S)
    operator.sees("#notes", "stop")
    operator.sees("#state", "idle")


def test_the_button_stops_when_it_goes_down_and_not_when_it_comes_up(operator: Operator, driving: Robot) -> None:
    operator.page.hover("#stop")
    operator.page.mouse.down()
    driving.comes_to_rest(REST_S)
    operator.page.mouse.up()


@pytest.mark.parametrize("focused", ["body", "#robot", "#estop", "nav a[href='#events']", "[data-panel=map] button"])
def test_the_space_bar_stops_wherever_the_focus_is(operator: Operator, driving: Robot, focused: str) -> None:
    operator.page.eval_on_selector(focused, "element => element.focus()")
    operator.page.keyboard.press("Space")
    driving.comes_to_rest(REST_S)


def test_a_space_in_a_text_field_is_a_space_and_behind_escape_it_is_a_stop(operator: Operator, driving: Robot) -> None:
    operator.go_to("events")
    search = "[data-panel=events] input[type=search]"
    operator.page.type(search, "a b")
    operator.comes_to(lambda: operator.page.input_value(search), "a b")
    operator.catches_up()
    assert driving.status()["state"] == "active"
    operator.page.keyboard.press("Escape")
    operator.page.keyboard.press("Space")
    driving.comes_to_rest(REST_S)


@pytest.mark.parametrize("panel", [name for name in PANELS if name != "map"])
def test_the_stop_is_in_reach_on_every_panel(operator: Operator, panel: str) -> None:
    operator.go_to(panel)
    operator.catches_up()
    operator.page.evaluate("() => scrollTo(0, 5000)")
    operator.comes_to(lambda: operator.page.evaluate(TOP_ELEMENT, "#stop"), "stop")


TOP_ELEMENT = """selector => {
    const box = document.querySelector(selector).getBoundingClientRect();
    return document.elementFromPoint(box.x + box.width / 2, box.y + box.height / 2)?.closest("button")?.id;
}"""


def test_the_emergency_stop_is_latched_until_somebody_resets_it_twice(
    operator: Operator, driving: Robot, expected_errors: list[str]
) -> None:
    expected_errors.append("emergency stop")
    operator.page.click("#estop")
    driving.comes_to_rest(REST_S)
    operator.sees("#state", "emergency stop")
    operator.sees("#latched", "reset")
    assert driving.status()["state"] == "estop"
    operator.page.click("#reset")
    operator.sees("#reset", "It is safe")
    operator.catches_up()
    assert driving.status()["state"] == "estop"
    operator.page.click("#reset")
    operator.sees("#state", "idle")
    operator.comes_to(lambda: operator.page.is_hidden("#latched"), True)


def test_while_the_emergency_stop_is_latched_nothing_can_be_driven_and_the_reason_is_told(
    operator: Operator, robot: Robot, expected_errors: list[str]
) -> None:
    expected_errors.append("emergency stop")
    operator.page.click("#estop")
    operator.sees("#state", "emergency stop")
    operator.go_to("drive")
    operator.sees("[data-panel=drive]", "emergency stop is latched")
    operator.pulls(".stick", right=0.0, up=0.9)
    operator.catches_up()
    operator.page.mouse.up()
    robot.stays_at_rest()


def test_two_people_may_press_stop_at_once(meet: Meet, driving: Robot) -> None:
    operators = [meet(), meet()]
    for operator in operators:
        operator.open(driving.name)
    for operator in operators:
        operator.page.click("#stop")
    driving.comes_to_rest(REST_S)
    for operator in operators:
        operator.sees("#state", "idle")
