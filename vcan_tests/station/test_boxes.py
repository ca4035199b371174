"""Boxes for numbers: a decimal comma counts as a point; nonsense is told beside the box, and moves nothing."""

from __future__ import annotations

import pytest

from vcan_tests.station.browser import Operator
from vcan_tests.station.processes import UNHELD_S, Robot, at_rest

pytestmark = pytest.mark.station

SIMULATION = "[data-panel=simulation]"
SLOPE, TOWARDS = f"{SIMULATION} form[aria-label=Slope] input >> nth=0", f"{SIMULATION} [aria-label^='Downhill towards']"
FAULT = f"{SIMULATION} form.fault-form"
STEER = "form[data-motion=steer]"
PARSED = "async written => String((await import('/page/numbers.js')).parsed(written))"
UNCLEAR = "async written => (await import('/page/numbers.js')).againstUnclear(written)"


def writes(operator: Operator, selector: str, words: str) -> None:
    """Write into a box, key by key, in place of what is there, and leave it."""
    operator.page.click(selector)
    operator.page.keyboard.press("Control+A")
    operator.page.keyboard.type(words)
    operator.page.keyboard.press("Tab")


def sees_refused(operator: Operator, selector: str, words: str) -> None:
    """Wait until these words stand beside a box that still shows what was written."""
    operator.until(lambda: operator.page.get_attribute(selector, "aria-invalid"), lambda: f"{selector} is taken")
    note = (operator.page.get_attribute(selector, "aria-describedby") or "").split()[-1]
    operator.sees(f"#{note}", words)


@pytest.mark.parametrize(
    ("written", "number"),
    [("1.5", "1.5"), ("1,5", "1.5"), ("-0,25", "-0.25"), ("−2", "-2"), (",5", "0.5"), (" 7 ", "7"), ("1e3", "1000")]
    + [(nonsense, "NaN") for nonsense in ("1,2,3", "1.5.2", "1,500.5", "1 500", "1,5m", "-", "0x10", "1e", "٣")],
)
def test_a_number_is_read_with_a_point_or_a_comma(operator: Operator, written: str, number: str) -> None:
    assert operator.page.evaluate(PARSED, written) == number


@pytest.mark.parametrize(("written", "words"), [("1,500", "write 1.500 or 1500"), ("0,500", ""), ("1,50", "")])
def test_a_comma_that_may_stand_between_thousands_is_asked_about(operator: Operator, written: str, words: str) -> None:
    assert operator.page.evaluate(UNCLEAR, written) == words


def test_a_slope_with_a_comma_is_tilted_to_and_one_with_two_is_not(operator: Operator, robot: Robot) -> None:
    def slope_deg() -> float:
        return float(robot.call("simulation.look")["floor"]["slope_deg"])

    operator.go_to("simulation")
    writes(operator, SLOPE, "1,5")
    operator.comes_to(lambda: operator.page.input_value(SLOPE), "1.5")
    operator.page.press(SLOPE, "Enter")
    operator.comes_to(slope_deg, 1.5)
    writes(operator, SLOPE, "1,2,3")
    operator.page.press(SLOPE, "Enter")
    sees_refused(operator, SLOPE, "this is no number")
    operator.catches_up()
    assert slope_deg() == 1.5
    operator.page.click(f"{SIMULATION} >> text=Make level")
    operator.comes_to(slope_deg, 0.0)


def test_a_fault_with_a_comma_has_the_number_that_was_written(operator: Operator, robot: Robot) -> None:
    operator.go_to("simulation")
    operator.page.select_option(f"{FAULT} select >> nth=0", "encoder_jump")
    angle = f"{FAULT} input >> nth=0"
    writes(operator, angle, "1,2,3")
    operator.page.click("text=Set this fault")
    sees_refused(operator, angle, "this is no number")
    operator.catches_up()
    assert robot.call("simulation.faults")["faults"] == []
    writes(operator, angle, "0,25")
    operator.page.click("text=Set this fault")
    operator.comes_to(lambda: [each["angle_deg"] for each in robot.call("simulation.faults")["faults"]], [0.25])
    robot.call("simulation.clear_faults")


def test_a_pair_steers_to_the_angle_with_a_comma_and_to_no_nonsense(operator: Operator, robot: Robot) -> None:
    def front_deg() -> float:
        return next(float(node["heading_deg"]) for node in robot.status()["nodes"] if node["name"] == "front")

    operator.take_seat()
    operator.page.click("text=Single motions")
    writes(operator, "#motion-angle", "1,2,3")
    operator.page.click(f"{STEER} button")
    sees_refused(operator, "#motion-angle", "this is no number")
    operator.catches_up()
    assert robot.status()["motions"] == []
    writes(operator, "#motion-angle", "4,5")
    operator.page.click(f"{STEER} button")
    operator.sees("#notes", "steer: done")
    assert 4.0 < front_deg() < 5.0


def test_a_space_in_a_box_for_a_number_is_a_stop(operator: Operator, robot: Robot) -> None:
    operator.go_to("simulation")
    robot.call("drive.parallel", angle_deg=0.0, speed_m_s=0.3, duration_s=60.0, wait=False)
    operator.sees("#state", "active")
    operator.page.focus(TOWARDS)
    operator.page.keyboard.press("Space")
    robot.comes_to_rest(UNHELD_S)


@pytest.mark.parametrize(
    ("value", "words"), [("", "give a number"), ("0", "give at least 1"), ("1,500", "write 1.500 or 1500")]
)
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
