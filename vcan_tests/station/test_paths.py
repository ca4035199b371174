"""Paths of the semi-trailer: drawn, checked, kept, driven backwards, recorded; and the runs that drives leave."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from profiles.path_file import load_path_file
from vcan_tests.station.browser import Operator
from vcan_tests.station.conftest import Meet
from vcan_tests.station.processes import UNHELD_S, Fleet, Robot, speeds
from vcan_tests.station.test_driving import HIDE

pytestmark = pytest.mark.station

ROBOTS = ("semitrailer",)
PANEL = "[data-panel=paths]"
PIECES = f"{PANEL} .path-pieces tbody tr"
MAP, POINTER = "[data-panel=map] canvas", "[data-panel=map] .map-cursor"
CURSOR = re.compile(r"x (.?[\d.]+) m, y (.?[\d.]+) m")
LARGEST_ERROR_M = 0.05
"""Off the path on the way; the drive would end by itself at 0.6 m."""


@pytest.fixture
def drawer(operator: Operator) -> Operator:
    """Somebody at the panel of paths, with an empty editor."""
    operator.go_to("paths")
    operator.sees(PANEL, "No path yet")
    return operator


def press(operator: Operator, name: str, within: str = PANEL) -> None:
    """Press the button of that name."""
    operator.page.locator(within).get_by_role("button", name=name, exact=True).click()


def insert(operator: Operator, kind: str, **numbers: str) -> None:
    """Put a piece behind the last one, with these numbers."""
    rows = operator.page.locator(PIECES)
    row = rows.nth(rows.count())
    press(operator, f"Insert {'an arc' if kind == 'arc' else 'a line'}")
    row.wait_for()
    for label, number in numbers.items():
        row.get_by_label(re.compile(label, re.IGNORECASE)).fill(number)
    operator.page.keyboard.press("Tab")


def pointed(operator: Operator, x: float, y: float) -> tuple[float, float, float, float]:
    """A place of the page on the map, and the place of the floor that the map tells for it."""
    before = operator.text(POINTER)
    operator.page.mouse.move(x, y)
    operator.until(lambda: operator.text(POINTER) not in ("", before), lambda: "no place is shown")
    found = CURSOR.search(operator.text(POINTER).replace("−", "-"))
    assert found is not None
    return x, y, float(found[1]), float(found[2])


def places(operator: Operator) -> Callable[[float, float], tuple[float, float]]:
    """From a place of the floor to one of the page, by what the map tells at two of its places."""
    box = operator.page.locator(MAP).bounding_box()
    assert box is not None
    first, second = (pointed(operator, box["x"] + s * box["width"], box["y"] + s * box["height"]) for s in (0.25, 0.75))
    (x1, y1, a1, b1), (x2, y2, a2, b2) = first, second
    return lambda a, b: (x1 + (a - a1) / (a2 - a1) * (x2 - x1), y1 + (b - b1) / (b2 - b1) * (y2 - y1))


def test_a_path_is_drawn_and_followed_backwards_to_its_end(drawer: Operator, robot: Robot) -> None:
    drawer.page.get_by_label("backwards").check()
    drawer.page.get_by_role("button", name="Follow the vehicle").click()
    drawer.page.get_by_role("button", name="Zoom out").click()
    trailer = robot.status()["vehicle"]["trailer"]
    on_map = places(drawer)
    drawer.page.click("button[data-tool=line]")
    drawer.page.mouse.click(*on_map(trailer["x_m"] - 0.8, trailer["y_m"]))
    drawer.page.click("button[data-tool=arc]")
    drawer.page.mouse.click(*on_map(trailer["x_m"] - 1.6, trailer["y_m"] + 0.25))
    drawer.comes_to(drawer.page.locator(PIECES).count, 2)
    drawer.sees(PANEL, "Can be driven")
    drawer.page.click("#path-drive")
    following = robot.comes_to(lambda status: status["vehicle"]["following"])["vehicle"]["following"]
    assert following["backward"] is True
    drawer.sees(f"{PANEL} .charts", r"limit .*cm")
    drawer.sees(f"{PANEL} .charts", "Bending error")
    errors = []

    def arrived(status: dict[str, Any]) -> bool:
        now = status["vehicle"]["following"]
        errors.extend([abs(now["error_m"])] if now else [])
        return now is None

    robot.comes_to(arrived)
    drawer.sees(PANEL, "Arrived after")
    assert max(errors) < LARGEST_ERROR_M
    end = robot.status()["vehicle"]["trailer"]
    assert end["x_m"] < trailer["x_m"] - 1.4


def test_a_path_that_cannot_be_driven_says_so_while_it_is_drawn(drawer: Operator) -> None:
    insert(drawer, "line")
    drawer.sees(PANEL, "Can be driven")
    insert(drawer, "arc", radius="0.2")
    drawer.sees(PANEL, "Cannot be driven:.*radius of 0.200 m.*widen the arc")
    drawer.comes_to(lambda: drawer.page.is_disabled("#path-drive"), True)
    drawer.comes_to(drawer.page.locator(f"{PANEL} tr[data-wrong]").count, 1)
    drawer.page.keyboard.press("Escape")
    press(drawer, "Undo")
    drawer.sees(PANEL, "Can be driven")


def test_the_end_of_a_piece_is_dragged_and_snaps(drawer: Operator) -> None:
    insert(drawer, "line", length="1")
    drawer.page.get_by_role("button", name="Follow the vehicle").click()
    press(drawer, "Fit", "[data-panel=map]")
    drawer.page.click("button[data-tool=move]")
    pose = drawer.page.evaluate("async () => (await import('/page/station.js')).station.status.vehicle.pose")
    on_map = places(drawer)
    heading = drawer.page.evaluate("angle => [Math.cos(angle), Math.sin(angle)]", pose["yaw_deg"] * 3.14159265 / 180)
    drawer.page.mouse.move(*on_map(pose["x_m"] + heading[0], pose["y_m"] + heading[1]))
    drawer.page.mouse.down()
    drawer.page.mouse.move(*on_map(pose["x_m"] + 0.62 * heading[0], pose["y_m"] + 0.62 * heading[1]), steps=4)
    drawer.page.mouse.up()
    length = drawer.page.get_by_label("Length of piece 0 in metres")
    drawer.comes_to(length.input_value, "0.6")


def test_a_path_is_saved_loaded_and_read_by_the_command_line(drawer: Operator, fleet: Fleet, robot: Robot) -> None:
    insert(drawer, "line", length="1.5")
    insert(drawer, "arc", radius="2", turn="30")
    drawer.page.get_by_label("Name").fill("to-the-bay")
    press(drawer, "Save")
    drawer.sees(PANEL, "to-the-bay is saved")
    press(drawer, "Clear")
    drawer.sees(PANEL, "No path yet")
    press(drawer, "Load")
    drawer.sees(PANEL, "to-the-bay is in the editor")
    drawer.comes_to(drawer.page.get_by_label("Radius of piece 1 in metres").input_value, "2")
    (kept,) = fleet.folder.glob(f"state/canhelm/{robot.name}/paths/*.yaml")
    assert [piece.line_m or piece.radius_m for piece in load_path_file(kept).spec.pieces] == [1.5, 2.0]


def test_a_path_that_is_there_is_replaced_only_when_somebody_says_so(drawer: Operator) -> None:
    insert(drawer, "line", length="1")
    drawer.page.get_by_label("Name").fill("again")
    press(drawer, "Save")
    drawer.sees(PANEL, "again is saved")
    press(drawer, "Clear")
    drawer.sees(PANEL, "No path yet")
    insert(drawer, "line", length="2")
    press(drawer, "Save")
    drawer.sees(PANEL, "Replace the path again")
    press(drawer, "Replace")
    drawer.sees(PANEL, r"again \(2\.0 m\)")


def test_a_path_is_deleted_only_when_somebody_says_so(drawer: Operator, fleet: Fleet, robot: Robot) -> None:
    insert(drawer, "line")
    drawer.page.get_by_label("Name").fill("old")
    press(drawer, "Save")
    drawer.sees(PANEL, "old is saved")
    drawer.page.select_option("#path-kept", "old")
    press(drawer, "Delete")
    kept = Path(fleet.folder, "state/canhelm", robot.name, "paths", "old.yaml")
    drawer.page.get_by_role("button", name="Delete for good").wait_for()
    drawer.catches_up()
    assert kept.exists()
    press(drawer, "Delete for good")
    drawer.sees(PANEL, "old is deleted")
    assert not kept.exists()


def test_the_way_that_is_driven_is_recorded_as_lines_and_arcs(drawer: Operator, robot: Robot) -> None:
    press(drawer, "Record a drive")
    drawer.sees(PANEL, "Recording")
    robot.call("drive.path", path={"pieces": [{"line_m": 0.8}, {"arc_deg": 30, "radius_m": 1.5}]})
    press(drawer, "End the recording")
    drawer.sees(PANEL, r"The recorded way is in the editor: 1\.\d+ m, \d pieces")
    pieces = drawer.page.locator(PIECES)
    drawer.until(lambda: pieces.count() >= 2, lambda: f"the path has {pieces.count()} pieces")


@pytest.fixture
def following(drawer: Operator, robot: Robot) -> Operator:
    """Somebody whose path of three metres is being driven."""
    insert(drawer, "line", length="3")
    drawer.sees(PANEL, "Can be driven")
    drawer.page.click("#path-drive")
    robot.comes_to(lambda status: max(speeds(status)) > 0.05)
    return drawer


def test_the_space_bar_ends_a_path(following: Operator, robot: Robot) -> None:
    following.page.keyboard.press("Space")
    robot.comes_to_rest(UNHELD_S)
    following.sees(PANEL, "not driven to its end")


def test_a_page_that_is_hidden_ends_a_path(following: Operator, robot: Robot) -> None:
    following.page.evaluate(HIDE, True)
    robot.comes_to_rest(UNHELD_S)
    following.page.evaluate(HIDE, False)
    following.sees(PANEL, "not driven to its end")
    following.catches_up()
    robot.stays_at_rest()


def test_a_page_that_is_closed_ends_a_path(following: Operator, robot: Robot) -> None:
    following.page.close()
    robot.comes_to_rest(UNHELD_S)


def test_a_second_page_shows_the_path_that_is_driven(following: Operator, meet: Meet, robot: Robot) -> None:
    second = meet()
    second.open(robot.name)
    second.go_to("paths")
    second.sees(f"{PANEL} .charts", "limit")
    driven = "[data-panel=map] canvas[aria-label*='following a path']"
    second.page.wait_for_selector(driven)
    following.page.click("#path-stop")
    robot.comes_to_rest(UNHELD_S)


def test_a_run_shows_its_picture_and_is_downloaded(operator: Operator, robot: Robot) -> None:
    robot.call("drive.path", path={"pieces": [{"line_m": 0.5}]})
    operator.go_to("runs")
    runs = "[data-panel=runs]"
    operator.sees(runs, "drive.path")
    operator.page.locator(f"{runs} tbody button").first.click()
    operator.page.wait_for_selector(f"{runs} img.run-picture", state="visible", timeout=60_000)
    operator.page.locator(f"{runs} tbody summary").first.click()
    with operator.page.expect_download() as download:
        operator.page.locator(f"{runs} a[download]", has_text="run.yaml").first.click()
    assert "drive.path" in Path(download.value.path()).read_text()
