"""On a phone: what is told lies over nothing that drives, stops or leads elsewhere; each panel begins at its top."""

from __future__ import annotations

from typing import Any

import pytest

from vcan_tests.station.browser import PHONE, Operator
from vcan_tests.station.conftest import Meet
from vcan_tests.station.processes import Robot
from vcan_tests.station.test_paths import PIECES, insert
from vcan_tests.station.test_views import NARROW

pytestmark = pytest.mark.station

LOW: dict[str, Any] = {**PHONE, "viewport": {"width": 667, "height": 375}}
SIZES = {"phone": PHONE, "narrow": NARROW, "on its side": LOW}
SAY = """async () => {
    const { station } = await import("/page/station.js");
    for (const n of [1, 2, 3]) station.say(`something went wrong, number ${n}: ${"why ".repeat(40)}`, "error", "wait");
}"""
SAY_LONG = """async () => {
    const { station } = await import("/page/station.js");
    station.say(`saved as /${"a-folder-with-a-long-name-".repeat(12)}/way.yaml`);
}"""
LEAST_WIDTH = 44
"""Of what a thumb meets, in pixels of the page."""
TABS = tuple(f"nav a[href='#{panel}']" for panel in ("drive", "map", "devices", "simulation"))
COVERED = """selector => {
    const element = document.querySelector(selector);
    if (!element.closest("header")) element.scrollIntoView({ block: "center" });
    const box = element.getBoundingClientRect();
    const over = document.elementFromPoint(box.x + box.width / 2, box.y + box.height / 2);
    return Boolean(over?.closest("#notices"));
}"""


@pytest.fixture(params=list(SIZES))
def holder(request: pytest.FixtureRequest, meet: Meet, robot: Robot) -> Operator:
    """Somebody who holds a phone, before the panel for driving."""
    operator = meet(**SIZES[request.param])
    operator.open(robot.name)
    operator.take_seat()
    return operator


def test_notices_cover_neither_stop_nor_tabs_nor_what_drives_and_can_be_closed(holder: Operator) -> None:
    holder.page.evaluate(SAY)
    holder.sees("#alarms", "number 3")
    for selector in ("#stop", "#estop", ".stick", "#slider-speed", "#slider-fastest", *TABS):
        assert (selector, holder.page.evaluate(COVERED, selector)) == (selector, False)
    for left in (2, 1, 0):
        holder.comes_to(lambda: holder.page.locator(".notice:visible").count(), 1)
        holder.comes_to(lambda: holder.text("#more-notices"), f"and {left} more" if left else "")
        holder.page.tap("#notices .close >> nth=0")
        holder.comes_to(holder.page.locator(".notice").count, left)


def test_a_notice_with_a_long_word_is_no_wider_than_the_phone_and_can_be_closed(holder: Operator) -> None:
    holder.page.evaluate(SAY_LONG)
    holder.sees("#notes", "way.yaml")
    for selector in ("#stop", *TABS):
        assert (selector, holder.page.evaluate(COVERED, selector)) == (selector, False)
    assert holder.page.evaluate("() => document.documentElement.scrollWidth <= innerWidth")
    box = holder.page.locator(".notice .close").bounding_box()
    assert box is not None
    assert box["x"] + box["width"] <= holder.page.evaluate("() => innerWidth")
    holder.page.tap(".notice .close")
    holder.comes_to(holder.page.locator(".notice").count, 0)


@pytest.mark.parametrize("size", [PHONE, NARROW])
def test_all_boxes_of_a_path_are_in_sight(meet: Meet, robot: Robot, size: dict[str, Any]) -> None:
    operator = meet(**size)
    operator.open(robot.name)
    operator.go_to("paths")
    insert(operator, "line", length="1")
    insert(operator, "arc", radius="2", turn="30")
    controls = operator.page.locator(f"{PIECES} :is(input, select, button)")
    assert controls.count() == 12
    for box in [control.bounding_box() for control in controls.all()]:
        assert box is not None
        assert box["x"] >= 0
        assert box["x"] + box["width"] <= size["viewport"]["width"]
        assert box["width"] >= LEAST_WIDTH


def test_only_boxes_without_negative_numbers_call_for_keys_without_a_minus(meet: Meet, robot: Robot) -> None:
    operator = meet(**PHONE)
    operator.open(robot.name)
    operator.go_to("paths")
    insert(operator, "arc", radius="2", turn="30")
    boxes = operator.page.locator(f"{PIECES} input.number")
    keys = {str(box.get_attribute("aria-label")).split()[0]: box.get_attribute("inputmode") for box in boxes.all()}
    assert keys == {"Length": "decimal", "Radius": "decimal", "Turn": "text"}


def test_another_panel_begins_at_its_top(meet: Meet, robot: Robot) -> None:
    operator = meet(**PHONE)
    operator.open(robot.name)
    operator.go_to("devices")
    operator.comes_to(lambda: operator.page.evaluate("() => (scrollTo(0, 600), scrollY > 300)"), True)
    operator.go_to("simulation")
    operator.comes_to(lambda: operator.page.evaluate("() => scrollY"), 0)
