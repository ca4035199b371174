"""The paths that the station keeps: names that lead nowhere else, whole files, checks before anything is written."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import pytest

from canhelm.errors import LimitExceeded, NotReady, Refused, UsageError
from daemon.station import paths
from daemon.station.robots import Robot
from profiles.path_file import load_path_file

pytestmark = pytest.mark.real_time

SQUARE: dict[str, Any] = {
    "description": 'a "corner"\nof two lines',
    "start": {"x_m": 1.0, "y_m": -2.0, "heading_deg": 45.0},
    "pieces": [{"line_m": 1.25}, {"arc_deg": -90.0, "radius_m": 0.8}, {"drive": "forward", "line_m": 0.3}],
}
AND_BACK = {"pieces": [{"line_m": 1.0}, {"drive": "backward", "from_m": [0.4, 0.0], "line_m": 0.5}]}


@pytest.fixture
def robot(tmp_path: Path) -> Robot:
    return Robot("max2d", tmp_path / "max2d.sock", tmp_path / "max2d")


async def write(robot: Robot, name: str, path: Any = SQUARE, *, replace: bool = False) -> dict[str, Any]:
    return await paths.write_path(robot, {"name": name, "path": path, "replace": replace})


async def read(robot: Robot, name: str) -> Any:
    """As it goes over the wire."""
    return json.loads(json.dumps((await paths.read_path(robot, {"name": name}))["path"]))


async def names(robot: Robot) -> list[str]:
    return [path["name"] for path in (await paths.list_paths(robot, {}))["paths"]]


async def test_a_path_that_was_written_is_read_as_it_was(robot: Robot) -> None:
    await write(robot, "corner")
    assert await read(robot, "corner") == SQUARE


async def test_a_kept_path_is_a_file_that_can_be_driven(robot: Robot) -> None:
    await write(robot, "corner")
    assert len(load_path_file(robot.folder / "paths" / "corner.yaml").spec.pieces) == 3


async def test_the_list_tells_length_and_time_of_change(robot: Robot) -> None:
    await write(robot, "corner")
    (told,) = (await paths.list_paths(robot, {}))["paths"]
    assert told["length_m"] == pytest.approx(1.25 + 0.8 * 1.5708 + 0.3, abs=1e-3)
    assert told["changed_s"] == pytest.approx((robot.folder / "paths" / "corner.yaml").stat().st_mtime, abs=0.01)


async def test_where_no_path_was_kept_the_list_is_empty(robot: Robot) -> None:
    assert await names(robot) == []


async def test_a_file_that_was_edited_wrongly_has_no_length_and_says_where_it_is_wrong(robot: Robot) -> None:
    await write(robot, "corner")
    (robot.folder / "paths" / "corner.yaml").write_text("pieces:\n  - {lime_m: 1}\n")
    (told,) = (await paths.list_paths(robot, {}))["paths"]
    assert told["length_m"] is None
    with pytest.raises(UsageError, match=r"corner\.yaml:2: pieces\[0\]"):
        await read(robot, "corner")


async def test_a_kept_path_with_a_piece_that_is_none_is_refused_with_its_line(robot: Robot) -> None:
    await write(robot, "corner")
    (robot.folder / "paths" / "corner.yaml").write_text("pieces:\n  - {line_m: 1}\n  - {arc_deg: 90}\n")
    with pytest.raises(UsageError, match=r"corner\.yaml:3: piece 1: arc_deg 90 has neither radius_m nor centre_m"):
        await read(robot, "corner")


@pytest.mark.parametrize(
    "name", ["", "..", "../up", "a/b", "/etc/passwd", "a.yaml", ".hidden", "-x", "a\n", "a" * 61, "ä", "a\0b"]
)
async def test_a_name_that_leads_elsewhere_is_refused(robot: Robot, name: str) -> None:
    for call in (paths.read_path, paths.delete_path, paths.write_path):
        with pytest.raises(UsageError, match="no name of a path"):
            await call(robot, {"name": name, "path": SQUARE, "replace": True})
    assert not robot.folder.exists()


async def test_a_link_is_neither_read_nor_listed_nor_deleted(robot: Robot, tmp_path: Path) -> None:
    secret = tmp_path / "secret.yaml"
    secret.write_text("pieces: [{line_m: 1}]\n")
    (robot.folder / "paths").mkdir(parents=True)
    (robot.folder / "paths" / "link.yaml").symlink_to(secret)
    assert await names(robot) == []
    for call in (paths.read_path, paths.delete_path):
        with pytest.raises(UsageError, match="no path link is kept"):
            await call(robot, {"name": "link"})


async def test_a_path_is_replaced_only_where_that_was_asked_for(robot: Robot) -> None:
    await write(robot, "corner")
    with pytest.raises(Refused, match="already"):
        await write(robot, "corner", AND_BACK)
    assert await read(robot, "corner") == SQUARE
    await write(robot, "corner", AND_BACK, replace=True)
    assert await read(robot, "corner") == AND_BACK


async def test_a_deleted_path_is_gone(robot: Robot) -> None:
    await write(robot, "corner")
    await paths.delete_path(robot, {"name": "corner"})
    assert await names(robot) == []
    with pytest.raises(UsageError, match="no path corner"):
        await paths.delete_path(robot, {"name": "corner"})


@pytest.mark.parametrize(
    ("pieces", "place"),
    [
        ([], "pieces"),
        ([{"line_m": 1}, {"lime_m": 1}], "pieces[1]"),
        ([{"line_m": 1}, {"arc_deg": 90}], "pieces[1]"),
        ([{"line_m": 1}, {"line_m": 1, "arc_deg": 5, "radius_m": 1}], "pieces[1]"),
        ([{"line_m": 1}, {"from_m": [1.5, 0], "line_m": 1}], "pieces[1]"),
        ([{"line_m": 1}, {"drive": "backward", "line_m": 1}, {"from_m": [9, 9], "line_m": 1}], "pieces[2]"),
        ([{"line_m": -1}], "pieces[0].line_m"),
    ],
)
async def test_a_path_with_a_mistake_is_not_written_and_the_mistake_is_placed(
    robot: Robot, pieces: list[Any], place: str
) -> None:
    with pytest.raises(UsageError) as refusal:
        await write(robot, "wrong", {"pieces": pieces})
    assert refusal.value.object == place
    assert await names(robot) == []


async def test_a_path_with_a_number_that_no_vehicle_can_drive_is_not_written(robot: Robot) -> None:
    with pytest.raises(LimitExceeded):
        await write(robot, "far", {"pieces": [{"line_m": 1e9}]})


async def test_a_turn_of_the_driving_direction_may_begin_elsewhere(robot: Robot) -> None:
    assert (await write(robot, "back", AND_BACK))["length_m"] == 1.5


async def test_a_path_that_is_too_large_is_not_written(robot: Robot) -> None:
    with pytest.raises(LimitExceeded, match="too large"):
        await write(robot, "long", {"pieces": [{"arc_deg": 0.123456789, "radius_m": 2.3456789}] * 12_000})
    assert await names(robot) == []


async def test_a_file_that_is_too_large_is_not_read(robot: Robot) -> None:
    (robot.folder / "paths").mkdir(parents=True)
    (robot.folder / "paths" / "long.yaml").write_text("pieces:\n" + "  - {line_m: 0.123456789}\n" * 30_000)
    with pytest.raises(LimitExceeded, match="too large for a page"):
        await read(robot, "long")


async def test_no_more_paths_are_kept_than_may_be(robot: Robot, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(paths, "MAX_PATHS", 2)
    for name in ("one", "two"):
        await write(robot, name)
    with pytest.raises(LimitExceeded, match="too many paths"):
        await write(robot, "three")
    await write(robot, "two", AND_BACK, replace=True)


async def test_a_write_that_fails_leaves_the_old_path_and_no_draft(
    robot: Robot, monkeypatch: pytest.MonkeyPatch
) -> None:
    await write(robot, "corner")

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "replace", full)
    with pytest.raises(NotReady, match="No space left"):
        await write(robot, "corner", AND_BACK, replace=True)
    assert await read(robot, "corner") == SQUARE
    assert [file.name for file in (robot.folder / "paths").iterdir()] == ["corner.yaml"]


async def test_a_folder_that_cannot_be_made_is_told(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(NotReady, match="paths cannot be kept"):
        await write(Robot("max2d", tmp_path / "max2d.sock", tmp_path / "file"), "corner")


async def test_a_path_file_of_a_page_is_read_as_one_of_this_machine(robot: Robot) -> None:
    lines = ["# fitted", "pieces:", "  - {line_m: 1.5}", "  - {drive: backward, line_m: 2}", ""]
    told = await paths.parse_path(robot, {"file": "way.yaml", "lines": lines})
    assert told == {"path": {"pieces": [{"line_m": 1.5}, {"line_m": 2.0, "drive": "backward"}]}}


@pytest.mark.parametrize(
    ("lines", "told"),
    [
        (["pieces:", "  - {line_m: 1}", "  - {lime_m: 1}"], r"way\.yaml:3: pieces\[1\]"),
        (["pieces: [", "{line_m: 1"], r"way\.yaml:3: YAML"),
        ([], r"way\.yaml:1: the path is empty"),
        (["pieces: [{line_m: 1}]", 7], "a line is no text"),
        (["pieces:", "- {line_m: 1.5}", "- {arc_deg: 90}"], r"way\.yaml:3: piece 1: arc_deg 90 has neither radius_m"),
        (["pieces:", "- {line_m: 1, arc_deg: 90, radius_m: 1}"], r"way\.yaml:2: piece 0 has line_m and arc_deg"),
        (
            ["start: {x_m: 1}", "pieces:", "- {from_m: [1, 0], line_m: 1}", "- {from_m: [3, 0], line_m: 1}"],
            r"way\.yaml:4: piece 1 begins 1\.000 m beside the end of piece 0",
        ),
        (["pieces:", "- {line_m: 1}", "- {line_to_m: [3, 1]}"], r"way\.yaml:3: .*points count in the frame"),
    ],
)
async def test_a_mistake_in_a_path_file_of_a_page_is_told_with_its_line(
    robot: Robot, lines: list[Any], told: str
) -> None:
    with pytest.raises(UsageError, match=told):
        await paths.parse_path(robot, {"file": "way.yaml", "lines": lines})


async def test_points_of_a_path_without_a_start_are_judged_from_where_the_vehicle_is(robot: Robot) -> None:
    lines = ["pieces:", "- {line_m: 1}", "- {line_to_m: [3, 1]}"]
    here = {"x_m": 0.5, "y_m": 1.0, "heading_deg": 0.0}
    told = await paths.parse_path(robot, {"file": "way.yaml", "lines": lines, "here": here})
    assert len(told["path"]["pieces"]) == 2
