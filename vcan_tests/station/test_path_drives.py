"""What stands on the page when a path was driven: where it was, where it begins now, and limits that are near."""

from __future__ import annotations

import pytest

from vcan_tests.station.browser import Operator
from vcan_tests.station.processes import Robot, speeds
from vcan_tests.station.test_paths import PANEL, insert

pytestmark = pytest.mark.station

ROBOTS = ("semitrailer",)
MAP = "[data-panel=map] canvas"
ANEW = "begins anew where the vehicle is now"
CHART = """async ([error_cm, limit_cm]) => {
    const [{Chart}, {palette}] = await Promise.all([import("/page/chart.js"), import("/page/canvas.js")]);
    const options = {title: "Error", unit: "cm", digits: 1, names: [""], least: 2};
    const chart = new Chart({stale: false, on() {}}, options);
    document.body.append(chart.element);
    chart.canvas.style.width = "400px";
    chart.add(1, [error_cm], limit_cm);
    for (let frame = 0; frame < 10; frame++) await new Promise(requestAnimationFrame);
    const context = chart.canvas.getContext("2d");
    const {width, height} = chart.canvas;
    context.fillStyle = palette().bad;
    context.fillRect(0, 0, 1, 1);
    const [...shown] = context.getImageData(0, 0, width, height).data;
    const bad = shown.splice(0, 4);
    let count = 0;
    for (let at = 0; at < shown.length; at += 4) {
        const near = [0, 1, 2].every(part => Math.abs(shown[at + part] - bad[part]) < 12);
        if (near && shown[at + 3] > 100) count += 1;
    }
    return [chart.newest.textContent, shown.some(value => value > 0), count];
}"""
"""What a chart tells, whether it has drawn something, and how many of its pixels have the colour of limits."""


@pytest.fixture
def drawer(operator: Operator) -> Operator:
    """Somebody whose path of half a metre can be driven."""
    operator.go_to("paths")
    insert(operator, "line", length="0.5")
    operator.sees(PANEL, "Can be driven")
    return operator


def map_in_words(operator: Operator) -> str:
    """What the map tells who does not see it."""
    return operator.page.locator(MAP).get_attribute("aria-label") or ""


def test_pieces_stand_under_their_heading(drawer: Operator) -> None:
    def top(selector: str) -> float:
        box = drawer.page.locator(f"{PANEL} {selector}").bounding_box()
        assert box is not None
        return float(box["y"])

    parts = ("legend:text-is('Start')", "#path-here", "legend:text-is('Pieces')", ".path-pieces")
    assert sorted(parts, key=top) == list(parts)


def test_what_is_told_of_a_path_that_was_stopped_is_a_sentence(drawer: Operator, robot: Robot) -> None:
    drawer.page.click("#path-drive")
    robot.comes_to(lambda status: max(speeds(status)) > 0.05)
    drawer.page.keyboard.press("Space")
    drawer.sees(PANEL, r"not driven to its end: .*[^.]\. The path in the editor")


def test_a_path_that_begins_where_the_vehicle_is_says_that_it_begins_anew(drawer: Operator) -> None:
    assert "path driven last" not in map_in_words(drawer)
    drawer.page.click("#path-drive")
    drawer.sees(PANEL, f"Arrived after.*{ANEW}")
    drawer.until(lambda: "m from the path driven last" in map_in_words(drawer), lambda: map_in_words(drawer))
    drawer.page.get_by_role("button", name="Clear trail").click()
    drawer.until(lambda: "path driven last" not in map_in_words(drawer), lambda: map_in_words(drawer))


def test_a_path_with_a_start_of_its_own_stays_where_it_is(drawer: Operator) -> None:
    drawer.page.get_by_label("Begin where the vehicle is").uncheck()
    drawer.sees(PANEL, "Can be driven")
    box = drawer.page.get_by_label("x of the start in metres")
    drawer.until(lambda: box.input_value() != "", lambda: "the start is not in its box")
    x = box.input_value()
    drawer.page.click("#path-drive")
    drawer.sees(PANEL, "Arrived after")
    assert ANEW not in drawer.text(PANEL)
    assert box.input_value() == x


def test_a_limit_that_is_far_is_told_and_not_drawn(operator: Operator) -> None:
    told, drawn, pixels = operator.page.evaluate(CHART, [1.0, 60.0])
    assert told.strip() == "1.0 cm, limit 60.0 cm, outside the chart"
    assert (drawn, pixels) == (True, 0)


def test_a_limit_that_is_near_is_a_line(operator: Operator) -> None:
    told, _, pixels = operator.page.evaluate(CHART, [20.0, 60.0])
    assert told.strip() == "20.0 cm, limit 60.0 cm"
    assert pixels > 200
