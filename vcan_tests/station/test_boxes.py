"""Nonsense in the boxes of Jog, Slope and Friction is told beside the box, and moves nothing."""

from __future__ import annotations

import pytest

from vcan_tests.station.browser import Operator
from vcan_tests.station.processes import Robot, at_rest

pytestmark = pytest.mark.station

SIMULATION = "[data-panel=simulation]"


@pytest.mark.parametrize(("value", "words"), [("", "give a number"), ("0", "give at least 1")])
def test_a_jog_at_no_speed_says_so_and_does_not_turn(operator: Operator, robot: Robot, value: str, words: str) -> None:
    operator.go_to("devices")
    jog = operator.page.locator("[data-panel=devices] .jog").first
    jog.locator("input").fill(value)
    jog.locator("button").first.click(delay=300)
    operator.until(lambda: words in jog.inner_text(), jog.inner_text)
    assert at_rest(robot.status())


def test_a_slope_that_is_no_number_is_told_beside_its_box_and_tilts_nothing(operator: Operator, robot: Robot) -> None:
    operator.go_to("simulation")
    form = f"{SIMULATION} form[aria-label=Slope]"
    operator.page.fill(f"{form} input >> nth=1", "400")
    operator.page.press(f"{form} input >> nth=1", "Enter")
    operator.sees(form, "give at most 180")
    assert robot.call("simulation.look")["floor"]["direction_deg"] == 0.0


def test_no_coefficient_of_friction_is_told_beside_its_box_and_lays_no_ice(operator: Operator, robot: Robot) -> None:
    operator.go_to("simulation")
    operator.page.fill(f"{SIMULATION} input[aria-label='Coefficient of friction']", "")
    operator.page.click(f"{SIMULATION} button:has-text('All wheels on ice')")
    operator.sees(SIMULATION, "give a number")
    assert robot.call("simulation.faults")["faults"] == []
