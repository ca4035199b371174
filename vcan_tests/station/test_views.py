"""Each panel at a desktop and on a phone, light and dark: in reach, readable, and for everybody."""

from __future__ import annotations

from typing import Any

import pytest

from vcan_tests.station.accessibility import findings
from vcan_tests.station.browser import DESKTOP, PANELS, PHONE, Operator
from vcan_tests.station.conftest import Meet
from vcan_tests.station.processes import Fleet, Robot

pytestmark = pytest.mark.station

ROBOTS = ("semitrailer",)
NARROW: dict[str, Any] = {**PHONE, "viewport": {"width": 320, "height": 568}}
SIZES = {"desktop": DESKTOP, "phone": PHONE}
FULLY_SEEN = """selector => {
    const box = document.querySelector(selector).getBoundingClientRect();
    const top = document.elementFromPoint(box.x + box.width / 2, box.y + box.height / 2);
    return box.width >= 44 && box.height >= 44 && box.left >= 0 && box.top >= 0 && box.right <= innerWidth &&
        box.bottom <= innerHeight && Boolean(top?.closest(selector));
}"""
TOO_WIDE = """() => [...document.querySelectorAll("body *")].filter(element => {
    const scrolls = element.closest(".scroll, nav, [role=tablist]");
    return !scrolls && element.getBoundingClientRect().right > innerWidth + 1 && element.checkVisibility();
}).map(element => element.outerHTML.slice(0, 80))"""


def panels_of(size: str) -> list[str]:
    """The panels that have a tab: beside a desktop's the map stands anyway."""
    return [name for name in PANELS if not (name == "map" and size == "desktop")]


@pytest.mark.parametrize(("scheme", "rules"), [("light", ()), ("dark", ("color-contrast",))])
@pytest.mark.parametrize("size", list(SIZES))
def test_no_panel_has_a_finding_of_the_accessibility_checker(
    meet: Meet, robot: Robot, size: str, scheme: str, rules: tuple[str, ...]
) -> None:
    """In the dark nothing but colours is another."""
    operator = meet(**SIZES[size], color_scheme=scheme, reduced_motion="reduce")
    operator.open(robot.name)
    found = {}
    for panel in panels_of(size):
        operator.go_to(panel)
        operator.catches_up()
        found[panel] = findings(operator.page, *rules)
    assert found == {panel: [] for panel in found}


def test_the_narrowest_phone_scrolls_no_panel_sideways_and_shows_the_stop(meet: Meet, robot: Robot) -> None:
    operator = meet(**NARROW)
    operator.open(robot.name)
    for panel in PANELS:
        operator.go_to(panel)
        operator.catches_up()
        wide = operator.page.evaluate("() => document.documentElement.scrollWidth")
        assert (panel, wide, operator.page.evaluate(TOO_WIDE)) == (panel, 320, [])
        operator.page.evaluate("() => scrollTo(0, 10000)")
        assert (panel, operator.page.evaluate(FULLY_SEEN, "#stop")) == (panel, True)


def test_a_phone_on_its_side_shows_the_stop(meet: Meet, robot: Robot) -> None:
    operator = meet(**{**PHONE, "viewport": {"width": 844, "height": 390}})
    operator.open(robot.name)
    for panel in panels_of("desktop"):
        operator.go_to(panel)
        operator.catches_up()
        assert (panel, operator.page.evaluate(FULLY_SEEN, "#stop")) == (panel, True)


def test_a_page_zoomed_to_twice_its_size_shows_the_stop(meet: Meet, robot: Robot) -> None:
    operator = meet(viewport={"width": 640, "height": 400}, device_scale_factor=2)
    operator.open(robot.name)
    operator.catches_up()
    assert operator.page.evaluate(FULLY_SEEN, "#stop")


def test_the_page_of_login_has_no_finding_either(browser: Any, meet: Meet, fleet: Fleet) -> None:
    operator = meet()
    answer = '{"login_needed": true, "role": null, "version": "0"}'
    operator.page.route("**/session", lambda route: route.fulfill(body=answer, content_type="application/json"))
    operator.open()
    operator.page.wait_for_selector("#login input")
    assert findings(operator.page) == []


def test_every_control_is_reached_by_the_tab_key_and_shows_its_focus(operator: Operator) -> None:
    operator.go_to("paths")
    seen = set()
    for _ in range(80):
        operator.page.keyboard.press("Tab")
        told = operator.page.evaluate(
            """() => { const e = document.activeElement, s = getComputedStyle(e);
                return [e.id || e.textContent.slice(0, 30) || e.getAttribute("aria-label") || e.tagName,
                        e === document.body || s.outlineStyle !== "none" || s.boxShadow !== "none"]; }"""
        )
        assert told[1], f"{told[0]} does not show that it has the focus"
        seen.add(told[0])
    assert {"robot", "stop", "estop"} <= seen


def test_nothing_moves_for_who_wants_no_motion(meet: Meet, robot: Robot) -> None:
    operator = meet(reduced_motion="reduce")
    operator.open(robot.name)
    operator.sees("#state", "idle")
    assert operator.page.evaluate("() => document.getAnimations().length") == 0
