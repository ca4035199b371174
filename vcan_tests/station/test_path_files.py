"""Files of paths: what is saved is what is driven, path files are imported, a tight recording is told of."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path
from typing import Any

import msgspec
import pytest

from canhelm.client import Client
from daemon.loops.odometry import Pose
from daemon.loops.path import Piece
from daemon.runtime.path_building import PathBuilder
from profiles.path_file import PathSpec, load_path_file
from vcan_tests.station.browser import Operator
from vcan_tests.station.conftest import Meet
from vcan_tests.station.processes import Fleet, Robot
from vcan_tests.station.test_path_boxes import Drawer
from vcan_tests.station.test_paths import PANEL, press

pytestmark = pytest.mark.station

ROBOTS = ("semitrailer",)
BEGIN = Pose(1.0, -2.0, 0.5)
CURVATURE = 10.0
LEAD_M = 0.6
STEERING_DEG = 22.0
"""On this truck a radius of 0.53 m; a path may have 0.82 m."""
COS_OF_TURN = math.cos(math.radians(50.0))
WAY = """# Fitted to way.csv.
pieces:
  - {line_m: 1.25}
  - {drive: backward, arc_deg: -30, radius_m: 2}
"""
HALF = "pieces:\n  - {line_m: 1.5}\n  - {arc_deg: 90}\n"
QUESTION = f"{PANEL} .question"
WRONG = "pieces:\n  - {line_m: 1}\n  - {line_m: long}\n"


def driven(path: Any, *, backward: bool) -> list[Piece]:
    """The pieces that a vehicle with a trailer drives, when it is asked for this."""
    spec = msgspec.convert(path, PathSpec)
    builder = PathBuilder(BEGIN, LEAD_M, backward, CURVATURE, CURVATURE)
    for piece in spec.pieces:
        builder.add(piece)
    return builder.finished(0.0).pieces


@pytest.fixture
def drawer(meet: Meet, robot: Robot) -> Drawer:
    """Somebody whose path of a line and an arc the other way is to be driven backwards."""
    drawer = Drawer(meet(), robot)
    drawer.adds_line_and_arc()
    drawer.page.get_by_label("Driving direction of piece 1").select_option("backward")
    drawer.page.get_by_label("backwards").check()
    drawer.page.get_by_label("Name").fill("turned")
    drawer.operator.sees(PANEL, "Save and Export write the path as it is driven: backwards")
    drawer.sees_drivable()
    return drawer


def asked_to_drive(drawer: Drawer) -> list[Piece]:
    """Press the button to drive; the pieces that the robot is asked to drive."""
    before = len(drawer.drives())
    drawer.page.click("#path-drive")
    drawer.operator.until(lambda: len(drawer.drives()) > before, lambda: "nothing was sent")
    params = drawer.drives()[-1]
    drawer.page.click("#path-stop")
    drawer.operator.sees(PANEL, "not driven to its end")
    return driven(params["path"], backward=params["backward"])


def test_a_path_that_is_driven_backwards_is_saved_and_loaded_as_that(
    drawer: Drawer, fleet: Fleet, robot: Robot
) -> None:
    press(drawer.operator, "Save")
    drawer.operator.sees(PANEL, "turned is saved, as it is driven backwards")
    before = asked_to_drive(drawer)
    press(drawer.operator, "Load")
    drawer.operator.sees(PANEL, "turned is in the editor.*forwards is chosen again")
    drawer.operator.until(
        lambda: drawer.page.get_by_label("forwards", exact=True).is_checked(), lambda: "still backwards"
    )
    drawer.sees_drivable()
    assert asked_to_drive(drawer) == before
    (kept,) = fleet.folder.glob(f"state/canhelm/{robot.name}/paths/turned.yaml")
    assert driven(msgspec.to_builtins(load_path_file(kept).spec), backward=False) == before


def test_a_path_that_is_driven_backwards_is_exported_as_that(drawer: Drawer) -> None:
    with drawer.page.expect_download() as download:
        press(drawer.operator, "Export")
    exported = json.loads(Path(download.value.path()).read_text())
    assert [piece.get("drive") for piece in exported["pieces"]] == ["backward", "forward"]


def test_undo_takes_the_choice_of_backwards_back(drawer: Drawer) -> None:
    press(drawer.operator, "Undo")
    drawer.operator.until(
        lambda: drawer.page.get_by_label("forwards", exact=True).is_checked(), lambda: "still backwards"
    )


def imports(operator: Operator, name: str, content: bytes) -> None:
    """Choose a file of this machine."""
    files = [{"name": name, "mimeType": "application/yaml", "buffer": content}]
    operator.page.set_input_files(f"{PANEL} input[type=file]", files)


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("way.yaml", WAY),
        ("way.yml", f"\ufeff{WAY}"),
        ("way.json", '{"pieces": [{"line_m": 1.25}, {"drive": "backward", "arc_deg": -30, "radius_m": 2}]}'),
    ],
)
def test_a_path_file_is_imported(operator: Operator, name: str, content: str) -> None:
    operator.go_to("paths")
    imports(operator, name, content.encode())
    operator.sees(PANEL, f"{re.escape(name)} is in the editor")
    page = operator.page
    operator.until(lambda: page.locator(f"{PANEL} .path-pieces tbody tr").count() == 2, lambda: "not two pieces")
    assert page.get_by_label("Length of piece 0").input_value() == "1.25"
    assert page.get_by_label("Turn of piece 1").input_value() == "-30"
    assert page.get_by_label("Driving direction of piece 1").input_value() == "backward"
    assert page.get_by_label("Name").input_value() == "way"


def test_a_path_file_with_a_mistake_is_refused_with_its_line(operator: Operator) -> None:
    operator.go_to("paths")
    imports(operator, "way.yaml", WRONG.encode())
    operator.sees("#alarms", r"way\.yaml:3: pieces\[1\]\.line_m: is not a finite number")
    operator.sees(PANEL, "No path yet")


def keeps(fleet: Fleet, robot: Robot, name: str, content: str) -> None:
    """Put a path file among those that the station keeps for a robot."""
    folder = fleet.folder / "state" / "canhelm" / robot.name / "paths"
    folder.mkdir(parents=True, exist_ok=True)
    (folder / f"{name}.yaml").write_text(content)


@pytest.mark.parametrize("button", ["Import", "Load"])
def test_a_path_with_a_piece_that_is_none_is_refused_whole_and_the_editor_stays_as_it_is(
    operator: Operator, fleet: Fleet, robot: Robot, button: str
) -> None:
    keeps(fleet, robot, "half", HALF)
    operator.go_to("paths")
    imports(operator, "way.yaml", WAY.encode())
    operator.sees(PANEL, "way.yaml is in the editor")
    if button == "Import":
        imports(operator, "half.yaml", HALF.encode())
    else:
        operator.page.select_option("#path-kept", "half")
        press(operator, "Load")
    operator.sees("#alarms", r"half\.yaml:3: piece 1: arc_deg 90 has neither radius_m nor centre_m")
    assert operator.page.get_by_label("Length of piece 0").input_value() == "1.25"
    assert operator.page.get_by_label("Name").input_value() == "way"


@pytest.mark.parametrize("change", ["Import", "Load", "Clear", "Name"])
def test_the_question_whether_to_replace_a_path_is_withdrawn_with_what_it_was_asked_for(
    operator: Operator, fleet: Fleet, robot: Robot, change: str
) -> None:
    keeps(fleet, robot, "one", WAY)
    operator.go_to("paths")
    operator.page.select_option("#path-kept", "one")
    press(operator, "Load")
    operator.sees(PANEL, "one is in the editor")
    press(operator, "Save")
    operator.sees(QUESTION, "Replace the path one?")
    if change == "Import":
        imports(operator, "other.yaml", b"pieces: [{line_m: 7}]")
    elif change == "Name":
        operator.page.get_by_label("Name").fill("two")
    else:
        press(operator, change)
    operator.page.locator(QUESTION).wait_for(state="hidden")


def test_a_file_that_no_message_holds_is_refused_in_words(operator: Operator) -> None:
    operator.go_to("paths")
    imports(operator, "long.yaml", f"{WAY}{'#' * 70_000}".encode())
    operator.sees("#alarms", "long.yaml is too long for a page.*canhelm drive path")


def drives_tightly(robot: Robot) -> None:
    """Drive by hand, round a bend that is tighter than a path may be, and come to rest."""
    with Client(robot.socket) as client:
        yaw_deg = client.status()["vehicle"]["pose"]["yaw_deg"]
        while math.cos(math.radians(client.status()["vehicle"]["pose"]["yaw_deg"] - yaw_deg)) > COS_OF_TURN:
            client.call("drive.set", speed_m_s=0.2, steering_deg=STEERING_DEG, valid_for_ms=1000.0)
        client.stop()


def test_a_piece_that_is_shorter_than_one_may_type_is_driven(operator: Operator) -> None:
    operator.go_to("paths")
    imports(operator, "short.yaml", b"pieces: [{line_m: 0.005}, {line_m: 1}]")
    operator.sees(PANEL, "Can be driven")
    operator.page.get_by_label("Length of piece 0").focus()
    operator.page.keyboard.press("Tab")
    operator.page.get_by_label("Length of piece 1").fill("2")
    operator.page.keyboard.press("Tab")
    operator.sees(PANEL, r"Can be driven: 2\.0\d m")


def test_a_recording_that_is_too_tight_for_the_vehicle_is_told_of_at_once(operator: Operator, robot: Robot) -> None:
    operator.go_to("paths")
    press(operator, "Record a drive")
    operator.sees(PANEL, "Recording")
    drives_tightly(robot)
    press(operator, "End the recording")
    operator.sees("#notices", r"The recorded way is in the editor, but it cannot be driven: piece \d.* radius of")
