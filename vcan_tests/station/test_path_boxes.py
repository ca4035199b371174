"""Boxes of the panel of paths: what is no good value blocks everything that would use the former one."""

from __future__ import annotations

import json
import re
from typing import Any

import pytest

from vcan_tests.station.browser import Operator
from vcan_tests.station.conftest import Meet
from vcan_tests.station.processes import Robot
from vcan_tests.station.test_paths import PANEL, insert, press

pytestmark = pytest.mark.station

ROBOTS = ("semitrailer",)
SPEED = "Speed in metres a second"
LENGTH, RADIUS, TURN = "Length of piece 0 in metres", "Radius of piece 1 in metres", "Turn of piece 1 in degrees"
X, HEADING = "x of the start in metres", "Heading of the start in degrees"
ANSWERED = "import('/page/station.js').then(({station}) => station.call('status')).then(() => true)"
CLICKS = "selector => document.querySelector(selector).click()"


class Drawer:
    """Somebody at the panel of paths, and all that their page asks the robot for.

    Args:
        operator: who.
    """

    def __init__(self, operator: Operator, robot: Robot) -> None:
        self.operator, self.page = operator, operator.page
        self._asked: list[dict[str, Any]] = []
        self.page.on("websocket", lambda socket: socket.on("framesent", self._on_frame))
        operator.open(robot.name)
        operator.go_to("paths")
        operator.sees(PANEL, "No path yet")

    def adds_line_and_arc(self) -> None:
        """Put a line of a metre and an arc of 30 degrees into the editor."""
        insert(self.operator, "line", length="1")
        insert(self.operator, "arc", radius="2", turn="30")

    def _on_frame(self, frame: str | bytes) -> None:
        self._asked.append(json.loads(frame))

    def drives(self) -> list[dict[str, Any]]:
        """The paths that the robot was asked to drive up to now, without those that were only to be checked."""
        assert self.page.evaluate(ANSWERED)
        asked = [request["params"] for request in self._asked if request["method"] == "drive.path"]
        return [params for params in asked if not params.get("dry_run")]

    def box(self, label: str) -> Any:
        """A box by its label."""
        return self.page.get_by_label(re.compile(f"^{label}"))

    def types(self, label: str, words: str) -> None:
        """Write into a box, key by key, in place of what is there, and stay in it."""
        self.box(label).click()
        self.page.keyboard.press("Control+A")
        self.page.keyboard.press("Delete")
        self.page.keyboard.type(words)

    def writes(self, label: str, words: str) -> None:
        """Write into a box, and leave it."""
        self.types(label, words)
        self.page.keyboard.press("Tab")

    def sees_blocked(self, label: str, words: str) -> None:
        """Wait until what is wrong with a box stands beside it and in the verdict, and nothing can be done."""
        self.operator.sees(f"{PANEL} .path-verdict", f"^✖ Cannot be driven: {label}[^:]*: {words}")
        note = self.box(label).get_attribute("aria-describedby")
        self.operator.sees(f"#{note}", f"^{words}")
        self.operator.sees(f"{PANEL} .path-drive .reason", f"^{label}[^:]*: {words}")
        for name in ("Drive the path", "Save", "Export"):
            self.operator.until(self.button(name).is_disabled, lambda: f"{name} can be pressed")  # noqa: B023

    def sees_drivable(self) -> None:
        """Wait until the path can be driven, saved and exported."""
        self.operator.sees(f"{PANEL} .path-verdict", "✔ Can be driven")
        for name in ("Drive the path", "Save", "Export"):
            self.operator.until(self.button(name).is_enabled, lambda: f"{name} cannot be pressed")  # noqa: B023

    def button(self, name: str) -> Any:
        """A button of the panel."""
        return self.page.locator(PANEL).get_by_role("button", name=name, exact=True)

    def notes(self) -> str:
        """What is told of wrong boxes."""
        return " ".join(self.page.locator(f"{PANEL} .wrong").all_inner_texts()).strip()


@pytest.fixture
def drawer(meet: Meet, robot: Robot) -> Drawer:
    """Somebody whose path of a line of a metre and an arc can be driven, and saved."""
    drawer = Drawer(meet(), robot)
    drawer.adds_line_and_arc()
    drawer.page.get_by_label("Name").fill("boxes")
    drawer.sees_drivable()
    return drawer


@pytest.mark.parametrize(
    ("typed", "told"), [("0", "give at least 0.001"), ("-1", "give at least 0.001"), ("-", "this is no number")]
)
def test_a_speed_that_is_none_blocks_the_drive_and_is_told_in_words(drawer: Drawer, typed: str, told: str) -> None:
    drawer.writes(SPEED, typed)
    drawer.sees_blocked(SPEED, told)
    drawer.page.evaluate(CLICKS, "#path-drive")
    assert drawer.drives() == []
    drawer.writes(SPEED, "0.05")
    drawer.sees_drivable()


def test_a_box_that_held_nonsense_and_is_emptied_counts_as_empty(drawer: Drawer) -> None:
    drawer.writes(SPEED, "0.05")
    drawer.writes(SPEED, "-")
    drawer.sees_blocked(SPEED, "this is no number")
    drawer.writes(SPEED, "")
    drawer.sees_drivable()
    drawer.page.click("#path-drive")
    drawer.operator.until(drawer.drives, lambda: "nothing was sent")
    assert "speed_m_s" not in drawer.drives()[0]


@pytest.mark.parametrize(
    ("label", "typed", "told"),
    [
        (LENGTH, "-1", "give at least 0.01"),
        (LENGTH, "", "give a number"),
        (LENGTH, "1,2,3", "this is no number"),
        (RADIUS, "1.5.2", "this is no number"),
        (RADIUS, "0", "give at least 0.01"),
        (TURN, "0", "an arc turns"),
        (TURN, "4000", "give at most 3600"),
        (X, "", "give a number"),
        (HEADING, "400", "give at most 360"),
    ],
)
def test_a_wrong_number_of_the_path_blocks_driving_and_keeping_it(
    drawer: Drawer, label: str, typed: str, told: str
) -> None:
    drawer.page.get_by_label("Begin where the vehicle is").uncheck()
    drawer.sees_drivable()
    drawer.writes(label, typed)
    drawer.sees_blocked(label, told)
    for selector in ("#path-drive", f"{PANEL} button:text-is('Save')"):
        drawer.page.locator(selector).dispatch_event("click")
    assert drawer.drives() == []
    assert drawer.box(label).input_value() == typed


def test_undo_puts_a_wrong_box_back_and_leaves_the_path(drawer: Drawer) -> None:
    drawer.writes(LENGTH, "2")
    drawer.writes(LENGTH, "-3")
    drawer.sees_blocked(LENGTH, "give at least")
    press(drawer.operator, "Undo")
    drawer.sees_drivable()
    assert (drawer.box(LENGTH).input_value(), drawer.notes()) == ("2", "")
    press(drawer.operator, "Undo")
    drawer.operator.until(lambda: drawer.box(LENGTH).input_value() == "1", lambda: "nothing more is undone")


def test_a_wrong_box_stays_with_its_piece(drawer: Drawer) -> None:
    drawer.writes(RADIUS, "-2")
    drawer.sees_blocked(RADIUS, "give at least")
    press(drawer.operator, "Remove piece 0")
    drawer.sees_blocked("Radius of piece 0", "give at least")
    press(drawer.operator, "Remove piece 0")
    drawer.operator.sees(PANEL, "No path yet")
    assert drawer.notes() == ""


def test_a_number_that_is_half_typed_is_not_yet_wrong(drawer: Drawer) -> None:
    drawer.types(SPEED, "0")
    drawer.page.wait_for_function("() => new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")
    assert drawer.notes() == ""
    drawer.sees_drivable()
    drawer.page.keyboard.type(".05")
    drawer.page.keyboard.press("Tab")
    drawer.sees_drivable()
    assert drawer.box(SPEED).input_value() == "0.05"


def test_a_decimal_comma_is_a_decimal_point(drawer: Drawer) -> None:
    drawer.writes(LENGTH, "1,5")
    drawer.writes(RADIUS, "2,25")
    drawer.sees_drivable()
    assert [drawer.box(label).input_value() for label in (LENGTH, RADIUS)] == ["1.5", "2.25"]
    drawer.types(SPEED, "0,05")
    drawer.page.click("#path-drive")
    drawer.operator.until(drawer.drives, lambda: "nothing was sent")
    (asked,) = drawer.drives()
    assert (asked["speed_m_s"], asked["path"]["pieces"][0]["line_m"]) == (0.05, 1.5)


def test_driving_right_after_typing_takes_what_was_typed(drawer: Drawer) -> None:
    drawer.types(SPEED, "0.05")
    drawer.page.click("#path-drive")
    drawer.operator.until(drawer.drives, lambda: "nothing was sent")
    assert drawer.drives()[0]["speed_m_s"] == 0.05


def test_driving_right_after_typing_what_is_wrong_sends_nothing(drawer: Drawer) -> None:
    drawer.types(SPEED, "0")
    box = drawer.page.locator("#path-drive").bounding_box()
    assert box is not None
    drawer.page.mouse.click(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    drawer.sees_blocked(SPEED, "give at least 0.001")
    assert drawer.drives() == []


@pytest.mark.parametrize(("typed", "speeds"), [("0.05", [0.05]), ("-1", [])])
def test_a_click_that_leaves_the_focus_in_a_box_takes_what_stands_there(
    drawer: Drawer, typed: str, speeds: list[float]
) -> None:
    drawer.types(SPEED, typed)
    drawer.page.evaluate(CLICKS, "#path-drive")
    if not speeds:
        drawer.sees_blocked(SPEED, "give at least 0.001")
    else:
        drawer.operator.until(drawer.drives, lambda: "nothing was sent")
    assert [params["speed_m_s"] for params in drawer.drives()] == speeds
