"""What cannot be done now says so in words that need no pointer: phones show no tooltips."""

from __future__ import annotations

from typing import Any

import pytest

from vcan_tests.station.browser import PANELS, PHONE, Operator
from vcan_tests.station.conftest import Meet
from vcan_tests.station.processes import Robot

pytestmark = pytest.mark.station

UNTOLD = """() => [...document.querySelectorAll(":is(button, input, select):disabled[title]")]
    .filter(control => control.checkVisibility())
    .filter(control => !control.closest(".panel, header, .latched").innerText.includes(control.title))
    .map(control => `${control.innerText || control.getAttribute("aria-label") || control.id}: ${control.title}`)"""


def untold(operator: Operator) -> dict[str, Any]:
    """On a phone: controls of each panel that are disabled for a reason which stands nowhere in it."""
    found = {}
    for panel in PANELS:
        operator.go_to(panel)
        operator.page.wait_for_timeout(400.0)
        found[panel] = operator.page.evaluate(UNTOLD)
    return found


def test_while_the_emergency_stop_is_latched_each_panel_says_why_nothing_moves(
    meet: Meet, robot: Robot, expected_errors: list[str]
) -> None:
    expected_errors.append("emergency stop")
    operator = meet(**PHONE)
    operator.open(robot.name)
    operator.page.tap("#estop")
    operator.sees("#state", "emergency stop")
    assert untold(operator) == {panel: [] for panel in PANELS}
